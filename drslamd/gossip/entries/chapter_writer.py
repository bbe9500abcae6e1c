"""A robot makes chapters of its own log: of 256 entries one, in as many messages as it takes."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator

from drslamd.conventions import Chain
from drslamd.gossip.entries.chapter_packing import numbers_in, packed
from drslamd.gossip.entries.number_tables import MAX_NUMBERS
from drslamd.gossip.lc02 import MAX_PAYLOAD
from drslamd.gossip.message_types import LogState
from drslamd.slam.graph.chapters import SPAN, Layer, Sorter, part
from drslamd.slam.graph.measurements import Chapter, GraphEntry

ENVELOPE_BYTES = 64
"""What a graph_t needs besides what it packs."""
FEWEST = 16
"""Entries of which a chapter is made early when somebody lacks them: it has a fifth of their
bytes."""
MOST_MEASUREMENTS = 1_280
"""Of which a chapter is made early: 64 full entries, 30 parts of noise at most."""
NOT_LAST = (0, 0, 0)


def _number(entry: GraphEntry) -> int:
    return entry.seq


class ChapterWriter:
    """Of one start of one robot."""

    def __init__(self) -> None:
        self._entries: list[GraphEntry] = []
        self._sorter = Sorter()
        self._measurements = 0
        """In these entries."""
        self._is_asked = False

    def take(self, entry: GraphEntry) -> None:
        """An entry that was said, in order."""
        if entry.chapter is None:
            self._entries.append(entry)
            self._measurements += len(entry.keyframes) + len(entry.ranges) + len(entry.closures)

    def on_states(self, own: Chain, states: Iterable[LogState]) -> None:
        """A peer says what it has of our log: if it lacks many entries, they are better said at
        once. The first row says where its first gap is, others what lies beyond."""
        rows = [state for state in states if (state.id, state.epoch) == own]
        if not rows or self._is_asked or len(self._entries) < FEWEST:
            return
        beyond = self._entries[bisect_left(self._entries, rows[0].complete, key=_number) :]
        held = [(row.first, row.complete) for row in rows[1:]]
        lacking = sum(not any(begin <= entry.seq < end for begin, end in held) for entry in beyond)
        self._is_asked = lacking >= FEWEST

    def due(self, seq: int) -> list[GraphEntry]:
        """The entries that follow now, from number `seq` on: those of a chapter, most often none.

        Their layers come in the order in which they cease to count; the last one says how many
        there are.
        """
        is_full = self._measurements >= MOST_MEASUREMENTS
        if not is_full and len(self._entries) < (FEWEST if self._is_asked else SPAN):
            return []
        self._is_asked = False
        entries, self._entries, self._measurements = self._entries, [], 0
        first = entries[0].seq
        lasting, longer, rest = self._sorter.layers(entries)
        chapters: list[Chapter] = []
        parts: list[int] = []
        for number, layer in ((2, rest), (1, longer), (0, lasting)):
            pieces = list(_pieces(layer, number, first)) if layer or not number else []
            chapters += [part(piece, number, first, NOT_LAST) for piece in pieces]
            parts.append(len(pieces))
        last = chapters[-1]
        two, one, zero = parts
        chapters[-1] = Chapter(
            last.layer,
            last.first,
            (two, one, zero),
            last.models,
            last.keyframes,
            last.ranges,
            last.closures,
        )
        return [GraphEntry(seq + k, chapter=chapter) for k, chapter in enumerate(chapters)]


def _pieces(layer: Layer, number: int, first: int) -> Iterator[Layer]:
    """A layer in pieces that each fit a message."""
    chapter = part(layer, number, first, NOT_LAST)
    is_short = numbers_in(chapter) <= MAX_NUMBERS
    if is_short and len(packed(chapter)) <= MAX_PAYLOAD - ENVELOPE_BYTES:
        yield layer
        return
    for half in layer.halves():
        yield from _pieces(half, number, first)
