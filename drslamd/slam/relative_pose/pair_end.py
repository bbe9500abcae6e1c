"""One robot of a pair: where it was at any time, and which keyframe stands for that.

A pose graph knows keyframes; a window ends whenever both odometries and the ranges reach. The short
way from the window's end to the nearest keyframe of each robot is odometry on both sides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from drslamd.conventions import GRID_US, SECOND_US
from drslamd.slam import se2
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.odometry.track import Track
from drslamd.slam.relative_pose.window import NO_GYRO
from drslamd.slam.robot_model import RobotModel
from drslamd.slam.se2 import Array, Index

NEAR_US = 1_500_000
"""A keyframe stands for times so near; farther, only while its robot stands still."""
STILL_M = 0.05
"""A robot that moved less than this, and turned less than `STILL_RAD`, stands still."""
STILL_RAD = 0.05
"""See `STILL_M`."""
MAX_LEVER_M = 25.0
"""A body farther from its keyframe than any robot gets in `NEAR_US` follows absurd odometry; with
an antenna at the rim of a large robot it still fits the 16 bits of millimetres of a message."""


@dataclass(frozen=True)
class PairEnd:
    """One robot: its 10 Hz track, what it said of itself, its clock minus ours in us.

    Attributes:
        since_us: from when on our clock that difference holds, and its wheels are to be believed.
    """

    track: Track
    data: ChainData
    ahead_us: int = 0
    since_us: int = 0

    def grid(self, utime: Array | float) -> Array:
        """Fractional samples of the track at times (k,) of our clock."""
        return (np.atleast_1d(utime) + self.ahead_us) / GRID_US

    def poses(self, utime: Array | float) -> Array:
        """(k, 3) odometry poses at times (k,) of our clock."""
        return self.track.at_time(self.grid(utime))

    def pose(self, utime: float) -> Array:
        """(3,) odometry pose at one time of our clock."""
        return self.track.at_moment((utime + self.ahead_us) / GRID_US)

    def gyro_span(self, utime: int) -> tuple[float, float]:
        """Seconds after `utime` of our clock from when and until when a gyro gave the heading."""
        span = self.data.model.noise.gyro_span
        if span is None:
            return NO_GYRO
        since, until = (np.array(span) * GRID_US - self.ahead_us - utime) / SECOND_US
        return float(since), float(until)

    def behind(self, n: int) -> PairEnd:
        """From a sample of the track on only."""
        return replace(self, since_us=max(self.since_us, n * GRID_US - self.ahead_us))

    @property
    def first_us(self) -> int:
        """Start of the unbroken end of the track, our clock."""
        start = max(self.track.n0, self.track.segment_start) * GRID_US - self.ahead_us
        return max(start, self.since_us)

    @property
    def last_us(self) -> int:
        return (self.track.end - 1) * GRID_US - self.ahead_us


@dataclass(frozen=True)
class Anchor:
    """The keyframe that stands for a body at some time: its number, and where the body was."""

    n: int
    segment: int
    keyframe_T_body: Array


def anchor(end: PairEnd, utime: int) -> Anchor | None:
    """The keyframe nearest to the body at `utime` of our clock; None when it is too far."""
    keyframes = end.data.keyframes
    if not len(keyframes):
        return None
    n = (utime + end.ahead_us) / GRID_US
    at = _nearest(keyframes.n, n)
    number = int(keyframes.n[at])
    step = se2.between(keyframes.poses[at], end.pose(utime))
    x, y, turn = step.tolist()
    is_near = abs(number - n) * GRID_US <= NEAR_US
    is_still = math.hypot(x, y) < STILL_M and abs(turn) < STILL_RAD
    is_finite = math.isfinite(x) and math.isfinite(y) and math.isfinite(turn)
    is_unbroken = number >= end.track.segment_start and is_finite
    if not is_unbroken or not (is_near or is_still) or math.hypot(x, y) > MAX_LEVER_M:
        return None
    return Anchor(number, int(keyframes.segment[at]), step)


def _nearest(ascending: Index, n: float) -> int:
    """Where the nearest of some numbers is, the earlier one of two."""
    after = int(np.searchsorted(ascending, n))
    if after in (0, len(ascending)):
        return max(after - 1, 0)
    is_before = n - float(ascending[after - 1]) <= float(ascending[after]) - n
    return after - 1 if is_before else after


def at_keyframes(a_T_b: Array, covariance: Array, a: Anchor, b: Anchor) -> tuple[Array, Array]:
    """Carry a relative pose and its covariance from the bodies to their keyframes."""
    ka_T_b = se2.compose(a.keyframe_T_body, a_T_b)
    moved = se2.compose(ka_T_b, se2.inverse(b.keyframe_T_body))
    lever = moved[:2] - ka_T_b[:2]
    m = np.eye(3)
    m[0, 2], m[1, 2] = -lever[1], lever[0]
    spread = m @ se2.turned(covariance, a.keyframe_T_body[2]) @ m.T
    return np.append(moved[:2], se2.wrap(moved[2])), np.asarray(spread)


def level(ranges: Array, a: RobotModel, b: RobotModel) -> Array:
    """Ranges (n,) between antennas of different heights, as seen from above.

    What is shorter than the difference in height is the fault of a bias and stays as it is.
    """
    rise = a.antenna_z_m - b.antenna_z_m
    inside = np.maximum(ranges**2 - rise**2, 0.0)
    seen = np.copysign(np.sqrt(inside), ranges)
    return np.asarray(np.where(np.abs(ranges) > abs(rise), seen, ranges))
