"""Where one robot was: the poses that it published, and its odometry between and before them.

A robot says where it is, not where it was. So a path is what was known at each moment; it is not
made better afterwards. It is kept in the frame of the last pose: when groups meet and the frame
changes, what came before is carried over by the robot's own motion. The way to the first pose is
known by odometry alone, and marked so.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_US, SECOND_US, Chain
from drslamd.gossip.message_types import Pose, PoseState
from drslamd.slam import se2
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.odometry.track import RESOLUTION
from drslamd.slam.relocation.relocation import ANY_HEADING_RAD
from drslamd.slam.se2 import Array
from drslamd.view.scene.rows import Rows

KEPT = 3_800
"""Poses of one robot, about one a second: an hour, in 300 kB."""
RECENT = 120
"""Poses among which a place is looked for: two minutes of them."""
KEYFRAMES = 3_800
"""Likewise of its odometry, about one a second while it moves."""
APART_S = 0.95
"""Poses that are kept are so far apart in time; of those between only the latest is held."""
GAP_S = 3.5
"""Poses farther apart in time say nothing of the way between them."""
CARRY_S = 6.0
"""A change of frame later than this after the last pose begins a new path."""
ON_LATER_S = 12.0
"""How far a pose is carried on by odometry to a later keyframe."""
STRAIGHT_RAD = 1e-6
"""Who turns less drives straight on."""
DUE_S = 1.5
"""A robot that moves has made another keyframe after this time."""
BY_ODOMETRY = 9
"""In the place of a pose's state: before the robot was localised."""
KNOWN_RAD = 0.99 * ANY_HEADING_RAD
"""A sigma above it is that of any heading."""
NO_CLOCK = -1e9
"""In the place of a time on the robot's clock: of an earlier start."""

T, OWN, X, Y, THETA, STATE, XX, XY, YY, TT = range(10)
"""Columns: time of the onlooker and of the robot, s; the pose; what it is worth; covariance."""
POSE = [X, Y, THETA]


class RobotPath:
    """Of one robot.

    Attributes:
        frame: whose odometry frame the path is in; None before the first pose.
        is_new: was all of it replaced since `is_new` was last set to False?
    """

    def __init__(self) -> None:
        self.frame: Chain | None = None
        self.is_new = False
        self.covariance = np.zeros((3, 3))
        self._rows = Rows(KEPT, 10)
        self._keyframes = Rows(KEYFRAMES, 5)
        """Time on the robot's clock, segment, odometry pose."""

    @property
    def rows(self) -> Array:
        """(k, 10), the earliest first; see the columns above."""
        return self._rows.values

    def begin_again(self) -> None:
        """The robot has another start: its clock and its odometry are others."""
        self._keyframes.clear()
        self._rows.values[:, OWN] = NO_CLOCK

    def add_keyframe(self, k: Keyframe) -> None:
        """A place of its odometry; late ones find their place."""
        pose = np.array([k.x, k.y, k.theta]) * RESOLUTION
        self._keyframes.insert(np.array([time_of(k.n), k.segment, *pose]))

    def add(self, message: Pose, t: float, age_s: float) -> None:
        """A pose that the robot published.

        Args:
            t: when it came, s; age_s: how old it was when it was said.
        """
        frame = Chain(message.frame, message.frame_epoch)
        own = message.pose_utime / SECOND_US
        pose, state = np.array(message.pose), message.state
        self.covariance = covariance = se2.unpacked(message.covariance)
        row = np.array([t - age_s, own, *pose, state, *covariance[[0, 0, 1, 2], [0, 1, 1, 2]]])
        if frame != self.frame:
            self._enter(frame, row)
        rows = self.rows
        if len(rows) and row[T] < rows[-1, T]:
            return  # overtaken on the way
        self._rows.append(row, APART_S)

    # frames

    def _enter(self, frame: Chain, row: Array) -> None:
        rows, before = self.rows, self.frame
        self.frame, self.is_new = frame, True
        if before is not None and len(rows) and row[T] - rows[-1, T] < CARRY_S:
            self._carry(row)
            return
        self._rows.clear()
        self._rows.extend(self._way_before(row))

    def _carry(self, row: Array) -> None:
        """Into the frame in which the robot is at `row` now, having driven since the last one."""
        last = self.rows[-1]
        motion = self._motion(last[OWN], row[OWN])
        there = last[POSE] if motion is None else se2.compose(last[POSE], motion)
        new_T_old = se2.compose(row[POSE], se2.inverse(there))
        rows = self.rows
        rows[:, POSE] = se2.compose(new_T_old[None], rows[:, POSE])
        rows[:, THETA] = se2.wrap(rows[:, THETA])
        blocks = np.zeros((len(rows), 3, 3))
        blocks[:, 0, 0], blocks[:, 1, 1] = rows[:, XX], rows[:, YY]
        blocks[:, 0, 1] = blocks[:, 1, 0] = rows[:, XY]
        blocks = se2.turned(blocks, new_T_old[2])
        rows[:, XX], rows[:, XY], rows[:, YY] = blocks[:, 0, 0], blocks[:, 0, 1], blocks[:, 1, 1]

    def _way_before(self, row: Array) -> Array:
        """How the robot came to its first pose, by its odometry: rows (k, 10)."""
        keyframes, here = self._keyframes.values, self._odometry(row[OWN])
        if here is None:
            return np.zeros((0, 10))
        segment, pose = here
        earlier = keyframes[(keyframes[:, 1] == segment) & (keyframes[:, 0] < row[OWN])]
        w_T_o = se2.compose(row[POSE], se2.inverse(pose))
        out = np.zeros((len(earlier), 10))
        out[:, OWN], out[:, STATE] = earlier[:, 0], BY_ODOMETRY
        out[:, T] = row[T] - (row[OWN] - earlier[:, 0])
        out[:, POSE] = se2.compose(w_T_o[None], earlier[:, 2:])
        out[:, THETA] = se2.wrap(out[:, THETA])
        return out

    # odometry

    def _motion(self, start: float, end: float) -> Array | None:
        """By odometry, between two times of the robot's clock."""
        a, b = self._odometry(start), self._odometry(end)
        if a is None or b is None or a[0] != b[0]:
            return None
        return np.asarray(se2.between(a[1], b[1]))

    def _odometry(self, own: float) -> tuple[float, Array] | None:
        """Segment and odometry pose at a time of the robot's clock.

        After the last keyframe it drives on as before until the next one is due. A robot that
        stands makes none, so then the last one holds on.
        """
        keyframes = self._keyframes.values
        at = int(np.searchsorted(keyframes[:, 0], own, side="right")) - 1
        if at < 0:
            return None
        before = keyframes[at]
        if at + 1 == len(keyframes):
            return before[1], self._driven_on(own)
        if keyframes[at + 1, 1] != before[1]:
            return before[1], before[2:]
        after = keyframes[at + 1]
        if after[0] - before[0] > GAP_S:
            # it stood, and went on a second before the later one
            start = max(before[0], after[0] - 1.0)
            share = max(0.0, own - start) / (after[0] - start)
        else:
            share = (own - before[0]) / (after[0] - before[0])
        return before[1], arc(before[2:], after[2:], share)

    def _driven_on(self, own: float) -> Array:
        """The odometry pose at a time after the last keyframe."""
        keyframes = self._keyframes.values
        last = keyframes[-1]
        if len(keyframes) < 2 or keyframes[-2, 1] != last[1] or own - last[0] > DUE_S:
            return np.asarray(last[2:])
        before = keyframes[-2]
        step = last[0] - before[0]
        if step > GAP_S:
            return np.asarray(last[2:])
        return arc(before[2:], last[2:], 1 + (own - last[0]) / step)

    # the past

    def place(self, own: float) -> Array | None:
        """w_T_a (3,) at a time of the robot's clock; None where that cannot be said (yet)."""
        return self._place(own, self.rows[-RECENT:])

    def place_of_then(self, own: float) -> Array | None:
        """The same at any time that is kept; it looks at all of it."""
        return self._place(own, self.rows)

    def _place(self, own: float, rows: Array) -> Array | None:
        rows = rows[(rows[:, STATE] != PoseState.STALE) & (rows[:, OWN] != NO_CLOCK)]
        if not len(rows):
            return None
        at = int(np.searchsorted(rows[:, OWN], own, side="right")) - 1
        if at < 0:
            return None
        here = rows[at]
        if at + 1 < len(rows):
            there = rows[at + 1]
            if there[OWN] - here[OWN] > GAP_S:
                return None
            return arc(here[POSE], there[POSE], (own - here[OWN]) / (there[OWN] - here[OWN]))
        if own == here[OWN]:
            return np.asarray(here[POSE])
        keyframes = self._keyframes.values
        if own - here[OWN] > ON_LATER_S or not len(keyframes) or keyframes[-1, 0] < own:
            return None
        motion = self._motion(here[OWN], own)
        return None if motion is None else np.asarray(se2.compose(here[POSE], motion))


def headings_known(rows: Array) -> NDArray[np.bool_]:
    """(k,) which rows say where the robot looks: what stands, or is placed by ranges, does not."""
    stands = rows[:, STATE] == PoseState.POSITION
    return np.asarray(~stands & (rows[:, TT] < KNOWN_RAD**2))


def time_of(n: int) -> float:
    """Of a sample, s on the clock of its robot."""
    return n * GRID_US / SECOND_US


def arc(a: Array, b: Array, share: float) -> Array:
    """The pose that part of the way from a to b, on the circle that a robot drives between them.

    Plain numbers: it is asked for hundreds of single poses a second.
    """
    ax, ay, atheta = a.tolist()
    bx, by, btheta = b.tolist()
    cos, sin = math.cos(atheta), math.sin(atheta)
    dx, dy = cos * (bx - ax) + sin * (by - ay), cos * (by - ay) - sin * (bx - ax)
    whole = math.remainder(btheta - atheta, 2 * math.pi)
    turn = whole * share
    # chords of one circle are as the sines of half their angles, and lie turned by half of them
    grown = share
    if abs(whole) > STRAIGHT_RAD:
        grown = math.sin(turn / 2) / math.sin(whole / 2)
    lie = (turn - whole) / 2
    x = grown * (math.cos(lie) * dx - math.sin(lie) * dy)
    y = grown * (math.sin(lie) * dx + math.cos(lie) * dy)
    theta = math.remainder(atheta + turn, 2 * math.pi)
    return np.array([ax + cos * x - sin * y, ay + sin * x + cos * y, theta])
