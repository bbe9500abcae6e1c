"""The team's pose graph: what all robots said, kept as arrays.

Measurements are keyed by who made them and when, so inserting is idempotent and the order of
arrival does not matter. A measurement may name a keyframe that has not arrived yet; it waits and
counts once both ends are there. A robot that starts again begins a new chain and its old one is
forgotten.

Measurements come from other robots, so nothing is believed that would harm what is made of them: a
robot may send nonsense, and then only its own trajectory is nonsense.
"""

from __future__ import annotations

from drslamd.conventions import Chain, is_node
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.chapters.books import PER_ENTRY
from drslamd.slam.graph.measurements import Chapter, GraphEntry, Keyframe
from drslamd.slam.graph.pair_data import PairData
from drslamd.slam.graph.thinning import time_cells
from drslamd.slam.graph.thinning.graph_view import GraphView, Steps, Thinning
from drslamd.slam.graph.thinning.time_cells import RECENT_S

MAX_NODES = 256
"""Modules without a robot; a radio cell holds 64, and a team drives through some cells."""
MAX_PLACES = 512
"""Where one of them stood: whoever carries it about all day comes to less."""
MAX_WAITING = 8_192
"""Entries that wait while the graph is looked at: a minute of a team of 128. Who hears more in the
seconds that a look takes is flooded, and the rest of the look is then made in one go."""
ALL = 2**31
"""Work: more than any view is."""


def _as_chapter(entry: GraphEntry) -> Chapter:
    """What an entry says, in the form in which it is said again."""
    begin = entry.seq * PER_ENTRY
    return Chapter(
        parts=0,
        models=((entry.seq, entry.model),) if entry.model else (),
        keyframes=entry.keyframes,
        ranges=tuple(enumerate(entry.ranges, start=begin)),
        closures=tuple(enumerate(entry.closures, start=begin)),
    )


class PoseGraph:
    """All chains and pairs that this robot holds.

    Attributes:
        nodes: of modules that no robot carries: a keyframe and a segment for each place where one
            stood, because nothing leads from one to the next.
    """

    def __init__(self, recent_s: int = RECENT_S) -> None:
        """
        Args:
            recent_s: how long nothing is thinned.
        """
        self.chains: dict[int, ChainData] = {}
        self.nodes: dict[int, ChainData] = {}
        self.pairs: dict[tuple[int, int], PairData] = {}
        self._thinning, self._recent_s = Thinning(recent_s), recent_s
        self._view: GraphView | None = None
        self._steps: Steps | None = None
        """Of the view that is being made."""
        self._waiting: list[tuple[Chain, GraphEntry | None]] = []
        """What came meanwhile, `MAX_WAITING` at most."""
        self._forgets = recent_s <= RECENT_S
        """What chapters leave out is needed where times are recent for longer than usual."""

    @property
    def recent_s(self) -> int:
        """How long nothing is thinned."""
        return time_cells.recent_s(len(self.chains), self._recent_s)

    @property
    def view(self) -> GraphView:
        """What module 3 solves: old times thinned, and the same for all who hold the same."""
        while self._view is None:
            self.look(ALL)
        return self._view

    def look(self, most: float) -> PoseGraph | None:
        """The view and nothing else (see `frozen`), or None where it takes longer: then ask again.

        It is of what was there when it was begun; what is inserted meanwhile waits for its end.

        Args:
            most: work, as `Thinning.steps` counts it, after which it is left for later.
        """
        if self._view is not None:
            return self.frozen()
        if self._steps is None:
            self._steps = self._thinning.steps(self.chains, self.nodes, self.usable())
        try:
            while most > 0:
                most -= next(self._steps)
        except StopIteration as end:
            view: GraphView = end.value
        else:
            return None
        self._steps, self._view = None, view
        still = self.frozen()
        waiting, self._waiting = self._waiting, []
        for origin, entry in waiting:
            if entry is None:
                self.begin(origin)
            else:
                self.insert(origin, entry)
        return still

    def frozen(self) -> PoseGraph:
        """The view as it is now and nothing else, for a thread that is not ours."""
        return PoseGraph.of(self.view)

    @staticmethod
    def of(view: GraphView) -> PoseGraph:
        """A view and nothing else."""
        still = PoseGraph()
        still._view = view
        return still

    def begin(self, origin: Chain) -> bool:
        """A start of a robot was heard of; did earlier ones say anything that counts no longer?

        Logs begin anew with it. Of an old start nobody can learn what he lacks, so graphs that kept
        it until the first entry of the new one would differ.
        """
        self._make_room()
        data = self.chains.get(origin.robot)
        if data is None or origin.epoch <= data.chain.epoch:
            return False
        if self._steps is not None:
            self._waiting.append((origin, None))
        else:
            self.forget(origin.robot)
        return True

    def insert(self, origin: Chain, entry: GraphEntry) -> None:
        """Take one entry of a robot's log."""
        self._make_room()
        if self._steps is not None:
            self._waiting.append((origin, entry))
            return
        self._view = None
        data = self.chains.get(origin.robot)
        if data is not None and origin.epoch < data.chain.epoch:
            return
        if data is None or origin.epoch > data.chain.epoch:
            self.forget(origin.robot)
            data = self.chains[origin.robot] = ChainData(origin)
        if self._forgets and data.stands_for(entry.seq):
            return
        said = entry.chapter or _as_chapter(entry)
        for seq, model in said.models:
            data.take_model(seq, model)
        for k in said.keyframes:
            data.add(k, entry.seq)
        for place, r in said.ranges:
            pair = self._pair(origin, r.peer, r.b_n)
            if pair:
                pair.add_range(place, r, entry.seq)
        for place, c in said.closures:
            pair = self._pair(origin, c.peer, c.b_n)
            if pair:
                pair.add_closure(place, c, entry.seq)
        replaced = data.take_part(entry.seq, said) if entry.chapter else ()
        if replaced and self._forgets:
            data.replace(replaced)
            for pair in self.pairs.values():
                if pair.a == origin:
                    pair.replace(replaced)

    def _make_room(self) -> None:
        """For one more that waits."""
        if self._steps is not None and len(self._waiting) >= MAX_WAITING:
            self.look(ALL)

    def _pair(self, a: Chain, b: Chain, b_n: int) -> PairData | None:
        """The pair's data; None for a start of b that is already past, for a pair of one, and for
        one module or one place of it too many."""
        if is_node(b.robot) and not self._has_stood(b, b_n):
            return None
        pair = self.pairs.get((a.robot, b.robot))
        if pair and pair.a == a and pair.b == b:
            return pair
        if a.robot == b.robot or (pair and pair.b.epoch > b.epoch):
            return None
        pair = self.pairs[a.robot, b.robot] = PairData(a, b)
        return pair

    def _has_stood(self, node: Chain, place: int) -> bool:
        """A module stood at a place: is there room for that?"""
        if place >= MAX_PLACES or (node.robot not in self.nodes and len(self.nodes) >= MAX_NODES):
            return False
        data = self.nodes.setdefault(node.robot, ChainData(node))
        if place not in data.keyframes.n:
            data.add(Keyframe(place, place, 0, 0, 0))
        return True

    def forget(self, robot: int) -> None:
        """Drop a robot's chain and what was measured by it."""
        self._view = None
        self.chains.pop(robot, None)
        for key in [k for k, p in self.pairs.items() if p.a.robot == robot]:
            del self.pairs[key]

    def usable(self) -> list[PairData]:
        """Pairs whose both chains are the current ones."""
        return [
            pair
            for _, pair in sorted(self.pairs.items())
            if self._is_current(pair.a) and self._is_current(pair.b)
        ]

    def _is_current(self, chain: Chain) -> bool:
        data = (self.nodes if is_node(chain.robot) else self.chains).get(chain.robot)
        return data is not None and data.chain == chain

    def digest(self, robots: set[int]) -> int:
        """A number that two robots share when they hold the same graph of these robots."""
        return self.view.digest(robots)
