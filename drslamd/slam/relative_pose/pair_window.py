"""From raw ranges and two tracks to the window of module 1, and from its answer to the graph.

A pose graph knows keyframes; a window ends whenever both odometries and the ranges reach. The short
way from the window's end to the nearest keyframe of each robot is odometry on both sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.config import RelativePoseSection
from drslamd.conventions import GRID_US, SECOND_US, Chain
from drslamd.slam import se2
from drslamd.slam.graph.measurements import RangeMeasurement
from drslamd.slam.graph.pose_graph import ChainData
from drslamd.slam.odometry.track import Track
from drslamd.slam.relative_pose.range_buffer import RangeBuffer, in_sight
from drslamd.slam.relative_pose.window import Window, binned
from drslamd.slam.relative_pose.window_noise import near_bias
from drslamd.slam.se2 import Array

NEAR_US = 1_500_000
"""A keyframe stands for times so near; farther, only while its robot stands still."""
STILL_M, STILL_RAD = 0.05, 0.05
MAX_LEVER_M = 25.0
"""A body farther from its keyframe than any robot gets in `NEAR_US` follows absurd odometry; with
an antenna at the rim of a large robot it still fits the 16 bits of millimetres of a message."""
MIN_SIGMA_M = 1e-3
"""The resolution in which the sigma of a range is sent."""
POINTS = 60
"""Measurements of one window after binning; more would only repeat the slow range bias."""
FEWEST = 6
CONFIRM_US = 2 * SECOND_US
"""A pose is named for so long ago: odometry that fails just now fits its past as well as ever, and
only ranges that come after tell."""


@dataclass(frozen=True)
class PairEnd:
    """One robot of a pair: its 10 Hz track, its keyframes, its clock minus ours in us."""

    track: Track
    items: ChainData
    ahead_us: int = 0

    def grid(self, utime: Array | float) -> Array:
        """Fractional samples of the track at times (k,) of our clock."""
        return (np.atleast_1d(utime) + self.ahead_us) / GRID_US

    def poses(self, utime: Array | float) -> Array:
        """(k, 3) odometry poses at times (k,) of our clock."""
        return self.track.at_time(self.grid(utime))

    @property
    def first_us(self) -> int:
        """Start of the unbroken end of the track, our clock."""
        return max(self.track.n0, self.track.segment_start) * GRID_US - self.ahead_us

    @property
    def last_us(self) -> int:
        return (self.track.end - 1) * GRID_US - self.ahead_us


@dataclass(frozen=True)
class Anchored:
    """A body at some time, held to the keyframe of its chain that is nearest."""

    n: int
    segment: int
    keyframe_T_body: Array


@dataclass(frozen=True)
class Request:
    """A window, its reference time on our clock, and what its answer will be attached to."""

    window: Window
    utime: int
    a: Anchored
    b: Anchored


def level(ranges: Array, a: PairEnd, b: PairEnd) -> Array:
    """Ranges (n,) between antennas of different heights, as seen from above.

    What is shorter than the difference in height is the fault of a bias and stays as it is.
    """
    rise = a.items.antenna_z_m - b.items.antenna_z_m
    inside = np.maximum(ranges**2 - rise**2, 0.0)
    seen = np.copysign(np.sqrt(inside), ranges)
    return np.asarray(np.where(np.abs(ranges) > abs(rise), seen, ranges))


def newest(ranges: RangeBuffer, a: PairEnd, b: PairEnd) -> int | None:
    """The latest time of our clock that both tracks and the ranges cover."""
    if len(a.track) < 2 or len(b.track) < 2 or ranges.newest is None:
        return None
    last = min(a.last_us, b.last_us, ranges.newest)
    return last if last > max(a.first_us, b.first_us) + GRID_US else None


def request(
    ranges: RangeBuffer, a: PairEnd, b: PairEnd, section: RelativePoseSection
) -> Request | str:
    """The window that ends now, or why there is none."""
    last = newest(ranges, a, b)
    if last is None:
        return "odometries and ranges do not overlap in time"
    paper = section.algorithm == "paper"
    span = section.tau * GRID_US if paper else int(section.window_max_s * SECOND_US)
    table = ranges.between(max(last - span, a.first_us, b.first_us), last)
    table = table if paper else in_sight(table)
    if len(table) < FEWEST:
        return "too few ranges"
    at = last if paper else max(last - CONFIRM_US, a.first_us, b.first_us)
    width = GRID_US if paper else max(GRID_US, span // POINTS)
    t, distances, _ = binned((table[:, 0] - at) / 1e6, level(table[:, 1], a, b), width / 1e6)
    held = anchored(a, at), anchored(b, at)
    if held[0] is None or held[1] is None:
        return "no keyframe near the window yet"
    when = at + t * 1e6
    window = Window(
        t,
        distances,
        se2.between(a.poses(at), a.poses(when)),
        se2.between(b.poses(at), b.poses(when)),
        a.items.antenna,
        b.items.antenna,
    )
    return Request(window, at, held[0], held[1])


def anchored(side: PairEnd, utime: int) -> Anchored | None:
    """Hold the body at `utime` of our clock to its nearest keyframe; None when it is too far."""
    rows = side.items.rows
    if not len(rows):
        return None
    n = float(side.grid(utime)[0])
    at = int(np.argmin(np.abs(rows[:, 0] - n)))
    step = se2.between(rows[at, 2:], side.poses(utime)[0])
    near = abs(rows[at, 0] - n) * GRID_US <= NEAR_US
    still = np.hypot(step[0], step[1]) < STILL_M and abs(step[2]) < STILL_RAD
    unbroken = rows[at, 0] >= side.track.segment_start and np.isfinite(step).all()
    if not unbroken or not (near or still) or np.hypot(step[0], step[1]) > MAX_LEVER_M:
        return None
    return Anchored(int(rows[at, 0]), int(rows[at, 1]), step)


def at_keyframes(a_T_b: Array, covariance: Array, a: Anchored, b: Anchored) -> tuple[Array, Array]:
    """Carry a relative pose and its covariance from the bodies to their keyframes."""
    ka_T_b = se2.compose(a.keyframe_T_body, a_T_b)
    moved = se2.compose(ka_T_b, se2.inverse(b.keyframe_T_body))
    lever = moved[:2] - ka_T_b[:2]
    m = np.eye(3)
    m[0, 2], m[1, 2] = -lever[1], lever[0]
    spread = m @ se2.turned(covariance, a.keyframe_T_body[2]) @ m.T
    return np.append(moved[:2], se2.wrap(moved[2])), np.asarray(spread)


class RangeSampler:
    """Distances for the graph: the median of each second, if somebody moved since the last."""

    def __init__(self, sigma_m: float) -> None:
        self._sigma_m = max(sigma_m, MIN_SIGMA_M)
        self._utime = 0
        self._place: Array | None = None

    def next(
        self, ranges: RangeBuffer, a: PairEnd, b: PairEnd, peer: Chain
    ) -> RangeMeasurement | None:
        """One item, or None when there is nothing new to say."""
        last = newest(ranges, a, b)
        if last is None or last - self._utime < SECOND_US * 9 // 10:
            return None
        since = max(self._utime, last - SECOND_US, a.first_us, b.first_us)
        table = in_sight(ranges.between(since, last))
        if not len(table):
            return None
        when = int(np.median(table[:, 0]))
        held_a, held_b = anchored(a, when), anchored(b, when)
        place = np.concatenate([a.poses(when)[0, :2], b.poses(when)[0, :2]])
        still = self._place is not None and np.abs(place - self._place).max() < STILL_M
        if held_a is None or held_b is None or (still and last - self._utime < 10 * SECOND_US):
            return None
        self._utime, self._place = last, place
        q_a = se2.transform(held_a.keyframe_T_body, a.items.antenna).tolist()
        q_b = se2.transform(held_b.keyframe_T_body, b.items.antenna).tolist()
        table[:, 1] = level(table[:, 1], a, b)
        metres, doubt = (float(x) for x in np.median(table[:, 1:], axis=0))
        sigma = float(np.hypot(np.hypot(self._sigma_m, near_bias(metres)), doubt))
        return RangeMeasurement(
            held_a.n, peer, held_b.n, (q_a[0], q_a[1]), (q_b[0], q_b[1]),
            metres, sigma,
        )  # fmt: skip
