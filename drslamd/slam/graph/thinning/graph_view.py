"""The graph that module 3 solves, as it follows from what is held."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass
from hashlib import blake2b
from itertools import islice

from drslamd.conventions import Chain, Segment, is_node
from drslamd.slam.graph import clocks
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.clocks import Ahead
from drslamd.slam.graph.pair_data import PairData
from drslamd.slam.graph.tables import KeyframeTable
from drslamd.slam.graph.thinning.chain_view import ChainThinning, ChainView
from drslamd.slam.graph.thinning.joints import Joint, joints_of
from drslamd.slam.graph.thinning.pair_view import PairThinning, PairView
from drslamd.slam.graph.thinning.thinned_pairs import (
    PairPart,
    Unthinned,
    chains_of,
    digested,
    thinned_pairs,
)
from drslamd.slam.graph.thinning.time_cells import ages, recent_s

AT_ONCE = 24
"""Stretches of pairs that are thinned together."""

Begun = tuple[list[Unthinned], Callable[[list[PairPart]], PairView]]
"""See `PairThinning.begin`."""


@dataclass(frozen=True, eq=False)
class GraphView:
    """All chains, and all pairs of them.

    Attributes:
        chains: by robot, those without a keyframe left out; modules that no robot carries are
            among them, at a time before all others.
        pairs: whose both chains are there, in the order of their robots.
        shifts: clock of each robot minus that of the first of its team, samples.
        joints: of all segments that are joined.
    """

    chains: Mapping[int, ChainView]
    pairs: list[PairView]
    shifts: Mapping[int, float]
    joints: list[Joint]

    def segment(self, segment: Segment) -> KeyframeTable:
        """The keyframes of a segment that stay."""
        keyframes = self.chains[segment.robot].keyframes
        return keyframes.chosen(keyframes.of_segment(segment.segment))

    def digest(self, robots: set[int]) -> int:
        """A number that two robots share when they hold the same graph of these robots."""
        h = blake2b(digest_size=8)
        for robot, view in sorted(self.chains.items()):
            if robot in robots and not is_node(robot):
                h.update(repr((view.chain, view.model.numbers())).encode())
                h.update(view.digested())
        for pair in self.pairs:
            if {pair.a.robot, pair.b.robot} <= robots:
                h.update(digested(pair.parts))
        return int.from_bytes(h.digest(), "big", signed=True)


Steps = Generator[float, None, GraphView]


class Thinning:
    """Makes the view of what is held, again and again; what is old is rarely made anew."""

    def __init__(self, recent_s: int) -> None:
        """
        Args:
            recent_s: see `time_cells.RECENT_S`.
        """
        self._recent_s = recent_s
        self._chains: dict[Chain, ChainThinning] = {}
        self._pairs: dict[tuple[Chain, Chain], PairThinning] = {}

    def steps(
        self,
        chains: Mapping[int, ChainData],
        nodes: Mapping[int, ChainData],
        pairs: list[PairData],
    ) -> Steps:
        """The graph as it is now, after some steps between which nothing of it may change; each
        says how much work it was, in what one pair of the team is in a second (about 0.2 ms).

        Args:
            chains: all that are held, by robot; nodes: likewise of modules that no robot carries;
            pairs: of two of these.
        """
        known = {robot: data for robot, data in sorted(chains.items()) if len(data.keyframes)}
        newest = {robot: int(data.keyframes.rows[-1, 0]) for robot, data in known.items()}
        ahead: dict[tuple[int, int], Ahead] = {}
        for pair in pairs:
            found = None if is_node(pair.b.robot) else pair.ahead()
            if found is not None:
                ahead[pair.a.robot, pair.b.robot] = found
            yield 0.1
        teams = clocks.shifts(set(chains), ahead)
        age, recent = ages(newest, teams), recent_s(len(chains), self._recent_s)
        known |= nodes
        age |= dict.fromkeys(nodes, 0)
        before, self._chains, views = self._chains, {}, {}
        for robot, data in known.items():
            thinning = before.get(data.chain) or ChainThinning()
            self._chains[data.chain] = thinning
            views[robot] = thinning.view(data, age[robot], recent)
            # (remembered: so a digest of the whole takes no long)
            views[robot].digested()
            yield 2 + thinning.made
        before_pairs, self._pairs = self._pairs, {}
        begun: list[Begun] = []
        for pair in pairs:
            a, b = pair.a.robot, pair.b.robot
            if a in views and b in views:
                of_pair = before_pairs.get((pair.a, pair.b)) or PairThinning()
                self._pairs[pair.a, pair.b] = of_pair
                begun.append(of_pair.begin(pair, (known[a], known[b]), views[a], views[b]))
                yield 0.5
        of_pairs, joints = [], []
        team = chains_of([part for said, _ in begun for part in said], views)
        yield len(views) / 2
        for some in _batches(begun):
            thinned = thinned_pairs([part for said, _ in some for part in said], team)
            parts = iter(thinned)
            made = [finish(list(islice(parts, len(said)))) for said, finish in some]
            of_pairs += made
            joints += joints_of(views, made)
            digested(thinned)
            yield 0.6 * len(thinned)
        shifts = {robot: shift for table in teams for robot, shift in table.items()}
        return GraphView(views, of_pairs, dict.fromkeys(nodes, 0.0) | shifts, joints)


def _batches(begun: list[Begun]) -> Iterator[list[Begun]]:
    """Some pairs after the other."""
    some: list[Begun] = []
    parts = 0
    for each in begun:
        some.append(each)
        parts += len(each[0])
        if parts >= AT_ONCE:
            yield some
            some, parts = [], 0
    if some:
        yield some
