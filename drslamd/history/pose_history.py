"""The poses that one robot published of late, with what it claimed of them."""

from __future__ import annotations

import numpy as np

from drslamd.slam.se2 import Array

MOST = 600
"""Poses of one robot, ten minutes at one a second, 58 kB; older ones are in recordings."""
COLUMNS = (
    *("utime", "state", "frame", "x_m", "y_m", "theta_rad"),
    *("xx_m2", "xy_m2", "xt_m_rad", "yy_m2", "yt_m_rad", "tt_rad2"),
)
"""utime of the pose on its robot's clock, what it was worth (`PoseState`), whose frame it is in."""


class PoseHistory:
    """A ring of rows."""

    def __init__(self) -> None:
        self._ring = np.zeros((MOST, len(COLUMNS)))
        self._count = 0

    def add(self, row: list[float]) -> None:
        """One that was published, as `COLUMNS` name its numbers."""
        self._ring[self._count % MOST] = row
        self._count += 1

    def rows(self) -> Array:
        """(k, 12) in the order in which they came."""
        if self._count <= MOST:
            return np.array(self._ring[: self._count])
        return np.roll(self._ring, -(self._count % MOST), axis=0)
