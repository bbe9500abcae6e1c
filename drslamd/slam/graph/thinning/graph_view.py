"""The graph that module 3 solves, as it follows from what is held."""

from __future__ import annotations

from collections import deque
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
from drslamd.slam.graph.thinning.joints import Joint, joints_of, only_segments
from drslamd.slam.graph.thinning.pair_view import PairThinning, PairView
from drslamd.slam.graph.thinning.team_chains import TeamChains
from drslamd.slam.graph.thinning.thinned_pairs import (
    PairPart,
    Unthinned,
    spans_of,
    thinned_pairs,
)
from drslamd.slam.graph.thinning.time_cells import ages, recent_s

AT_ONCE, PAIRS_AT_ONCE = 24, 128
"""Stretches of pairs that are thinned together, and pairs of which few said anything."""
CHAIN, PAIR, BEGUN, PART, OLD = 1.0, 0.06, 0.3, 0.2, 4
"""Work (`Thinning.steps`) of: a chain, and each of its parts that is made; a pair that is looked
at; its clocks, and each of its stretches that is taken up; one that is thinned; and as how many
of these one of old times counts."""

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
                h.update(view.digested)
        for pair in self.pairs:
            if {pair.a.robot, pair.b.robot} <= robots:
                h.update(pair.digested)
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
        self._former: deque[ChainView | PairView] = deque()
        self._latest: deque[ChainView | PairView] = deque()
        """Views that were made last, and those before them: nearly all of what these hold goes at
        a step of time, and is let go bit by bit, for all at once takes 10 ms of fifty robots."""

    def steps(
        self,
        chains: Mapping[int, ChainData],
        nodes: Mapping[int, ChainData],
        pairs: list[PairData],
    ) -> Steps:
        """The graph as it is now, after some steps between which nothing of it may change; each
        says how much work it was, in what one chain of the team is in a second (about 0.2 ms).

        Args:
            chains: all that are held, by robot; nodes: likewise of modules that no robot carries;
            pairs: of two of these.
        """
        yield from self._let_go()
        known: dict[int, ChainData] = {}
        newest: dict[int, int] = {}
        for robot, data in sorted(chains.items()):
            if len(data.keyframes):
                known[robot], newest[robot] = data, int(data.keyframes.rows[-1, 0])
            yield CHAIN / 2
        ahead: dict[tuple[int, int], Ahead] = {}
        for pair in pairs:
            found = None if is_node(pair.b.robot) else pair.ahead()
            if found is not None:
                ahead[pair.a.robot, pair.b.robot] = found
            yield BEGUN
        teams = clocks.shifts(set(chains), ahead)
        age, recent = ages(newest, teams), recent_s(len(chains), self._recent_s)
        known |= nodes
        age |= dict.fromkeys(nodes, 0)
        views = yield from self._chain_views(known, age, recent)
        before_pairs, self._pairs = self._pairs, {}
        begun: deque[Begun] = deque()
        for pair in pairs:
            a, b = pair.a.robot, pair.b.robot
            if a in views and b in views:
                of_pair = before_pairs.get((pair.a, pair.b)) or PairThinning()
                self._pairs[pair.a, pair.b] = of_pair
                begun.append(of_pair.begin(pair, (known[a], known[b]), views[a], views[b]))
                yield PAIR + BEGUN * len(begun[-1][0])
        of_pairs, joints = [], []
        spans = spans_of(part for said, _ in begun for part in said)
        yield PAIR / 2 * len(begun)
        team, only = TeamChains(views, spans), only_segments(views)
        yield CHAIN * len(views)
        for some in _batches(begun):
            thinned = thinned_pairs([part for said, _ in some for part in said], team)
            yield _work(some)
            parts = iter(thinned)
            made = [finish(list(islice(parts, len(said)))) for said, finish in some]
            of_pairs += made
            joints += joints_of(views, only, made)
            _ = [view.digested for view in made]  # (remembered likewise)
            yield PAIR / 2 * len(some) + PART * len(thinned)
        self._former, self._latest = self._latest, deque([*views.values(), *of_pairs])
        shifts = {robot: shift for table in teams for robot, shift in table.items()}
        return GraphView(views, of_pairs, dict.fromkeys(nodes, 0.0) | shifts, joints)

    def _let_go(self) -> Iterator[float]:
        """Forget what was seen before the last view."""
        while self._former:
            self._former.popleft()
            yield PAIR / 2

    def _chain_views(
        self, known: Mapping[int, ChainData], age: Mapping[int, int], recent: int
    ) -> Generator[float, None, dict[int, ChainView]]:
        """Of all chains, by robot."""
        before, self._chains, views = self._chains, {}, {}
        for robot, data in known.items():
            thinning = before.get(data.chain) or ChainThinning()
            self._chains[data.chain] = thinning
            views[robot] = thinning.view(data, age[robot], recent)
            _ = views[robot].digested  # (remembered: so a digest of the whole takes no long)
            yield CHAIN * (1 + thinning.made)
        return views


def _batches(begun: deque[Begun]) -> Iterator[list[Begun]]:
    """Some pairs after the other, which are then forgotten."""
    some: list[Begun] = []
    parts = 0
    while begun:
        some.append(begun.popleft())
        parts += len(some[-1][0])
        if parts >= AT_ONCE or len(some) >= PAIRS_AT_ONCE:
            yield some
            some, parts = [], 0
    if some:
        yield some


def _work(some: list[Begun]) -> float:
    """How much it was to thin them."""
    return sum(PART * (OLD if part.is_old else 1) for said, _ in some for part in said)
