"""Measurements as arrays: rows that are kept in order, and names for their columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.se2 import Array, Index

WAITING = 1_024
"""Rows that came in and are not yet sorted into their table."""


class KeyedRows:
    """Rows in the order of their first column, each value of it once, the last `most` of them."""

    def __init__(self, width: int, most: int) -> None:
        self._sorted = np.empty((0, width))
        self._new: list[list[float]] = []
        self._most = most

    def add(self, row: list[float]) -> None:
        self._new.append(row)
        if len(self._new) >= WAITING:
            self._merge()

    @property
    def data(self) -> Array:
        """(k, width); the same array until something was added."""
        if self._new:
            self._merge()
        return self._sorted

    def replace(self, rows: Array) -> None:
        """Let these rows, in order, be all."""
        self._sorted, self._new = rows, []

    def _merge(self) -> None:
        rows = np.concatenate([self._sorted, np.array(self._new)])
        self._new = []
        if (np.diff(rows[:, 0]) <= 0).any():
            # of rows with one key the smallest counts, whichever came first
            rows = rows[np.lexsort(rows.T[::-1])]
            rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
        self._sorted = rows[-self._most :]


@dataclass(frozen=True)
class KeyframeTable:
    """k keyframes of one chain in the order of time, as rows (k, 5) of n, segment, x, y, theta."""

    rows: Array

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def n(self) -> Index:
        """(k,) samples of the 10 Hz grid."""
        return self.rows[:, 0].astype(np.int64)

    @property
    def segment(self) -> Index:
        """(k,) ascending."""
        return self.rows[:, 1].astype(np.int64)

    @property
    def poses(self) -> Array:
        """(k, 3) o_T_k, m and rad."""
        return self.rows[:, 2:]

    def chosen(self, which: NDArray[np.bool_] | Index | slice) -> KeyframeTable:
        return KeyframeTable(self.rows[which])

    def find(self, n: Array) -> tuple[Index, NDArray[np.bool_]]:
        """Positions of keyframes n (m,), and which of them are there."""
        return positions(self.rows[:, 0], n)

    def of_segment(self, segment: int) -> slice:
        """Which rows a segment is; empty when it is not there."""
        return slice(*np.searchsorted(self.rows[:, 1], [segment, segment + 1]).tolist())


def positions(ascending: Array, wanted: Array) -> tuple[Index, NDArray[np.bool_]]:
    """Where each wanted value is, and whether it is there at all."""
    at = np.minimum(np.searchsorted(ascending, wanted), max(len(ascending) - 1, 0))
    there = ascending[at] == wanted if len(ascending) else np.zeros(len(wanted), bool)
    return at, there


RANGE_COLUMNS = 9
"""Of `RangeTable`."""


@dataclass(frozen=True)
class RangeTable:
    """k ranges of one pair in the order of their owner's log, as rows (k, 9):

    key, a_n, b_n, q_a (2), q_b (2), range, sigma.
    """

    rows: Array

    def __len__(self) -> int:
        return len(self.rows)

    @staticmethod
    def row(
        key: int,
        a_n: int,
        b_n: int,
        q_a: tuple[float, float],
        q_b: tuple[float, float],
        range_m: float,
        sigma_m: float,
    ) -> list[float]:
        """One row."""
        return [key, a_n, b_n, *q_a, *q_b, range_m, sigma_m]

    @property
    def a_n(self) -> Array:
        """(k,) keyframes of the owner."""
        return self.rows[:, 1]

    @property
    def b_n(self) -> Array:
        """(k,) keyframes of the peer."""
        return self.rows[:, 2]

    @property
    def q_a(self) -> Array:
        """(k, 2) antenna of the owner seen from its keyframe, m."""
        return self.rows[:, 3:5]

    @property
    def q_b(self) -> Array:
        """(k, 2) antenna of the peer seen from its keyframe, m."""
        return self.rows[:, 5:7]

    @property
    def range_m(self) -> Array:
        return self.rows[:, 7]

    @property
    def sigma_m(self) -> Array:
        return self.rows[:, 8]

    def chosen(self, which: NDArray[np.bool_] | Index) -> RangeTable:
        return RangeTable(self.rows[which])

    def copy(self) -> RangeTable:
        """With columns that may be written to."""
        return RangeTable(self.rows.copy())
