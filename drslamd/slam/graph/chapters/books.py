"""Chapters: what a robot says again of its older log entries, together and with less.

A log is said several times. Its entries come one by one; of 256 of them the owner makes a chapter
that says all of it in a tenth of the bytes. When all of that lies in times of which the graph uses
no more than some in each quarter of a minute, the chapter is made anew with what is used, and again
with less for more of the log when cells of time are a minute and four minutes long
(`thinning.time_cells`). A chapter stands for entries, chapters among them: these are not kept, not
sent and not asked for any longer, and a graph holds what is left (`said_rows`).

Which entries a chapter stands for it says itself, so that what is held follows from the log alone.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_HZ, ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain
from drslamd.slam.graph.chapters.coarse_measurements import (
    WHOLE_WAY_STEPS,
    coarse_closure,
    coarse_keyframe,
    coarse_range,
)
from drslamd.slam.graph.chapters.replaced_entries import merged_spans
from drslamd.slam.graph.measurements import (
    Chapter,
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    Placed,
    RangeMeasurement,
)
from drslamd.slam.graph.thinning.time_cells import RECENT_S
from drslamd.slam.robot_model import RobotModel
from drslamd.slam.se2 import Array, Index

PER_ENTRY = 4_096
"""Above the number of measurements that any one entry of a log can hold."""
LATE_S = 64
"""So much later the graph thins at most: two steps of time behind the newest keyframe of the team,
one step, and half of one between clocks (`thinning.time_cells`)."""
FEW_RANGES, FEW_CLOSURES = 4, 2
"""Of one pair, that stay of one cell of time: as many as the graph uses."""
LONGER = 1.03
"""So much longer than straight is the way between two keyframes that stay; noise grows with it."""
TURNED_RAD = 1.0
"""So much it turns at most, likewise."""
ROUNDING_M = 0.02
"""Of a way, that is no bend."""
GOLDEN = 2_654_435_769
"""2^32 over the golden ratio: multiples of it, modulo 2^32, lie evenly however many are taken."""

Item = TypeVar("Item", RangeMeasurement, ClosureMeasurement)


class Detail(NamedTuple):
    """How much chapters say.

    Attributes:
        entries: of which one is made in a small team; fewest: in a large one.
        cell_s: cells of time of which few measurements stay; 0 says all.
        keyframes_s: the first keyframe of each so many seconds stays; gap_s: and those at both ends
            of a longer stand.
    """

    entries: int
    fewest: int
    cell_s: int
    keyframes_s: int
    gap_s: int

    def size(self, recent_s: int) -> int:
        """Entries of which one is made, in a team whose graph thins nothing for so long.

        In a large one times are thinned sooner, and each entry says more: what waits for the next
        chapter would be most of a log.
        """
        return min(self.entries, max(self.fewest, self.entries * recent_s // RECENT_S))

    def age_s(self, recent_s: int) -> int:
        """How old all of it has to be.

        Args:
            recent_s: for how long the graph thins nothing (`time_cells.recent_s`): cells are four
                times as long each time the age doubles.
        """
        if not self.cell_s:
            return 0
        doublings = (self.cell_s.bit_length() - 1) // 2
        return (recent_s << doublings - 1) + self.cell_s + LATE_S


LEVELS = (
    Detail(256, 64, 0, 0, 0),
    Detail(256, 192, 16, 4, 2),
    Detail(1_024, 512, 64, 16, 6),
    Detail(4_096, 1_024, 256, 16, 24),
)
"""The first is four minutes long: shorter ones have more bytes, because each message has a hundred
of its own and each column of numbers two. A robot that ranges to ten others fills messages with a
minute; and of cells of time that end in the midst of a chapter twice as much stays, so that one has
four of them at least."""


def by_peer(placed: Placed[RangeMeasurement] | Placed[ClosureMeasurement]) -> tuple[Chain, int]:
    """The order in which chapters are packed."""
    return placed[1].peer, placed[0]


@dataclass
class Book:
    """What a chapter says.

    Attributes:
        entries: so many of the log, chapters left out.
        spans: the entries that it stands for once it is said.
        utime: when the last of them was said.
        closures: first words of them; words: what was said of closures later.
    """

    entries: int = 0
    spans: list[tuple[int, int]] = field(default_factory=list)
    utime: int = 0
    models: list[tuple[int, RobotModel]] = field(default_factory=list)
    keyframes: list[Keyframe] = field(default_factory=list)
    ranges: list[Placed[RangeMeasurement]] = field(default_factory=list)
    closures: list[Placed[ClosureMeasurement]] = field(default_factory=list)
    words: list[Placed[ClosureMeasurement]] = field(default_factory=list)

    def pieces(self, count: int) -> list[Book]:
        """The same in so many parts of about the same size, each with few peers: these take bytes
        in every part that names them."""
        out = [Book() for _ in range(count)]
        for name in ("models", "keyframes", "ranges", "closures", "words"):
            items = getattr(self, name)
            if name in ("ranges", "closures", "words"):
                items = sorted(items, key=by_peer)
            for k, piece in enumerate(out):
                setattr(piece, name, items[k * len(items) // count : (k + 1) * len(items) // count])
        return out

    def part(self) -> Chapter:
        """It as part of a chapter, in the order in which that is packed."""
        return Chapter(
            parts=0,
            models=tuple(self.models),
            keyframes=tuple(self.keyframes),
            ranges=tuple(sorted(self.ranges, key=by_peer)),
            closures=tuple(sorted([*self.closures, *self.words], key=by_peer)),
        )


def bound(books: Sequence[Book]) -> Book:
    """Consecutive books as one; the latest model counts, and of a closure the latest word."""
    out = Book(
        entries=sum(book.entries for book in books),
        spans=merged_spans([span for book in books for span in book.spans]),
        utime=max((book.utime for book in books), default=0),
        models=[model for book in books for model in book.models][-1:],
        keyframes=[k for book in books for k in book.keyframes],
        ranges=[placed for book in books for placed in book.ranges],
    )
    words = [placed for book in books for placed in book.words]
    latest = {(seen.peer, seen.number): place for place, seen in words}
    out.words = [p for p in words if latest[p[1].peer, p[1].number] == p[0]]
    first = [placed for book in books for placed in book.closures]
    out.closures = [p for p in first if (p[1].peer, p[1].number) not in latest]
    return out


class Sorter:
    """Makes books of what one robot said.

    It remembers the highest closure number of each peer: closures are numbered as they are found,
    so a word of a lower one, or a withdrawal, changes an earlier word.
    """

    def __init__(self) -> None:
        self._told: dict[Chain, int] = {}

    def book(self, entry: GraphEntry, utime: int) -> Book:
        """What one entry says, that was said at `utime`."""
        begin = entry.seq * PER_ENTRY
        out = Book(
            entries=1,
            spans=[(entry.seq, entry.seq + 1)],
            utime=utime,
            models=[(entry.seq, entry.model)] if entry.model else [],
            keyframes=list(entry.keyframes),
            ranges=list(enumerate(entry.ranges, start=begin)),
        )
        for place, seen in enumerate(entry.closures, start=begin):
            highest = self._told.get(seen.peer, -1)
            self._told[seen.peer] = max(seen.number, highest)
            is_first = seen.kept and seen.number > highest
            (out.closures if is_first else out.words).append((place, seen))
        return out


def condensed(book: Book, level: Detail, named: Container[int], longest_s: int) -> Book:
    """What stays of a book.

    Args:
        named: keyframes that measurements of the team end in; longest_s: between two that stay.
    """
    if not level.cell_s:
        return book
    out = replace(
        book,
        ranges=few(book.ranges, FEW_RANGES, level.cell_s),
        closures=few(book.closures, FEW_CLOSURES, level.cell_s),
    )
    ends = {seen.a_n for _, seen in (*out.closures, *out.words)}
    ends |= {item.a_n for _, item in out.ranges}
    cell = GRID_HZ * min(level.keyframes_s, longest_s)
    stay = [False] * len(book.keyframes)
    for k, is_end in enumerate(_is_edge(book.keyframes, cell, GRID_HZ * level.gap_s)):
        stay[k] = is_end or book.keyframes[k].n in ends or book.keyframes[k].n in named
    _straighten(book.keyframes, stay)
    staying = (k for k, stays in zip(book.keyframes, stay, strict=True) if stays)
    out.keyframes = [coarse_keyframe(k) for k in staying]
    return out


def coarse(book: Book) -> Book:
    """The same as chapters say it."""
    return replace(
        book,
        keyframes=[coarse_keyframe(k, WHOLE_WAY_STEPS) for k in book.keyframes],
        ranges=[(place, coarse_range(item)) for place, item in book.ranges],
        closures=[(place, coarse_closure(item)) for place, item in book.closures],
        words=[(place, coarse_closure(item)) for place, item in book.words],
    )


def _is_edge(keyframes: Sequence[Keyframe], cell: int, gap: int) -> list[bool]:
    """Which are the first of their cell, or at an end of a segment or a stand."""
    out = [True] * len(keyframes)
    breaks = [b.segment != a.segment or b.n - a.n > gap for a, b in pairwise(keyframes)]
    for k, (one, other) in enumerate(pairwise(keyframes), start=1):
        out[k] = breaks[k - 1] or one.n // cell != other.n // cell
        out[k - 1] = out[k - 1] or breaks[k - 1]
    return out


def _straighten(keyframes: Sequence[Keyframe], stay: list[bool]) -> None:
    """Where the way bends, more of them stay."""
    last, way = 0, 0.0
    for k in range(1, len(keyframes)):
        one, here, start = keyframes[k - 1], keyframes[k], keyframes[last]
        way += _distance(one, here)
        turned = abs(here.theta - start.theta) * ROTATION_STEP_RAD
        bends = way > LONGER * _distance(start, here) + ROUNDING_M or turned > TURNED_RAD
        if bends and last < k - 1:
            stay[k - 1] = True
            last, way = k - 1, _distance(one, here)
        if stay[k]:
            last, way = k, 0.0


def _distance(one: Keyframe, other: Keyframe) -> float:
    return float(np.hypot(one.x - other.x, one.y - other.y)) * TRANSLATION_STEP_M


def few(items: list[Placed[Item]], most: int, cell_s: int) -> list[Placed[Item]]:
    """So many of each pair stay of each cell of time."""
    number = {peer: k for k, peer in enumerate({item.peer for _, item in items})}
    stay = those_that_stay(
        np.array([number[item.peer] for _, item in items], dtype=np.int64),
        np.array([place for place, _ in items], dtype=np.int64),
        np.array([item.a_n for _, item in items], dtype=np.int64),
        np.array([getattr(item, "sigma_m", 1.0) for _, item in items]),
        most,
        cell_s,
    )
    return [placed for placed, stays in zip(items, stay, strict=True) if stays]


def those_that_stay(
    pair: Index, place: Index, a_n: Index, sigma_m: Array, most: int, cell_s: int
) -> NDArray[np.bool_]:
    """Which measurements (k,) stay: what is doubted less first; then what begins at times at which
    keyframes stay anyway; then evenly over time. So what stays of four cells is among what stays of
    each. Time is counted in entries, one a second: it goes on where a robot stands."""
    seq = place // PER_ENTRY
    late = (a_n[:, None] % (GRID_HZ * np.array([4, 8, 16])) >= GRID_HZ).sum(axis=1)
    order = np.lexsort(
        (place, seq * GOLDEN % 2**32, late, np.frexp(sigma_m)[1], seq // cell_s, pair)
    )
    groups = np.stack([(seq // cell_s)[order], pair[order]])
    begins = np.ones(len(order), dtype=bool)
    begins[1:] = (groups[:, 1:] != groups[:, :-1]).any(axis=0)
    at = np.arange(len(order))
    out = np.zeros(len(order), dtype=bool)
    out[order] = at - np.maximum.accumulate(np.where(begins, at, 0)) < most
    return out
