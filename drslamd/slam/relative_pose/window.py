"""What module 1 sees: the ranges of one pair over a few seconds, and both odometries under them.

Everything is expressed from the poses of both robots at one reference time: the latest in the paper
(equation 1 uses ``x_t^-1 x_i``), a little earlier by default, so that what comes after it can
contradict it. Measurement i was taken while a stood at ``a_T_ai`` and b at ``b_T_bi``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.slam import se2
from drslamd.slam.se2 import Array

NO_GYRO = (math.inf, math.inf)
"""Span of who has none."""


@dataclass(frozen=True)
class Window:
    """n measurements, oldest first.

    Attributes:
        t: (n,) seconds after the reference time, ascending; mostly negative.
        ranges: (n,) metres, antenna to antenna.
        a_poses: (n, 3) a_T_ai, body of a at measurement i in its body at the reference time.
        b_poses: (n, 3) b_T_bi.
        a_antenna, b_antenna: (2,) antennas in the body frames, metres.
        a_gyro, b_gyro: seconds after the reference time from when and until when a gyro gave the
            heading.
    """

    t: Array
    ranges: Array
    a_poses: Array
    b_poses: Array
    a_antenna: Array
    b_antenna: Array
    a_gyro: tuple[float, float] = NO_GYRO
    b_gyro: tuple[float, float] = NO_GYRO

    def __len__(self) -> int:
        return len(self.t)

    @property
    def before(self) -> int:
        """How many measurements lie before the reference time, or at it."""
        return int(np.searchsorted(self.t, 0.0, side="right"))

    @property
    def a_points(self) -> Array:
        """(n, 2) antenna of a in the reference body frame of a."""
        return se2.transform(self.a_poses, self.a_antenna)

    @property
    def b_points(self) -> Array:
        """(n, 2) antenna of b in the reference body frame of b."""
        return se2.transform(self.b_poses, self.b_antenna)


def binned(t: Array, ranges: Array, width: float) -> tuple[Array, Array, NDArray[np.int64]]:
    """Medians of time and range in bins of `width` seconds.

    While a range only grows or only shrinks inside a bin, its median belongs to the median time,
    and a burst shorter than half a bin leaves no trace.

    Returns:
        times, ranges and counts of the bins that hold anything, in the order of time.
    """
    if not len(t):
        return t, ranges, np.zeros(0, dtype=np.int64)
    order = np.argsort(t, kind="stable")
    t, ranges = t[order], ranges[order]
    edges = np.flatnonzero(np.diff(np.floor(t / width))) + 1
    starts = np.concatenate([[0], edges])
    counts = np.diff(np.append(starts, len(t)))
    by_range = np.lexsort((ranges, np.repeat(np.arange(len(starts)), counts)))
    low, high = starts + (counts - 1) // 2, starts + counts // 2
    medians = (ranges[by_range][low] + ranges[by_range][high]) / 2
    return (t[low] + t[high]) / 2, medians, counts
