"""Where a robot is now, and what that is worth: a pose is valid for a second at most, as long as
its wheels may be silent (`sensors/rhythm`), then it grows old.

Without odometry a robot may stand still or drive on. It drives as it drove: the fastest second of
its last ten minutes bounds how far it can have come, in any direction. So after t seconds sigma is
that speed times t, and the state says `STALE`. What the wheels could do at most would be true as
well and help nobody; it is used for a robot that has not driven yet. Where ranges to localised
robots tell more (`slam/relocation`) their position is said, without a heading, until the robot has
its place again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.conventions import GRID_HZ, GRID_US, SECOND_US
from drslamd.gossip.message_types import PoseState
from drslamd.slam.doubt import Doubt
from drslamd.slam.graph.estimate import PoseNow
from drslamd.slam.odometry.track import RESOLUTION, Track
from drslamd.slam.relocation.relocation import ANY_HEADING_RAD, ByRanges

VALID_US = SECOND_US
"""An older pose is not that of now; the slowest base of any use sends twice a second."""
LOST_US = 600 * SECOND_US
"""After ten minutes without odometry a robot may be anywhere."""
LOOK_BACK = 600 * GRID_HZ
"""Samples, ten minutes of them."""
STANDING_MPS = 0.05
"""Who never was faster has not driven yet."""


@dataclass(frozen=True)
class Whereabouts:
    """One robot.

    Attributes:
        state: what the pose is worth.
        pose: the last one while it is valid; then the same as the pose of now, with what may have
            been driven since in its covariance. None when it is not localised.
        age_us: of the odometry that it rests on.
        doubt: what speaks against it.
        is_placed: is it not that of module 3, which does not know it as well yet?
    """

    state: PoseState
    pose: PoseNow | None = None
    age_us: int = 0
    doubt: Doubt | None = None
    is_placed: bool = False

    @property
    def is_old(self) -> bool:
        return self.state is PoseState.STALE


NOWHERE = Whereabouts(PoseState.NOT_LOCALISED)


def whereabouts(
    found: PoseNow | None,
    track: Track,
    most_mps: float,
    doubt: Doubt | None,
    utime: int,
    gap_m: float = 0.0,
    by_ranges: ByRanges | None = None,
    is_point: bool = False,
    valid_us: int = VALID_US,
) -> Whereabouts:
    """What to say of a robot at `utime`.

    Args:
        found: its last pose.
        track: its odometry.
        most_mps: what its wheels can do.
        doubt: what speaks against that pose.
        gap_m: how far ranges of this second, or of several together, are off: the pose is as wrong
            as that, whatever the reason, and long before anybody can say which.
        by_ranges: where it is without odometry, as ranges have it.
        is_point: is its heading unknown?
        valid_us: how long a pose is that of now.
    """
    is_old = found is None or utime - found.utime > valid_us
    if is_old and by_ranges is not None:
        return Whereabouts(PoseState.STALE, by_ranges.pose, by_ranges.age_us)
    if found is None:
        return NOWHERE
    age_us = utime - found.utime
    if age_us <= valid_us:
        known = PoseState.DOUBTFUL if doubt else PoseState.LOCALISED
        state = PoseState.POSITION if is_point else known
        wider = found.covariance + np.diag([gap_m**2, gap_m**2, 0.0])
        return Whereabouts(state, found._replace(covariance=wider), age_us, doubt)
    if age_us > LOST_US:
        return NOWHERE
    speed, turning = likely_speeds(track, most_mps)
    age_s = age_us / SECOND_US
    way, turn = speed * age_s, min(turning * age_s, ANY_HEADING_RAD)
    wider = found.covariance + np.diag([way**2, way**2, turn**2])
    now = PoseNow(utime // GRID_US * GRID_US, found.pose, wider)
    return Whereabouts(PoseState.STALE, now, age_us)


def likely_speeds(track: Track, most_mps: float) -> tuple[float, float]:
    """How fast a robot drives, m/s, and turns, rad/s: its fastest second of late.

    Args:
        most_mps: of its wheels, for a robot that has not driven.
    """
    count = min(len(track), LOOK_BACK)
    poses = track.steps(track.end - count, count) * RESOLUTION
    change = poses[GRID_HZ:] - poses[:-GRID_HZ]
    holes = np.cumsum(np.isnan(poses[:, 0]))
    is_whole = (holes[GRID_HZ:] == holes[:-GRID_HZ]) & np.isfinite(change[:, 0])
    change = change[is_whole]
    speed = float(np.hypot(change[:, 0], change[:, 1]).max(initial=0.0))
    turning = float(np.abs(change[:, 2]).max(initial=0.0))
    if max(speed, turning) < STANDING_MPS:
        return most_mps, ANY_HEADING_RAD
    return min(speed, most_mps), turning
