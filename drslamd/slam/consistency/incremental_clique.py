"""Largest set of mutually consistent vertices, kept up to date as vertices arrive.

Adjacency is a table of bits, 64 to a word, so that whole neighbourhoods are intersected and counted
at once; sets that go in and out are integers, bit k for vertex k. A new vertex can only enlarge the
maximum by being in it, so only cliques through it are searched. The search is a heuristic; what it
returns is always a clique, because it ends when all that are left are neighbours of each other.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Words = NDArray[np.uint64]
WORD = 64
GONE = 1 << 40
"""More neighbours than anybody has, also after all of them went."""
_ONES_OF_BYTE = np.array([value.bit_count() for value in range(256)], dtype=np.int64)


def bits(mask: int) -> list[int]:
    """Positions of the set bits, ascending."""
    size = (mask.bit_length() + 7) // 8
    data = np.frombuffer(mask.to_bytes(size, "little"), np.uint8)
    found: list[int] = np.flatnonzero(np.unpackbits(data, bitorder="little")).tolist()
    return found


class IncrementalClique:
    """Vertices with their edges, and the largest clique found so far."""

    def __init__(self) -> None:
        self._rows: Words = np.zeros((WORD, 1), dtype=np.uint64)
        self._count = 0
        self.clique = 0

    def __len__(self) -> int:
        return self._count

    @property
    def adjacency(self) -> list[int]:
        """Neighbours of every vertex (bits)."""
        return [int.from_bytes(row.tobytes(), "little") for row in self._rows[: self._count]]

    def add(self, neighbours: int) -> None:
        """Add the next vertex with its edges to earlier ones (bits)."""
        new = self._count
        self._count += 1
        if self._count > len(self._rows):
            self._resize(2 * len(self._rows))
        self._rows[new] = self._words(neighbours)
        word, bit = divmod(new, WORD)
        self._rows[:new, word] |= _flags(self._rows[new])[:new].astype(np.uint64) << np.uint64(bit)
        if not self.clique & ~neighbours:
            self.clique |= 1 << new
            return
        # with the new vertex it takes as many neighbours as the clique has members to be larger
        found = self._thinned(neighbours | 1 << new, self.clique.bit_count() + 1)
        self.clique = found or self.clique

    def is_verified(self) -> bool:
        """The check that every result passes before anything believes it."""
        clique = self._words(self.clique)
        members = np.flatnonzero(_flags(clique))
        lacking = clique & ~self._rows[members]
        own = np.uint64(1) << (members % WORD).astype(np.uint64)
        lacking[np.arange(len(members)), members // WORD] ^= own
        return not lacking.any()

    def _thinned(self, allowed: int, least: int) -> int:
        """A clique of at least so many vertices within `allowed` (bits), 0 when none was found.

        Whoever has too few neighbours left to be in one goes at once; then, one by one, whoever
        has the fewest. Ties go by the lowest number, so the result depends on nothing else.
        """
        left = allowed.bit_count()
        if left < least:
            return 0
        words = self._words(allowed)
        vertices = np.flatnonzero(_flags(words))
        degree = np.full(WORD * len(words), GONE)
        degree[vertices] = _ones(self._rows[vertices] & words)
        while left >= least:
            fewest = int(np.argmin(degree))
            if degree[fewest] == left - 1:
                found = np.packbits(degree < left, bitorder="little")
                return int.from_bytes(found.tobytes(), "little")
            if degree[fewest] < least - 1:
                hopeless = np.flatnonzero(degree < least - 1)
                left -= len(hopeless)
                degree -= _flags(self._rows[hopeless]).sum(axis=0, dtype=np.int64)
                degree[hopeless] = GONE
            else:
                left -= 1
                degree -= _flags(self._rows[fewest])
                degree[fewest] = GONE
        return 0

    def runner_up(self, least: int = 1, allowed: int | None = None) -> int:
        """The largest clique found among the vertices outside the best one (bits).

        Args:
            least: vertices that it must have to be of interest.
            allowed: vertices that may be in it (bits); all where it is None.
        """
        rest = ((1 << self._count) - 1) & ~self.clique
        rest &= rest if allowed is None else allowed
        best, least = 0, least - 1
        for start in bits(rest):
            neighbours = int.from_bytes(self._rows[start].tobytes(), "little")
            found = self._thinned((neighbours & rest) | 1 << start, least + 1)
            if found:
                best, least = found, found.bit_count()
        return best

    def drop_oldest(self, count: int) -> None:
        """Forget vertices 0 .. count - 1; the others move down."""
        flags = np.zeros((len(self._rows), len(self._rows)), dtype=np.uint8)
        kept = self._count - count
        flags[:kept, :kept] = _flags(self._rows)[count : self._count, count : self._count]
        self._rows = np.packbits(flags, axis=1, bitorder="little").view(np.uint64)
        self._count = kept
        self.clique >>= count
        # what is left of the largest may have become the smaller one
        self.clique = self.runner_up(self.clique.bit_count() + 1) or self.clique

    def _resize(self, size: int) -> None:
        rows = np.zeros((size, size // WORD), dtype=np.uint64)
        rows[: len(self._rows), : self._rows.shape[1]] = self._rows
        self._rows = rows

    def _words(self, mask: int) -> Words:
        data = mask.to_bytes(8 * self._rows.shape[1], "little")
        return np.frombuffer(data, "<u8").astype(np.uint64)


def _flags(words: Words) -> NDArray[np.uint8]:
    """(..., 64 w) zeros and ones of (..., w) words."""
    return np.unpackbits(np.ascontiguousarray(words).view(np.uint8), axis=-1, bitorder="little")


def _ones(words: Words) -> NDArray[np.int64]:
    """(m,) how many bits are set in (m, w) words."""
    count: Any = getattr(np, "bitwise_count", None)
    if count is None:
        # before numpy 2
        return np.asarray(_ONES_OF_BYTE[words.view(np.uint8)].sum(axis=1))
    return np.asarray(count(words).sum(axis=1, dtype=np.int64))
