"""The ranges to each module of the last half minute or so, thinned to the 10 Hz grid."""

from __future__ import annotations

from statistics import median
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_US, SECOND_US
from drslamd.sensors.samples import RangeSample
from drslamd.slam.range_model import LINKTRACK, RangeModel
from drslamd.slam.se2 import Array

KEEP_S = 130
"""The longest window that a configuration may ask for, and some delay."""
MAX_UWB_IDS = 64
"""Modules whose ranges are remembered, 2.5 MB; a radio cell holds no more."""
MOST_BINS = KEEP_S * 10
SPARE_BINS = MOST_BINS // 4
"""After so many more the rest is moved back to the front."""
RANGES_FRESH_US = 3 * SECOND_US
"""A module that was silent for longer is not in range."""
RAW_IN_BIN = 32
"""LinkTrack's fastest rate is 200 Hz, 20 in a tenth of a second."""


class TimedRanges(NamedTuple):
    """n ranges, oldest first.

    Attributes:
        utime: (n,) us.
        range_m: (n,) m.
        doubt_m: (n,) what a weak first path adds to the sigma of each, m.
    """

    utime: Array
    range_m: Array
    doubt_m: Array

    def chosen(self, which: NDArray[np.bool_]) -> TimedRanges:
        return TimedRanges(*(column[which] for column in self))

    def in_sight(self, model: RangeModel) -> TimedRanges:
        """Those that are not surely blocked.

        All of them where less than half would be left: what the others say is then better than
        nothing.
        """
        clear = self.doubt_m < model.blocked_sigma_m
        return self.chosen(clear) if 2 * np.count_nonzero(clear) >= len(clear) else self


class RangeBuffer:
    """Medians of time, range and doubt in tenths of a second.

    Attributes:
        count: of all ranges that came.
        newest: time of the last one, us.
        bias_m: known from an earlier start, and taken out of what is asked for.
    """

    def __init__(self, nlos_db: float = 0.0, model: RangeModel = LINKTRACK) -> None:
        """
        Args:
            nlos_db: see `RangeModel.blocked_sigma`.
        """
        self._nlos_db, self._model = nlos_db, model
        self._done = np.empty((MOST_BINS + SPARE_BINS, 3))
        """Time, range and doubt; those that count stand from `_first` to `_end`."""
        self._first = self._end = 0
        self._bin: list[tuple[int, float, float]] = []
        self.count = 0
        self.newest: int | None = None
        self.bias_m = 0.0

    def add(self, utime: int, range_m: float, gap_db: float = 0.0) -> None:
        if self._bin and utime // GRID_US != self._bin[0][0] // GRID_US:
            self._close()
        if len(self._bin) < RAW_IN_BIN:
            doubt = self._model.blocked_sigma(gap_db, self._nlos_db)
            self._bin.append((utime, range_m, doubt))
        self.count += 1
        self.newest = utime

    def _close(self) -> None:
        clear = [row for row in self._bin if row[2] < self._model.blocked_sigma_m]
        times, values, doubts = zip(*(clear or self._bin), strict=True)
        if self._end == len(self._done):
            kept = self._done[self._first : self._end].copy()
            self._first, self._end = 0, len(kept)
            self._done[: len(kept)] = kept
        self._done[self._end] = float(median(times)), median(values), median(doubts)
        self._end += 1
        self._first = max(self._first, self._end - MOST_BINS)
        self._bin = []

    def between(self, first: int, last: int) -> TimedRanges:
        """What came with first < utime <= last."""
        rows = self._done[self._first : self._end]
        if self._bin:
            rows = np.concatenate([rows, np.array(self._bin, dtype=float)])
        utime, range_m, doubt_m = rows[(rows[:, 0] > first) & (rows[:, 0] <= last)].T
        return TimedRanges(utime, range_m - self.bias_m, doubt_m)

    def is_fresh(self, utime: int, within_us: int) -> bool:
        return self.newest is not None and utime - self.newest < within_us


class RangeBuffers(dict[int, RangeBuffer]):
    """By UWB id, the modules that were heard of late."""

    def __init__(self, nlos_db: float = 0.0, model: RangeModel = LINKTRACK) -> None:
        super().__init__()
        self._nlos_db, self._model = nlos_db, model

    def add(self, sample: RangeSample) -> None:
        """Keep a range, unless it is to one module more than can be heard."""
        if sample.peer_uwb_id not in self:
            if len(self) >= MAX_UWB_IDS and not self._forget_silent(sample.utime):
                return
            self[sample.peer_uwb_id] = RangeBuffer(self._nlos_db, self._model)
        self[sample.peer_uwb_id].add(sample.utime, sample.range_m, sample.power_gap_db)

    def fresh(self, utime: int) -> list[int]:
        """Modules to which ranges came in of late."""
        return [u for u, b in self.items() if b.is_fresh(utime, RANGES_FRESH_US)]

    def _forget_silent(self, utime: int) -> bool:
        """Make room: forget the module that was silent longest, unless all are heard."""
        oldest = min(self, key=lambda uwb_id: self[uwb_id].newest or 0)
        if self[oldest].is_fresh(utime, RANGES_FRESH_US):
            return False
        del self[oldest]
        return True
