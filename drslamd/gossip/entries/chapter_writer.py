"""A robot makes chapters of its own log, each in as many messages as it takes."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Set
from dataclasses import dataclass, replace
from functools import partial

from drslamd.conventions import SECOND_US, Chain
from drslamd.gossip.entries.chapter_packing import (
    MOST_LAG,
    MOST_PARTS,
    MOST_SPANS,
    numbers_in,
    packed,
)
from drslamd.gossip.entries.number_tables import MAX_NUMBERS
from drslamd.gossip.lc02 import MAX_PAYLOAD
from drslamd.gossip.message_types import LogState
from drslamd.slam.graph.chapters.books import LEVELS, Book, Detail, Sorter, bound, coarse, condensed
from drslamd.slam.graph.chapters.named_keyframes import named_keyframes
from drslamd.slam.graph.chapters.replaced_entries import Span, merged_spans
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.odometry.gyro_noise import LONGEST_STEP_S

ENVELOPE_BYTES = 64
"""What a graph_t needs besides what it packs."""
FEWEST = 16
"""Entries of which a chapter is made early when somebody lacks them: it has a fifth of their
bytes."""
MOST_MEASUREMENTS = 1_280
"""Of which a chapter is made early: 64 full entries, 30 parts of noise at most."""
USUAL_BYTES = 500
"""Of a message of one robot alone: smaller ones have more envelopes, larger ones find room later.
What may be repeated grows with the team, and the best size with its root."""


def nobody_names(book: Book, level: Detail) -> Set[int]:
    """Of a robot to which nobody ranges."""
    return set()


@dataclass(frozen=True)
class Audience:
    """For whom chapters are made.

    Attributes:
        recent_s: for how long the graph thins nothing.
        robots: that hear each other now.
        named: keyframes of a book in which measurements of the team end that stay at a level.
    """

    recent_s: int
    robots: int
    named: Callable[[Book, Detail], Set[int]] = nobody_names

    def most_bytes(self) -> int:
        """Of a message."""
        return min(MAX_PAYLOAD, round(USUAL_BYTES * math.sqrt(max(2, self.robots))))


def audience_of(graph: PoseGraph, own: Chain, robots: int) -> Audience:
    """Of a robot that holds a graph and hears so many robots, itself among them."""
    return Audience(graph.recent_s, robots, partial(named_keyframes, graph, own))


class ChapterWriter:
    """Of one start of one robot."""

    def __init__(self) -> None:
        self._entries: list[int] = []
        """That are in no chapter yet ..."""
        self._unsaid: list[Book] = []
        """... and what they say."""
        self._said: list[list[Book]] = [[] for _ in LEVELS]
        """Of each level, the chapters that count, in order."""
        self._sorter = Sorter()
        self._measurements = 0
        """In these entries."""
        self._is_asked = self._has_gyro = False

    def take(self, entry: GraphEntry, utime: int) -> None:
        """An entry that was said at `utime`, in order."""
        if entry.chapter is None:
            self._entries.append(entry.seq)
            self._unsaid.append(self._sorter.book(entry, utime))
            self._measurements += len(entry.keyframes) + len(entry.ranges) + len(entry.closures)
            if entry.model:
                self._has_gyro = entry.model.noise.gyro is not None

    def on_states(self, own: Chain, states: Iterable[LogState]) -> None:
        """A peer says what it has of our log: if it lacks many entries, they are better said at
        once. The first row says where its first gap is, others what lies beyond."""
        rows = [state for state in states if (state.id, state.epoch) == own]
        if not rows or self._is_asked or len(self._entries) < FEWEST:
            return
        beyond = self._entries[bisect_left(self._entries, rows[0].complete) :]
        held = [(row.first, row.complete) for row in rows[1:]]
        lacking = sum(not any(begin <= seq < end for begin, end in held) for seq in beyond)
        self._is_asked = lacking >= FEWEST

    def due(self, seq: int, utime: int, team: Audience) -> list[GraphEntry]:
        """The entries that follow now, from number `seq` on: one chapter, most often none. Ask once
        a second: what becomes due at once is said one chapter after the other, because each takes
        as long as sensors may wait."""
        most = FEWEST if self._is_asked else LEVELS[0].size(team.recent_s)
        if len(self._entries) >= most or self._measurements >= MOST_MEASUREMENTS:
            self._is_asked = False
            new = coarse(bound(self._unsaid))
            self._entries, self._unsaid, self._measurements = [], [], 0
            return self._say(new, 0, seq, team)
        for number, level in enumerate(LEVELS[1:], start=1):
            until = utime - SECOND_US * level.age_s(team.recent_s)
            old = self._ripe(number, level.size(team.recent_s), seq - MOST_LAG // 2, until)
            if old is not None:
                ends = team.named(old, level)
                longest = int(LONGEST_STEP_S) - 1 if self._has_gyro else level.keyframes_s
                # (a later one says what the sensors are like)
                book = replace(condensed(old, level, ends, longest), models=[])
                return self._say(book, number, seq, team)
        return []

    def _ripe(self, number: int, most: int, first: int, until: int) -> Book | None:
        """Chapters of the level below that together make the next one of this level, if there are.

        Args:
            most: entries of which one is made; first: what was said before this entry has to be
                said now; until: what was said before
                this time is old enough.
        """
        waiting = self._said[number - 1]
        if not waiting:
            return None
        is_late = is_ready = waiting[0].spans[0][0] < first
        taken: list[Book] = []
        for book in waiting:
            spans = merged_spans([span for one in (*taken, book) for span in one.spans])
            if sum(one.entries for one in taken) >= most or len(spans) >= MOST_SPANS:
                is_ready = True
                break
            if book.utime >= until and not is_late:
                break
            taken.append(book)
        is_ready = is_ready or sum(one.entries for one in taken) >= most
        if not (taken and is_ready):
            return None
        del waiting[: len(taken)]
        return bound(taken)

    def _say(self, book: Book, number: int, seq: int, team: Audience) -> list[GraphEntry]:
        """A book of a level in as many entries as it takes."""
        spans, most = tuple(book.spans), team.most_bytes()
        # (pieces have about as many bytes as the whole, and their envelopes)
        count = 1 + len(packed(book.part())) // most
        while not all(_fits(piece, spans, most) for piece in book.pieces(count)):
            count += 1
        chapters = [piece.part() for piece in book.pieces(count)]
        chapters[-1] = replace(chapters[-1], parts=count, replaces=spans)
        self._said[number].append(replace(book, spans=merged_spans([*spans, (seq, seq + count)])))
        return [GraphEntry(seq + k, chapter=chapter) for k, chapter in enumerate(chapters)]


def _fits(piece: Book, spans: tuple[Span, ...], most: int) -> bool:
    """Does it fit a message of so many bytes, if it is the last part?"""
    chapter = replace(piece.part(), parts=MOST_PARTS, replaces=spans)
    is_short = numbers_in(chapter) <= MAX_NUMBERS
    return is_short and len(packed(chapter)) <= most - ENVELOPE_BYTES
