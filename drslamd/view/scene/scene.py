"""The team as an onlooker sees it, and what the page has to be told of it.

`Scene.take` believes one message, `Scene.changes` says what is new since it was asked last, and
`Scene.everything` says all that is known, in pieces, to a page that has just come. Both speak the
same language, which is on the page of the folder above.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Union

from drslamd.conventions import SECOND_US, Chain, is_node
from drslamd.gossip.message_types import Hypotheses, Pose, Status
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry, RangeMeasurement
from drslamd.slam.se2 import Array
from drslamd.view.scene import robot_path
from drslamd.view.scene.hearing import Said
from drslamd.view.scene.modules_seen import ModulesSeen
from drslamd.view.scene.pair_seen import ClosureSeen, PairSeen, closure_seen, residual
from drslamd.view.scene.possible_drawn import possible
from drslamd.view.scene.robot_path import RobotPath
from drslamd.view.scene.robot_seen import RobotSeen, picture

MAX_ROBOTS = 64
"""Shown at once: with their paths they are 40 MB. More are counted."""
MAX_PAIRS = 600
"""Of which residuals and closures are kept, 30 kB each: all of a team of 35."""
FORGET_S = 600.0
"""A robot that was silent so long gives way to another, when there are too many."""
OLDEST_S = 5.0
"""No honest pose is older when it is said."""
WAITING = 1_000
"""Measurements that wait for the paths they stand on; the oldest gives way."""
WAITS_S = 6.0


@dataclass(frozen=True)
class _Waiting:
    """A measurement and who made it, since when."""

    t: float
    origin: Chain
    item: Union[RangeMeasurement, ClosureMeasurement]


class Scene:
    """All that is shown."""

    def __init__(self) -> None:
        self.robots: dict[int, RobotSeen] = {}
        self.pairs: dict[tuple[int, int], PairSeen] = {}
        self.modules = ModulesSeen()
        self.not_shown: set[int] = set()
        """Robots beyond `MAX_ROBOTS`; ids bound their number."""
        self._waiting: deque[_Waiting] = deque(maxlen=WAITING)
        self._moved: set[int] = set()
        self._new_closures: list[list[Any]] = []
        self._forgotten: set[tuple[int, ...]] = set()

    # what comes in

    def take(self, said: Said, t: float) -> None:
        """One message that is believed, heard at t, s."""
        seen = self._robot(said.origin, isinstance(said.message, GraphEntry), t)
        if seen is None:
            return
        message = said.message
        if isinstance(message, GraphEntry):
            self._take_entry(seen, message, t)
            return
        seen.heard = t
        if isinstance(message, Status):
            seen.status, seen.state = message, message.state
        elif isinstance(message, Hypotheses):
            seen.possible.add(message, t)
        elif isinstance(message, Pose):
            seen.state = message.state
            if message.state:
                age = (said.utime - message.pose_utime) / SECOND_US
                seen.path.add(message, t, min(max(age, 0.0), OLDEST_S))
                self._moved.add(said.origin.robot)

    def _robot(self, origin: Chain, is_relayed: bool, t: float) -> RobotSeen | None:
        """Whom a message is from; None when there is no room, or it is of another start.

        Entries of logs come late and from others: they say nothing about which start is present.
        """
        seen = self.robots.get(origin.robot)
        if seen is not None and seen.chain == origin:
            return seen
        if is_relayed:
            return None
        if seen is not None:
            seen.begin_again(origin, t)
            self._forget_pairs(origin.robot)
            return seen
        if len(self.robots) >= MAX_ROBOTS and not self._make_room(t):
            self.not_shown.add(origin.robot)
            return None
        self.not_shown.discard(origin.robot)
        self.robots[origin.robot] = RobotSeen(origin, t)
        return self.robots[origin.robot]

    def _make_room(self, t: float) -> bool:
        silent = min(self.robots.values(), key=lambda seen: seen.heard)
        if t - silent.heard < FORGET_S:
            return False
        robot = silent.chain.robot
        del self.robots[robot]
        for key in [key for key in self.pairs if robot in key]:
            del self.pairs[key]
        self.modules.forget(robot)
        self._forgotten.add((robot,))
        return True

    def _forget_pairs(self, robot: int) -> None:
        """What a robot said of its earlier start is void."""
        for key, pair in self.pairs.items():
            if robot in key:
                pair.forget_closures(key[0])
                pair.forget_closures(key[1])
                self._forgotten.add(key)
        self.modules.forget(robot)

    def _take_entry(self, seen: RobotSeen, entry: GraphEntry, t: float) -> None:
        for k in entry.keyframes:
            seen.path.add_keyframe(k)
        items: list[Union[RangeMeasurement, ClosureMeasurement]] = [*entry.ranges, *entry.closures]
        for item in items:
            self._waiting.append(_Waiting(t, seen.chain, item))

    def _pair(self, a: int, b: int) -> PairSeen | None:
        key = min(a, b), max(a, b)
        if key not in self.pairs and len(self.pairs) < MAX_PAIRS:
            self.pairs[key] = PairSeen()
        return self.pairs.get(key)

    # measurements on the paths

    def _settle(self, t: float) -> None:
        """Hold against the paths what has waited for them."""
        for _ in range(len(self._waiting)):
            waiting = self._waiting.popleft()
            if not self._is_settled(waiting, t) and t - waiting.t < WAITS_S:
                self._waiting.append(waiting)

    def _is_settled(self, waiting: _Waiting, t: float) -> bool:
        origin, item = waiting.origin, waiting.item
        if is_node(item.peer.robot):
            if isinstance(item, ClosureMeasurement):
                self.modules.take(origin, item)
            return True
        a, b = self.robots.get(origin.robot), self.robots.get(item.peer.robot)
        if a is None or b is None or (a.chain, b.chain) != (origin, item.peer):
            return False
        if a.path.frame is None or a.path.frame != b.path.frame:
            return False
        w_T_a, w_T_b = _place(a.path, item.a_n), _place(b.path, item.b_n)
        if w_T_a is None or w_T_b is None:
            return False
        pair = self._pair(origin.robot, item.peer.robot)
        if pair is None or origin.robot == item.peer.robot:
            return True
        if isinstance(item, RangeMeasurement):
            pair.add_residual(t, residual(item, w_T_a, w_T_b))
            return True
        seen = closure_seen(item, waiting.t, w_T_a, w_T_b)
        pair.add_closure(origin.robot, seen)
        self._new_closures.append(_closure_row(origin.robot, item.peer.robot, seen))
        return True

    # what the page is told

    def changes(self, t: float, of_all: bool) -> dict[str, Any]:
        """What is new.

        Args:
            of_all: also how everybody is, and the pairs; once a second is enough.
        """
        out: dict[str, Any] = {"t": round(t, 2)}
        paths: dict[str, list[Any]] = {}
        poses: list[list[Any]] = []
        for robot in sorted(self._moved):
            path = self.robots[robot].path if robot in self.robots else RobotPath()
            if path.is_new:
                path.is_new = False
                paths[str(robot)] = _path_rows(path.rows)
            else:
                poses += [[robot, *row] for row in _path_rows(path.rows[-1:])]
        self._moved.clear()
        out |= {"paths": paths} if paths else {}
        out |= {"poses": poses} if poses else {}
        if not of_all:
            return out
        self._settle(t)
        scatters = [
            [*key, *(round(v, 3) for v in scatter)]
            for key, pair in self.pairs.items()
            if (scatter := pair.renew(t)) is not None
        ]
        out |= self._all(t)
        out |= {"pairs": scatters} if scatters else {}
        out |= {"forget": sorted(self._forgotten)} if self._forgotten else {}
        out |= {"closures": self._new_closures} if self._new_closures else {}
        self._forgotten, self._new_closures = set(), []
        return out

    def everything(self, t: float) -> Iterator[dict[str, Any]]:
        """All that is known, in pieces that take a few milliseconds each."""
        yield {"t": round(t, 2), **self._all(t)}
        for robot in list(self.robots):
            if robot in self.robots:
                yield {"paths": {str(robot): _path_rows(self.robots[robot].path.rows)}}
        for key in list(self.pairs):
            pair = self.pairs.get(key)
            if pair is not None:
                closures = [
                    _closure_row(origin, _other(key, origin), c)
                    for (origin, _), c in pair.closures.items()
                ]
                past = [[*key, *(round(v, 3) for v in row)] for row in pair.past.tolist()]
                yield {"pairs": past, "closures": closures}

    def _all(self, t: float) -> dict[str, Any]:
        """How everybody is, what stands, and where who is not known may be."""
        robots = [picture(self.robots[robot], self.robots, t) for robot in sorted(self.robots)]
        return {
            "robots": robots,
            "not_shown": len(self.not_shown),
            "modules": self.modules.rows(self.robots),
            "possible": possible(self.robots, t),
        }


def _place(path: RobotPath, n: int) -> Array | None:
    return path.place(robot_path.time_of(n))


def _other(key: tuple[int, int], robot: int) -> int:
    return key[1] if robot == key[0] else key[0]


def _path_rows(rows: Array) -> list[list[Any]]:
    """For the page: time, x, y, theta or None, state, and the covariance of x and y."""
    columns = [0, *robot_path.POSE, robot_path.STATE, robot_path.XX, robot_path.XY, robot_path.YY]
    digits = (2, 3, 3, 3, 0, 6, 6, 6)
    known = robot_path.headings_known(rows).tolist()
    out: list[list[Any]] = []
    for row, has_heading in zip(rows[:, columns].tolist(), known, strict=True):
        told = [round(v, d) if d else int(v) for v, d in zip(row, digits, strict=True)]
        out.append(told if has_heading else [*told[:3], None, *told[4:]])
    return out


def _closure_row(a: int, b: int, seen: ClosureSeen) -> list[Any]:
    """For the page: a, b, number, time, kept, both ends, and how far off it is."""
    ends = [round(v, 3) for end in seen.ends for v in end]
    return [a, b, seen.number, round(seen.t, 2), int(seen.kept), *ends, round(seen.off_m, 3)]
