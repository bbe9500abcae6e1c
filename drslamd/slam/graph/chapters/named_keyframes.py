"""Which keyframes of a chain measurements end in: a chapter has to keep these."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import Chain
from drslamd.slam.graph.chapters.books import (
    FEW_CLOSURES,
    FEW_RANGES,
    Book,
    Detail,
    those_that_stay,
)
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import ClosureTable, RangeTable
from drslamd.slam.se2 import Array, Index


def named_keyframes(graph: PoseGraph, own: Chain, book: Book, level: Detail) -> set[int]:
    """Keyframes of our chain, among those of a book, in which measurements end that are to stay.

    What others measured is sorted as they will sort it themselves; of what they have already sorted
    all stays.
    """
    if not book.keyframes:
        return set()
    first, last = book.keyframes[0].n, book.keyframes[-1].n
    out: set[int] = set()
    for pair in graph.pairs.values():
        if own not in (pair.a, pair.b):
            continue
        ranges, closures = pair.ranges, ClosureTable(pair.said_closures.rows)
        for table, sigma, most in (
            (ranges, ranges.sigma_m, FEW_RANGES),
            (closures, np.ones(len(closures)), FEW_CLOSURES),
        ):
            ends = table.a_n if own == pair.a else table.b_n
            inside = np.flatnonzero((ends >= first) & (ends <= last))
            stay = _stays(table.chosen(inside), sigma[inside], most, level)
            out.update(ends[inside][stay].astype(int).tolist())
    return out


def _stays(
    table: RangeTable | ClosureTable, sigma_m: Array, most: int, level: Detail
) -> NDArray[np.bool_]:
    place, a_n = table.place.astype(np.int64), table.a_n.astype(np.int64)
    stay = those_that_stay(np.zeros_like(place), place, a_n, sigma_m, most, level.cell_s)
    return stay | _is_later_word(table, place) if isinstance(table, ClosureTable) else stay


def _is_later_word(table: ClosureTable, place: Index) -> NDArray[np.bool_]:
    """Which are no first words of closures: these all stay."""
    order = np.argsort(place)
    number = table.number[order]
    highest = np.concatenate([[-1.0], np.maximum.accumulate(number)[:-1]])[: len(number)]
    out = np.zeros(len(order), dtype=bool)
    out[order] = (number <= highest) | (table.rows[order, 3] == 0)
    return out
