"""The graph that module 3 solves, as it follows from what is held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from itertools import islice

from drslamd.conventions import Chain, Segment, is_node
from drslamd.slam.graph import clocks
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.pair_data import PairData
from drslamd.slam.graph.tables import KeyframeTable
from drslamd.slam.graph.thinning.chain_view import ChainThinning, ChainView
from drslamd.slam.graph.thinning.joints import Joint, joints_of
from drslamd.slam.graph.thinning.pair_view import PairThinning, PairView
from drslamd.slam.graph.thinning.rounding import as_digested
from drslamd.slam.graph.thinning.thinned_pairs import thinned_pairs
from drslamd.slam.graph.thinning.time_cells import ages, recent_s


@dataclass(frozen=True, eq=False)
class GraphView:
    """All chains, and all pairs of them.

    Attributes:
        chains: by robot, those without a keyframe left out; modules that no robot carries are
            among them, at a time before all others.
        pairs: whose both chains are there, in the order of their robots.
        shifts: clock of each robot minus that of the first of its team, samples.
    """

    chains: Mapping[int, ChainView]
    pairs: list[PairView]
    shifts: Mapping[int, float]

    @cached_property
    def joints(self) -> list[Joint]:
        """Of all segments that are joined."""
        return joints_of(self.chains, self.pairs)

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
                links = view.links
                for values in (view.keyframes.rows, links.measured, links.sums, links.by_turn):
                    h.update(as_digested(values))
        for pair in self.pairs:
            if {pair.a.robot, pair.b.robot} <= robots:
                h.update(b"".join(part.digest for part in pair.parts))
        return int.from_bytes(h.digest(), "big", signed=True)


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

    def view(
        self,
        chains: Mapping[int, ChainData],
        nodes: Mapping[int, ChainData],
        pairs: list[PairData],
    ) -> GraphView:
        """The graph as it is now.

        Args:
            chains: all that are held, by robot; nodes: likewise of modules that no robot carries;
            pairs: of two of these.
        """
        known = {robot: data for robot, data in sorted(chains.items()) if len(data.keyframes)}
        newest = {robot: int(data.keyframes.rows[-1, 0]) for robot, data in known.items()}
        clocked = [pair for pair in pairs if not is_node(pair.b.robot)]
        ahead = {(pair.a.robot, pair.b.robot): pair.ahead() for pair in clocked}
        teams = clocks.shifts(set(chains), {k: found for k, found in ahead.items() if found})
        steps, recent = ages(newest, teams), recent_s(len(chains), self._recent_s)
        known |= nodes
        steps |= dict.fromkeys(nodes, 0)
        before, self._chains, views = self._chains, {}, {}
        for robot, data in known.items():
            thinning = before.get(data.chain) or ChainThinning()
            self._chains[data.chain] = thinning
            views[robot] = thinning.view(data, steps[robot], recent)
        return GraphView(
            chains=views,
            pairs=self._views_of_pairs(known, pairs, views),
            shifts=dict.fromkeys(nodes, 0.0)
            | {robot: shift for team in teams for robot, shift in team.items()},
        )

    def _views_of_pairs(
        self, chains: Mapping[int, ChainData], pairs: list[PairData], views: Mapping[int, ChainView]
    ) -> list[PairView]:
        before, self._pairs = self._pairs, {}
        begun = []
        for pair in pairs:
            a, b = pair.a.robot, pair.b.robot
            if a not in views or b not in views:
                continue
            thinning = before.get((pair.a, pair.b)) or PairThinning()
            self._pairs[pair.a, pair.b] = thinning
            begun.append(thinning.begin(pair, chains[b], views[a], views[b]))
        parts = iter(thinned_pairs([part for said, _ in begun for part in said], views))
        return [finish(list(islice(parts, len(said)))) for said, finish in begun]
