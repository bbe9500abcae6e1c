"""The ranges to one peer of the last half minute or so, thinned to the 10 Hz grid."""

from __future__ import annotations

from collections import deque
from statistics import median

import numpy as np

from drslamd.conventions import GRID_US
from drslamd.slam.se2 import Array

KEEP_S = 130
"""The longest window that a configuration may ask for, and some delay."""
RAW_IN_BIN = 32
"""LinkTrack's fastest rate is 200 Hz, 20 in a tenth of a second."""
BLOCKED_SIGMA_M = 0.5
"""Of a range whose first path is blocked: recorded ones are 0.3 to 1 m too long."""
DOUBT_DB = 4.0
"""From likely line of sight, 6 dB, to likely none, 10 dB (LinkTrack user manual 7.2)."""


def blocked_sigma(gap_db: float, nlos_db: float) -> float:
    """What a weak first path adds to the sigma of a range, m.

    Nothing below `nlos_db` - 4 dB, `BLOCKED_SIGMA_M` from `nlos_db` on, in between a straight line.

    Args:
        gap_db: received power minus first-path power.
        nlos_db: 0 where this is not wanted.
    """
    if not nlos_db:
        return 0.0
    doubt = (gap_db - nlos_db + DOUBT_DB) / DOUBT_DB
    return BLOCKED_SIGMA_M * min(max(doubt, 0.0), 1.0)


def in_sight(table: Array) -> Array:
    """Those of rows (n, 3) of `RangeBuffer.between` that are not surely blocked.

    All of them where less than half would be left: what the others say is then better than nothing.
    """
    clear = table[:, 2] < BLOCKED_SIGMA_M
    return table[clear] if 2 * np.count_nonzero(clear) >= len(table) else table


class RangeBuffer:
    """Medians of time, range and what is added to its sigma in tenths of a second."""

    def __init__(self, nlos_db: float = 0.0) -> None:
        """
        Args:
            nlos_db: see `blocked_sigma`.
        """
        self._nlos_db = nlos_db
        self._done: deque[tuple[float, float, float]] = deque(maxlen=KEEP_S * 10)
        self._bin: list[tuple[int, float, float]] = []
        self.count = 0
        self.newest: int | None = None
        self.bias_m = 0.0
        """Known from an earlier start, and taken out of what is asked for."""

    def add(self, utime: int, range_m: float, gap_db: float = 0.0) -> None:
        if self._bin and utime // GRID_US != self._bin[0][0] // GRID_US:
            self._close()
        if len(self._bin) < RAW_IN_BIN:
            self._bin.append((utime, range_m, blocked_sigma(gap_db, self._nlos_db)))
        self.count += 1
        self.newest = utime

    def _close(self) -> None:
        clear = [row for row in self._bin if row[2] < BLOCKED_SIGMA_M]
        times, values, sigmas = zip(*(clear or self._bin), strict=True)
        self._done.append((float(median(times)), median(values), median(sigmas)))
        self._bin = []

    def between(self, first: int, last: int) -> Array:
        """(n, 3) utime, range and what is added to its sigma, with first < utime <= last."""
        rows = [*self._done, *((float(t), r, s) for t, r, s in self._bin)]
        table = np.array(rows).reshape(-1, 3) - [0.0, self.bias_m, 0.0]
        return np.asarray(table[(table[:, 0] > first) & (table[:, 0] <= last)])

    def is_fresh(self, utime: int, within_us: int) -> bool:
        return self.newest is not None and utime - self.newest < within_us
