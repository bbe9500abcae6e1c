"""Rows of numbers in the order of time, with a bound on how many are kept."""

from __future__ import annotations

import numpy as np

from drslamd.slam.se2 import Array

SHARE_DROPPED = 8
"""A full table drops so large a part of itself at once: an eighth, the oldest."""


class Rows:
    """At most `most` rows, ascending in their first column."""

    def __init__(self, most: int, columns: int) -> None:
        self._table = np.zeros((min(most, 64), columns))
        self._most, self._count = most, 0

    @property
    def values(self) -> Array:
        """(k, columns), a view of what is held."""
        return self._table[: self._count]

    def clear(self) -> None:
        self._count = 0

    def append(self, row: Array, apart: float = 0.0) -> None:
        """Put a row at the end.

        Args:
            apart: the last row gives way when it is not so far from the one before it.
        """
        held = self.values
        if len(held) > 1 and held[-1, 0] - held[-2, 0] < apart:
            held[-1] = row
            return
        self._make_room()
        self._table[self._count] = row
        self._count += 1

    def extend(self, rows: Array) -> None:
        """Put rows at the end, the latest of them when they are too many."""
        for row in rows[-self._most :]:
            self.append(row)

    def insert(self, row: Array) -> None:
        """Put a row in its place; one at the same time is held already."""
        held = self.values
        at = int(np.searchsorted(held[:, 0], row[0]))
        if at < len(held) and held[at, 0] == row[0]:
            return
        before = self._count
        self._make_room()
        at -= before - self._count
        if at < 0:
            return  # older than all that is kept
        self._table[at + 1 : self._count + 1] = self._table[at : self._count]
        self._table[at] = row
        self._count += 1

    def _make_room(self) -> None:
        if self._count < len(self._table):
            return
        if self._count < self._most:
            size = min(self._most, 2 * len(self._table))
            grown = np.zeros((size, self._table.shape[1]))
            grown[: self._count] = self.values
            self._table = grown
            return
        dropped = max(1, self._most // SHARE_DROPPED)
        self._table[: self._count - dropped] = self._table[dropped : self._count]
        self._count -= dropped
