"""Modules that stand without a robot, where robots say that they stand.

Who drives past one tells its place by a closure, seen from where it was itself. Where that was
tells its published path, so the module is carried along when the frame of the path changes. Of
several that tell of one module the newest place counts.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drslamd.conventions import FIRST_NODE, Chain
from drslamd.slam import se2
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.se2 import Array
from drslamd.view.scene.robot_path import time_of

if TYPE_CHECKING:
    from drslamd.view.scene.robot_seen import RobotSeen

MOST = 256
"""Places that are remembered: of 64 modules, four robots each."""


@dataclass
class _Told:
    """By one robot of one module; `place` and `frame` as they were known last."""

    origin: Chain
    closure: ClosureMeasurement
    place: Array | None = None
    frame: Chain | None = None


class ModulesSeen:
    """All of a team."""

    def __init__(self) -> None:
        self._told: OrderedDict[tuple[int, int], _Told] = OrderedDict()
        """By UWB id and who says it."""

    def take(self, origin: Chain, closure: ClosureMeasurement) -> None:
        """A place that was told, or is withdrawn."""
        key = closure.peer.robot - FIRST_NODE, origin.robot
        known = self._told.get(key)
        if not closure.kept:
            if known is not None and known.closure.number == closure.number:
                del self._told[key]
            return
        self._told[key] = _Told(origin, closure)
        self._told.move_to_end(key)
        if len(self._told) > MOST:
            self._told.popitem(last=False)

    def forget(self, robot: int) -> None:
        """What a robot said of its earlier start is void."""
        for key in [key for key in self._told if key[1] == robot]:
            del self._told[key]

    def rows(self, team: Mapping[int, RobotSeen]) -> list[list[Any]]:
        """For the page: UWB id, frame, x, y, and sigma in the direction that is known least."""
        newest: dict[tuple[int, Chain], _Told] = {}
        for (uwb_id, robot), told in self._told.items():
            self._renew(told, team.get(robot))
            if told.place is None or told.frame is None:
                continue
            key = uwb_id, told.frame
            if key not in newest or newest[key].closure.b_n <= told.closure.b_n:
                newest[key] = told
        return [_row(uwb_id, frame, told) for (uwb_id, frame), told in sorted(newest.items())]

    def _renew(self, told: _Told, seen: RobotSeen | None) -> None:
        if seen is None or seen.chain != told.origin:
            return
        w_T_a = seen.path.place_of_then(time_of(told.closure.a_n))
        if w_T_a is not None:
            told.place = se2.transform(w_T_a, np.array(told.closure.a_T_b[:2]))
            told.frame = seen.path.frame


def _row(uwb_id: int, frame: Chain, told: _Told) -> list[Any]:
    assert told.place is not None
    known = se2.unpacked(told.closure.covariance)[:2, :2]
    sigma = float(np.sqrt(max(0.0, np.linalg.eigvalsh(known)[-1])))
    x, y = told.place.tolist()
    return [uwb_id, f"{frame.robot}/{frame.epoch}", round(x, 3), round(y, 3), round(sigma, 3)]
