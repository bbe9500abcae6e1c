"""Rows that entries of a log say: they go when chapters stand for all entries that said them.

Each row belongs to the latest entry that said it: chapters come after what they say again. So what
is held is what those entries say that nothing stands for, in whatever order they came.
"""

from __future__ import annotations

import numpy as np

from drslamd.slam.graph.chapters.replaced_entries import Span
from drslamd.slam.graph.timed_rows import TimedRows
from drslamd.slam.se2 import Array


class SaidRows(TimedRows):
    """Of one chain or one pair; a last column, minus the entry, is nobody else's business."""

    def __init__(self, width: int, identity: int, most: int, before: int | None = None) -> None:
        """
        Args:
            width, identity, most: see `TimedRows`.
            before: columns by which the row that counts is chosen before the entry is; those of the
                identity if None.
        """
        super().__init__(width + 1, identity, most)
        first = identity if before is None else before
        self._order = [*range(first), width, *range(first, width)]

    def say(self, row: list[float], entry: int) -> None:
        """A row, as an entry of the log says it."""
        self.add([*row, -entry])

    def replace(self, spans: tuple[Span, ...]) -> bool:
        """Chapters stand for these entries: what only they said goes. Did anything?"""
        before = self.changes
        edges = np.array(spans).ravel()
        for block in self.blocks():
            entries = -super().of_block(block)[:, -1]
            stays = np.searchsorted(edges, entries, side="right") % 2 == 0
            if not stays.all():
                self.keep(block, stays)
        return self.changes != before

    def _sorted(self, rows: Array) -> Array:
        return rows[np.lexsort(rows[:, self._order[::-1]].T)]

    @property
    def rows(self) -> Array:
        return super().rows[:, :-1]

    def between(self, first: int, end: int) -> Array:
        return super().between(first, end)[:, :-1]

    def of_block(self, block: int) -> Array:
        return super().of_block(block)[:, :-1]
