"""Rows by the time at which they were measured: what is held of them never depends on their order.

Rows come late, twice, or contradict each other. They are kept in blocks of time, so that one that
comes late moves nothing but its neighbours. What becomes too old or too much is dropped in whole
blocks, from the oldest on: what is left of a block is then all that was said of it.
"""

from __future__ import annotations

from array import array

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_HZ
from drslamd.slam.se2 import Array

BLOCK = 64 * GRID_HZ
"""Samples: about a minute, in which a robot says some kB."""
HELD_BLOCKS = 507
"""Nine hours. A log holds ten (`replicated_log.MAX_ENTRIES`), so that whoever joins late can know
all of what the others still use."""
WAITING = 1_024
"""Rows that came in and are not yet sorted into their blocks."""


LATELY = 32
"""Changes of which more is known than their block: between two looks there are a few."""
NEVER = 2**40
"""A sample beyond all that can be said."""


class TimedRows:
    """Rows in the order of their columns, the first of which is a sample of the 10 Hz grid.

    Of rows that agree in their first columns, their identity, the smallest counts.
    """

    def __init__(self, width: int, identity: int, most: int) -> None:
        """
        Args:
            width: number of columns; identity: how many of them name a row.
            most: rows that are held.
        """
        self._width, self._identity, self._most = width, identity, most
        self._blocks: dict[int, Array] = {}
        self._new: dict[int, list[list[float]]] = {}
        self._changed: dict[int, int] = {}
        """By block, in the order in which they changed last: `changes` then."""
        self._lately = array("q")
        """The first sample that each of the last changes touched."""
        self._held = self._waiting = self._changes = 0
        self._floor, self._floor_changed, self._newest = 0, 0, -1
        self._all: Array | None = None

    def add(self, row: list[float]) -> None:
        block = int(row[0]) // BLOCK
        if block < self._floor:
            return
        self._change(block, int(row[0]))
        self._new.setdefault(block, []).append(row)
        self._all = None
        self._waiting += 1
        if block > self._newest:
            self._newest = block
            self._drop_before(block - HELD_BLOCKS + 1)
        if self._waiting >= WAITING:
            self._settle()

    def _change(self, block: int, first: int) -> None:
        """From sample `first` on something of a block changes."""
        self._changes += 1
        self._changed.pop(block, None)
        self._changed[block] = self._changes
        self._lately.append(first)
        if len(self._lately) >= 2 * LATELY:
            del self._lately[:LATELY]

    @property
    def changes(self) -> int:
        """Grows with whatever changes."""
        self._settle()
        return self._changes

    def changed_since(self, changes: int) -> list[int]:
        """Blocks that are held and had other rows when there were so many `changes`."""
        self._settle()
        out: list[int] = []
        for block in reversed(self._changed):
            if self._changed[block] <= changes:
                break
            out.append(block)
        return out

    def is_same(self, changes: int, first: int, end: int) -> bool:
        """Are the rows of samples first .. end - 1 those of when there were so many `changes`?"""
        if end <= self.unchanged_before(changes):
            return True
        if self._floor_changed > changes and first < self._floor * BLOCK:
            return False
        blocks = self.changed_since(changes)
        return not any(first // BLOCK <= block <= (end - 1) // BLOCK for block in blocks)

    def unchanged_before(self, changes: int) -> int:
        """Rows before this sample are those of when there were so many `changes`."""
        self._settle()
        if self._floor_changed > changes:
            return 0
        # (from here on one change is one entry of `_lately`)
        count = self._changes - changes
        if count <= len(self._lately):
            return min(self._lately[len(self._lately) - count :], default=NEVER)
        return min(self.changed_since(changes), default=NEVER // BLOCK) * BLOCK

    @property
    def floor(self) -> int:
        """What lies in blocks before this one is dropped."""
        self._settle()
        return self._floor

    def of_block(self, block: int) -> Array:
        """(k, width) rows of one block that is held."""
        self._settle()
        return self._blocks[block]

    def blocks(self) -> list[int]:
        """Those that are held."""
        self._settle()
        return list(self._blocks)

    def keep(self, block: int, which: NDArray[np.bool_]) -> None:
        """Give up all rows (k,) of a block that is held but these."""
        self._settle()
        rows = self._blocks[block]
        self._blocks[block] = rows[which]
        self._held -= len(rows) - len(self._blocks[block])
        self._change(block, block * BLOCK)
        self._all = None

    def between(self, first: int, end: int) -> Array:
        """(k, width) rows of samples first .. end - 1, in an array of its own."""
        self._settle()
        low, high = max(first // BLOCK, self._floor), min((end - 1) // BLOCK, self._newest)
        if high - low < len(self._blocks):
            inside = [block for block in range(low, high + 1) if block in self._blocks]
        else:
            inside = sorted(block for block in self._blocks if low <= block <= high)
        if not inside:
            return np.empty((0, self._width))
        parts = [self._blocks[block] for block in inside]
        # only at both ends there may be others
        if first > inside[0] * BLOCK:
            parts[0] = parts[0][np.searchsorted(parts[0][:, 0], first) :]
        if end < (inside[-1] + 1) * BLOCK:
            parts[-1] = parts[-1][: np.searchsorted(parts[-1][:, 0], end)]
        return np.concatenate(parts)

    @property
    def rows(self) -> Array:
        """(k, width) all of them; the same array until something is added."""
        self._settle()
        if self._all is None:
            parts = [self._blocks[block] for block in sorted(self._blocks)]
            self._all = np.concatenate([np.empty((0, self._width)), *parts])
        return self._all

    def _settle(self) -> None:
        """Sort in what is new."""
        if not self._new:
            return
        for block, rows in self._new.items():
            known = self._blocks.get(block)
            merged = np.array(rows) if known is None else np.concatenate([known, np.array(rows)])
            self._blocks[block] = self._in_order(merged)
            self._held += len(self._blocks[block]) - (0 if known is None else len(known))
        self._new, self._waiting = {}, 0
        while self._held > self._most:
            self._drop_before(min(self._blocks) + 1)

    def _in_order(self, rows: Array) -> Array:
        keys = rows[:, : self._identity]
        if _ascends(keys):
            return rows
        rows = self._sorted(rows)
        keys = rows[:, : self._identity]
        first = np.ones(len(rows), dtype=bool)
        first[1:] = (keys[1:] != keys[:-1]).any(axis=1)
        return rows[first]

    def _sorted(self, rows: Array) -> Array:
        """Rows in order; the first one of each identity counts."""
        return rows[np.lexsort(rows.T[::-1])]

    def _drop_before(self, floor: int) -> None:
        """Give up what is older, whether it was held or not."""
        if floor <= self._floor:
            return
        self._floor = floor
        gone = [block for block in self._changed if block < floor]
        for block in gone:
            del self._changed[block]
            self._held -= len(self._blocks.pop(block, ()))
            self._waiting -= len(self._new.pop(block, ()))
        if gone:
            self._changes += 1
            self._floor_changed, self._all = self._changes, None
            self._lately = array("q")


def _ascends(keys: Array) -> bool:
    """Is each row of keys (k, c) above the one before it?"""
    step = np.diff(keys, axis=0)
    first = (step != 0).argmax(axis=1)
    return bool((step[np.arange(len(step)), first] > 0).all())
