"""How wrong a heading is that a gyro gives: by time, as that of wheels is by path.

A gyro errs while it is turned and while it is not; but while the wheels stand still the robot does
too, and its heading is held. So what counts is the time in motion. Which part of the way had its
heading from the gyro, samples say: from `since` to `until`; on the rest the wheels gave it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drslamd.conventions import GRID_HZ
from drslamd.slam.se2 import Array

MOST_PER_SQRT_S = math.radians(5)
"""Largest sigma of random yaw that a source may state, rad per sqrt(s)."""
MOST_PER_S = math.radians(5)
"""Likewise of the constant yaw rate, rad/s."""
OPEN = 2**31 - 1
"""`until` of a gyro that is in use."""
LONGEST_STEP_S = 5.0
"""Keyframes are a second apart while a robot drives; of a longer step it stood for a part."""


@dataclass(frozen=True)
class GyroNoise:
    """Sigmas of the heading of one gyro, and of which samples of the track.

    Attributes:
        yaw_rad_per_sqrt_s: of random yaw, rad per square root of a second in motion.
        yaw_rad_per_s: of the constant yaw rate that is left.
        since, until: the first and the last sample of the stretch whose heading it gave.
    """

    yaw_rad_per_sqrt_s: float
    yaw_rad_per_s: float
    since: int
    until: int = OPEN

    @property
    def is_in_use(self) -> bool:
        return self.until == OPEN

    @property
    def span(self) -> tuple[int, int]:
        return self.since, self.until

    def is_plausible(self) -> bool:
        """Could a source say this?"""
        return (
            0 < self.yaw_rad_per_sqrt_s <= MOST_PER_SQRT_S
            and 0 < self.yaw_rad_per_s <= MOST_PER_S
            and 0 <= self.since <= self.until <= OPEN
        )

    def seconds(self, n: Array, poses: Array) -> Array:
        """(..., k - 1) s in motion under this gyro, of the steps between poses (..., k, 3) at
        samples n (..., k); 0 where the wheels gave the heading, or nothing moved."""
        return turned_seconds(n, poses, self.span)


def turned_seconds(
    n: Array, poses: Array, span: tuple[float, float] | tuple[Array, Array]
) -> Array:
    """See `GyroNoise.seconds`; n in samples of the grid, and fractions of them."""
    since, until = span
    is_inside = (n[..., :-1] >= since) & (n[..., 1:] <= until)
    has_moved = (np.diff(poses[..., :3], axis=-2) != 0).any(axis=-1)
    seconds = np.minimum(np.diff(n, axis=-1) / GRID_HZ, LONGEST_STEP_S)
    return np.asarray(np.where(is_inside & has_moved, seconds, 0.0))
