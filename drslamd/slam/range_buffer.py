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


class RangeBuffer:
    """Medians of time and range in tenths of a second."""

    def __init__(self) -> None:
        self._done: deque[tuple[float, float]] = deque(maxlen=KEEP_S * 10)
        self._bin: list[tuple[int, float]] = []
        self.count = 0
        self.newest: int | None = None
        self.bias_m = 0.0
        """Known from an earlier start, and taken out of what is asked for."""

    def add(self, utime: int, range_m: float) -> None:
        if self._bin and utime // GRID_US != self._bin[0][0] // GRID_US:
            self._close()
        if len(self._bin) < RAW_IN_BIN:
            self._bin.append((utime, range_m))
        self.count += 1
        self.newest = utime

    def _close(self) -> None:
        times, values = zip(*self._bin, strict=True)
        self._done.append((float(median(times)), median(values)))
        self._bin = []

    def between(self, first: int, last: int) -> Array:
        """(n, 2) utime and range with first < utime <= last."""
        rows = [*self._done, *((float(t), r) for t, r in self._bin)]
        table = np.array(rows).reshape(-1, 2) - [0.0, self.bias_m]
        return np.asarray(table[(table[:, 0] > first) & (table[:, 0] <= last)])

    def is_fresh(self, utime: int, within_us: int) -> bool:
        return self.newest is not None and utime - self.newest < within_us
