"""Where robots say that others may be, placed on the map.

Such places are in the odometry frame of who says them. Where that robot's path tells how this frame
lies in that of the team, they are drawn there. While nobody is localised at all the team's frame is
going to be that of the lowest robot, most likely: what it says is drawn in its odometry frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from drslamd.slam import se2
from drslamd.slam.hypotheses.places_left import PossiblePlace
from drslamd.slam.se2 import Array
from drslamd.view.scene.robot_seen import RobotSeen


def possible(team: Mapping[int, RobotSeen], t: float) -> list[dict[str, Any]]:
    """What the page draws: who says it, in which frame (None before there is one), where it is
    itself, and the places of others."""
    out: list[dict[str, Any]] = []
    is_placed = any(seen.path.frame is not None for seen in team.values())
    for robot in sorted(team):
        seen = team[robot]
        said = seen.possible.latest(t) if seen.speaks(t) else None
        if said is None:
            continue
        frame, w_T_o = seen.path.frame, _frame(seen)
        if not is_placed and not out:
            frame, w_T_o = None, np.zeros(3)
        if w_T_o is None or (is_placed and frame is None):
            continue
        here = se2.compose(w_T_o, np.array(said.odom))
        out.append(
            {
                "origin": robot,
                "frame_key": None if frame is None else f"{frame.robot}/{frame.epoch}",
                "here": [round(v, 3) for v in here.tolist()],
                "places": [_row(place, w_T_o) for place in said.places],
            }
        )
    return out


def _frame(seen: RobotSeen) -> Array | None:
    """w_T_o of its odometry frame, by the latest time for which both are known."""
    for own, odom in seen.possible.frames():
        w_T_a = seen.path.place(own)
        if w_T_a is not None:
            return np.asarray(se2.compose(w_T_a, se2.inverse(odom)))
    return None


def _row(place: PossiblePlace, w_T_o: Array) -> list[float]:
    """Robot, share, x, y, theta, and the covariance of x and y."""
    x, y, theta = se2.compose(w_T_o, np.array(place.pose)).tolist()
    known = se2.turned(se2.unpacked(place.covariance), w_T_o[2])
    spread = (known[0, 0], known[0, 1], known[1, 1])
    where = (place.share, x, y, float(se2.wrap(theta)))
    return [place.peer, *(round(v, 3) for v in where), *(round(float(v), 6) for v in spread)]
