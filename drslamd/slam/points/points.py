"""What one robot knows of things that stand around it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from drslamd.conventions import SECOND_US, Chain, is_node
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement, RangeMeasurement
from drslamd.slam.graph.pose_graph import MAX_NODES, PoseGraph
from drslamd.slam.points.point_search import PlaceFound
from drslamd.slam.points.point_tracker import AGREE_M, PointTracker, Sensors, Target
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer

FIRST_NUMBER = 1 << 29
"""Of closures that tell a place: above all of module 2, below those of a hole in odometry."""
EVERY_US = SECOND_US * 9 // 10
"""Timers of a second may be so uneven."""
MOST = 32
"""Things that are followed at once, half of what a radio cell holds: 4 ranges of 26 bytes a second
would be too much for all of it, and nobody needs more to know where he is."""


class Answer(NamedTuple):
    """What a search said of a module, taken for what, and for which time of our clock."""

    uwb_id: int
    target: Target
    found: PlaceFound
    when: int


class Points:
    """Of one robot.

    Attributes:
        trackers: by UWB id.
    """

    def __init__(self, own: Chain, sensors: Sensors) -> None:
        self._own, self._sensors = own, sensors
        self.trackers: dict[int, PointTracker] = {}
        self._number = FIRST_NUMBER
        self._looked = 0
        self._let_go: list[ClosureMeasurement] = []
        self._left: dict[int, ClosureMeasurement] = {}
        """What is told of modules that are not followed any more, by UWB id."""

    def is_due(self, utime: int) -> bool:
        """Is it time to look again?"""
        return utime - self._looked >= EVERY_US

    def look(
        self,
        targets: Mapping[int, Target],
        ranges: Mapping[int, RangeBuffer],
        own: PairEnd,
        graph: PoseGraph,
        estimate: TeamEstimate | None,
        carrier: Callable[[int], int | None],
        utime: int,
    ) -> Callable[[], list[Answer]] | None:
        """Once a second: follow what stands; the searches that are due.

        Args:
            targets: what is heard and may stand, by UWB id; carrier: which robot carries a module.
        """
        if not self.is_due(utime):
            return None
        self._looked = utime
        self._withdraw_robots(carrier, graph, utime)
        self._follow(targets, utime)
        runs = []
        for uwb_id, tracker in self.trackers.items():
            buffer = ranges.get(uwb_id)
            if buffer is None or uwb_id not in targets:
                continue
            is_outdated = tracker.is_outdated(graph)
            if is_outdated and tracker.is_proven:
                tracker.begin_again(utime)
            elif is_outdated:
                tracker.let_go(utime)
            elif estimate is not None and tracker.watch(estimate, own, buffer):
                tracker.leave(own, buffer, utime)
            tracker.sample(own, buffer)
            run = tracker.look(own, buffer, utime)
            if run is not None:
                runs.append((uwb_id, tracker.target, run))
        return partial(_answers, runs) if runs else None

    def _withdraw_robots(
        self, carrier: Callable[[int], int | None], graph: PoseGraph, utime: int
    ) -> None:
        """What was a module alone is a robot as soon as its log has begun, in sight or not."""
        told = {u: t for u, t in self.trackers.items() if is_node(t.target.chain.robot)}
        for uwb_id in [u for u in (*told, *self._left) if carrier(u) in graph.chains]:
            if uwb_id in told:
                told[uwb_id].let_go(utime)
                self._let_go += self.trackers.pop(uwb_id).tell()
            if uwb_id in self._left:
                self._let_go.append(replace(self._left.pop(uwb_id), kept=False))

    def _follow(self, targets: Mapping[int, Target], utime: int) -> None:
        for uwb_id, target in targets.items():
            known = self.trackers.get(uwb_id)
            if known is not None and known.target.chain != target.chain:
                # a robot is switched on beside its module, or starts again
                known.let_go(utime)
                self._let_go += known.tell()
                del self.trackers[uwb_id]
            elif known is not None and known.target.n != target.n and not is_node(target.chain[0]):
                # it has driven to another place; what was told of the old one stays true
                self._let_go += known.tell()
                del self.trackers[uwb_id]
            if uwb_id not in self.trackers and len(self.trackers) >= MOST:
                self._make_room(targets)
            if uwb_id not in self.trackers and len(self.trackers) < MOST:
                self.trackers[uwb_id] = PointTracker(target, self._sensors)
        for uwb_id in [u for u in self.trackers if u not in targets]:
            if self.trackers[uwb_id].told is None:
                del self.trackers[uwb_id]

    def _make_room(self, heard: Mapping[int, Target]) -> None:
        """Forget one that is not heard; what was told of it stays told."""
        away = next((uwb_id for uwb_id in self.trackers if uwb_id not in heard), None)
        if away is None:
            return
        tracker = self.trackers.pop(away)
        self._let_go += tracker.tell()
        if tracker.told is not None and is_node(tracker.target.chain.robot):
            self._left[away] = tracker.told
            if len(self._left) > MAX_NODES:
                del self._left[next(iter(self._left))]

    def on_found(
        self,
        answers: list[Answer],
        ranges: Mapping[int, RangeBuffer],
        own: PairEnd | None,
        graph: PoseGraph,
        estimate: TeamEstimate | None,
    ) -> bool:
        """Searches have ended: is there a closure to tell?"""
        is_told = False
        for uwb_id, target, found, when in answers:
            tracker, buffer = self.trackers.get(uwb_id), ranges.get(uwb_id)
            if tracker is None or tracker.target != target or buffer is None or own is None:
                continue
            if not tracker.is_certain(found, own, when):
                continue
            n = target.n
            if is_node(target.chain.robot):
                n = _place_number(target.chain, found, own, when, graph, estimate)
            self._number += 1
            is_told |= tracker.say(n, own, buffer, when, self._number)
        return is_told

    def tell(self) -> list[ClosureMeasurement]:
        """Closures for our log."""
        out, self._let_go = self._let_go, []
        return out + [c for tracker in self.trackers.values() for c in tracker.tell()]

    def tell_ranges(self) -> list[RangeMeasurement]:
        """Ranges to modules that no robot carries, for our log."""
        return [r for tracker in self.trackers.values() for r in tracker.tell_ranges()]


def _answers(runs: list[tuple[int, Target, Callable[[], tuple[PlaceFound, int]]]]) -> list[Answer]:
    return [Answer(uwb_id, target, *run()) for uwb_id, target, run in runs]


def _places_told(graph: PoseGraph, node: Chain) -> Iterator[float]:
    """Places of a node that somebody tells."""
    for pair in graph.usable():
        if pair.b == node:
            yield from pair.closures.b_n.tolist()


def _place_number(
    node: Chain,
    found: PlaceFound,
    own: PairEnd,
    when: int,
    graph: PoseGraph,
    estimate: TeamEstimate | None,
) -> int:
    """Which place of a node it is: the one that others tell, or the next."""
    known = graph.nodes.get(node.robot)
    following = int(known.keyframes.n[-1]) + 1 if known is not None else 0
    last = int(max(_places_told(graph, node), default=-1))
    if last < 0:
        return following
    if known is not None and known.keyframes.n[-1] > last:
        return int(known.keyframes.n[-1])  # (it has left the last one that was found)
    if estimate is None:
        return last
    robot = own.data.chain.robot
    solved, there = estimate.trajectories.get(robot), estimate.nodes.get(node.robot)
    if solved is None or there is None or int(there.n[-1]) != last or not len(solved.n):
        return last
    n = int(solved.n[-1])
    if not own.track.covers(n, own.track.end - 1):
        return last
    w_T_o = se2.compose(solved.poses[-1], se2.inverse(own.track.at(n)))
    place = se2.transform(se2.compose(w_T_o, own.poses(when)[0]), found.candidates[0].place)
    away = float(np.hypot(*(place - there.poses[-1, :2])))
    return last if away < 2 * AGREE_M else following
