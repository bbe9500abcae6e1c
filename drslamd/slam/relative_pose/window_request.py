"""From raw ranges and two tracks to the window of module 1, and what its answer belongs to."""

from __future__ import annotations

from dataclasses import dataclass

from drslamd.conventions import GRID_US, SECOND_US
from drslamd.slam import se2
from drslamd.slam.range_model import LINKTRACK, RangeModel
from drslamd.slam.relative_pose.pair_end import Anchor, PairEnd, anchor, level
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.window import Window, binned

FEWEST = 6
"""Ranges."""


@dataclass(frozen=True)
class WindowRule:
    """How long a window is, and which pose it asks for.

    Attributes:
        span_us: its longest.
        bin_us: measurements within so long become one, their median.
        confirm_us: the pose is that of so long ago: odometry that fails just now fits its past as
            well as ever, and only ranges that come after tell.
        drops_blocked: are ranges left out whose first path is surely blocked?
    """

    span_us: int
    bin_us: int
    confirm_us: int
    drops_blocked: bool


@dataclass(frozen=True)
class WindowRequest:
    """A window, its reference time on our clock, and what its answer will be attached to."""

    window: Window
    utime: int
    a: Anchor
    b: Anchor


def newest(ranges: RangeBuffer, a: PairEnd, b: PairEnd) -> int | None:
    """The latest time of our clock that both tracks and the ranges cover."""
    if len(a.track) < 2 or len(b.track) < 2 or ranges.newest is None:
        return None
    last = min(a.last_us, b.last_us, ranges.newest)
    return last if last > max(a.first_us, b.first_us) + GRID_US else None


def request(
    ranges: RangeBuffer, a: PairEnd, b: PairEnd, rule: WindowRule, model: RangeModel = LINKTRACK
) -> WindowRequest | str:
    """The window that ends now, or why there is none."""
    last = newest(ranges, a, b)
    if last is None:
        return "odometries and ranges do not overlap in time"
    first = max(a.first_us, b.first_us)
    found = ranges.between(max(last - rule.span_us, first), last)
    if rule.drops_blocked:
        found = found.in_sight(model)
    if len(found.utime) < FEWEST:
        return "too few ranges"
    at = max(last - rule.confirm_us, first)
    anchor_a, anchor_b = anchor(a, at), anchor(b, at)
    if anchor_a is None or anchor_b is None:
        return "no keyframe near the window yet"
    seconds = (found.utime - at) / SECOND_US
    seen = level(found.range_m, a.data.model, b.data.model)
    t, distances, _ = binned(seconds, seen, rule.bin_us / SECOND_US)
    when = at + t * SECOND_US
    window = Window(
        t=t,
        ranges=distances,
        a_poses=se2.between(a.pose(at), a.poses(when)),
        b_poses=se2.between(b.pose(at), b.poses(when)),
        a_antenna=a.data.model.antenna,
        b_antenna=b.data.model.antenna,
        a_gyro=a.gyro_span(at),
        b_gyro=b.gyro_span(at),
    )
    return WindowRequest(window, at, anchor_a, anchor_b)
