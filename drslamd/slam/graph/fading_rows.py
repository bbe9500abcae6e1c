"""Rows of a pair of which, after a while, only those stay that the owner's chapters say again.

Each row has a place in its owner's log. It belongs to the most lasting layer that said it, and goes
when that layer counts no more (`chapters.counts`). What is left follows from what was said and from
the owner's latest chapter, not from the order in which it came.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drslamd.slam.graph.chapters import PER_ENTRY, RAW, counts
from drslamd.slam.graph.timed_rows import BLOCK, TimedRows
from drslamd.slam.se2 import Array


class FadingRows(TimedRows):
    """Of one pair."""

    def __init__(
        self, width: int, identity: int, most: int, places: Callable[[Array], Array]
    ) -> None:
        """
        Args:
            width, identity, most: see `TimedRows`.
            places: of rows (k, width), as (k,).
        """
        super().__init__(width, identity, most)
        self._places = places
        self._layer: dict[int, int] = {}
        """By place, where it is not that of entries."""
        self._dense: set[int] = set()
        """Blocks with rows that will go."""
        self._latest = -1

    def say(self, row: list[float], place: int, layer: int = RAW) -> None:
        """A row, as a layer said it."""
        known = self._layer.get(place, RAW)
        if layer < known:
            known = self._layer[place] = layer
        if not counts(known, place // PER_ENTRY, self._latest):
            return
        self.add(row)
        if known:
            self._dense.add(int(row[0]) // BLOCK)

    def fade(self, latest: int) -> None:
        """The owner's latest chapter is entry `latest`: what counts no more goes."""
        self._latest = latest
        for block in list(self._dense):
            if not self.holds(block):
                self._dense.discard(block)
                continue
            places = self._places(self.of_block(block)).astype(np.int64).tolist()
            layers = [self._layer.get(place, RAW) for place in places]
            stays = [
                counts(layer, place // PER_ENTRY, latest)
                for place, layer in zip(places, layers, strict=True)
            ]
            if not any(layers):
                self._dense.discard(block)
            if all(stays):
                continue
            for place, is_there in zip(places, stays, strict=True):
                if not is_there:
                    self._layer.pop(place, None)
            self.keep(block, np.array(stays))
