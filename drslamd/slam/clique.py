"""Largest set of mutually consistent vertices, kept up to date as vertices arrive.

Adjacency is one Python integer per vertex, bit k for vertex k: a thousand vertices intersect in
one machine-speed operation. A new vertex can only enlarge the maximum by being in it, so only
cliques through it are searched. The search is a heuristic; what it returns is always a clique,
because every vertex is drawn from the common neighbours of all before it.
"""

from __future__ import annotations


def bits(mask: int) -> list[int]:
    """Positions of the set bits, ascending."""
    out = []
    while mask:
        low = mask & -mask
        out.append(low.bit_length() - 1)
        mask ^= low
    return out


def greedy(adjacency: list[int], start: int, allowed: int) -> int:
    """A clique (as bits) that contains `start`, within `allowed`.

    Always takes the candidate with the most neighbours among the remaining candidates; ties go
    to the lowest number, so the result does not depend on anything but the graph.
    """
    clique = 1 << start
    candidates = adjacency[start] & allowed
    while candidates:
        best, score, shared = -1, -1, 0
        for vertex in bits(candidates):
            common = adjacency[vertex] & candidates
            degree = common.bit_count()
            if degree > score:
                best, score, shared = vertex, degree, common
        clique |= 1 << best
        candidates = shared
        if score == candidates.bit_count() and _complete(adjacency, candidates):
            return clique | candidates
    return clique


def _complete(adjacency: list[int], vertices: int) -> bool:
    """Are all `vertices` (bits) neighbours of each other?"""
    return all((vertices & ~adjacency[v]) == (1 << v) for v in bits(vertices))


def is_clique(adjacency: list[int], clique: int) -> bool:
    """The check that every result passes before anything believes it."""
    return _complete(adjacency, clique)


class IncrementalClique:
    """Vertices with their edges, and the largest clique found so far."""

    def __init__(self) -> None:
        self.adjacency: list[int] = []
        self.clique = 0

    def __len__(self) -> int:
        return len(self.adjacency)

    def add(self, neighbours: int) -> None:
        """Add the next vertex with its edges to earlier ones (bits)."""
        new = len(self.adjacency)
        self.adjacency.append(neighbours)
        for vertex in bits(neighbours):
            self.adjacency[vertex] |= 1 << new
        if not self.clique & ~neighbours:
            self.clique |= 1 << new
            return
        if neighbours.bit_count() + 1 > self.clique.bit_count():
            found = greedy(self.adjacency, new, neighbours)
            if found.bit_count() > self.clique.bit_count():
                self.clique = found

    def runner_up(self) -> int:
        """The largest clique found among the vertices outside the best one (bits)."""
        rest = ((1 << len(self.adjacency)) - 1) & ~self.clique
        best = 0
        for start in bits(rest):
            if (self.adjacency[start] & rest).bit_count() + 1 > best.bit_count():
                found = greedy(self.adjacency, start, rest)
                if found.bit_count() > best.bit_count():
                    best = found
        return best

    def drop_oldest(self, count: int) -> None:
        """Forget vertices 0 .. count - 1; the others move down."""
        self.adjacency = [mask >> count for mask in self.adjacency[count:]]
        self.clique >>= count
        # what is left of the largest may have become the smaller one
        rival = self.runner_up()
        if rival.bit_count() > self.clique.bit_count():
            self.clique = rival
