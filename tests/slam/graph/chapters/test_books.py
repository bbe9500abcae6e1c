"""What chapters keep of a log as it ages."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from drslamd.conventions import Chain
from drslamd.slam.graph.chapters import books as chapters
from drslamd.slam.graph.chapters.books import LEVELS, Book, Sorter, bound, coarse, condensed, few
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.thinning.time_cells import RECENT_S, STEP, ages, stretches
from drslamd.slam.robot_model import UNTOLD

A, B = Chain(4, 1), Chain(5, 1)
SEEN = ClosureMeasurement(0, True, 0, A, 0, (1.0, 0.0, 0.0), (0.25, 0.0, 0.0, 0.25, 0.0, 0.25))
QUARTER = LEVELS[1]


def ranged(seq: int, peer: Chain, sigma: float = 0.125) -> RangeMeasurement:
    return RangeMeasurement(10 * seq, peer, 10 * seq, (0.0, 0.0), (0.0, 0.0), 5.0, sigma)


def driven(*peers: Chain, count: int = 64) -> list[GraphEntry]:
    """A keyframe a second along a line, and a range to each peer."""
    return [
        GraphEntry(
            k, None, (Keyframe(10 * k, 0, 5_000 * k, 0, 0),), tuple(ranged(k, p) for p in peers)
        )
        for k in range(count)
    ]


def a_book(entries: list[GraphEntry]) -> Book:
    sorter = Sorter()
    return bound([sorter.book(entry, 0) for entry in entries])


def samples(book: Book) -> list[int]:
    return [k.n // 10 for k in book.keyframes]


def test_four_ranges_of_each_pair_stay_of_each_cell_at_times_of_which_keyframes_stay() -> None:
    book = condensed(a_book(driven(A, B)), QUARTER, set(), 99)
    for peer in (A, B):
        places = [place // 4096 for place, item in book.ranges if item.peer == peer]
        assert places == list(range(0, 64, 4))
    assert samples(book) == list(range(0, 64, 4))
    longer = condensed(book, LEVELS[2], set(), 99)
    assert [place // 4096 for place, item in longer.ranges if item.peer == A] == [0, 16, 32, 48]


def test_what_stays_of_four_cells_is_among_what_stays_of_each() -> None:
    chance = random.Random(1)
    entries = [
        replace(
            entry, ranges=tuple(ranged(entry.seq, p, chance.choice((0.1, 0.2))) for p in (A, B))
        )
        for entry in driven(count=256)
    ]
    items = a_book(entries).ranges
    assert few(few(items, 4, 16), 4, 64) == few(items, 4, 64)
    assert len(few(items, 4, 64)) == 2 * 4 * 4


def test_what_is_doubted_less_stays() -> None:
    entries = driven()
    for k in range(16):
        entries[k] = replace(entries[k], ranges=(ranged(k, A, 0.5),))
    for k in (3, 7, 9):
        entries[k] = replace(entries[k], ranges=(ranged(k, A, 0.0625),))
    places = {place // 4096 for place, _ in condensed(a_book(entries), QUARTER, set(), 99).ranges}
    assert {3, 7, 9} < places
    assert len(places) == 4


def test_keyframes_in_which_something_ends_stay() -> None:
    entries = driven()
    entries[30] = replace(entries[30], closures=(replace(SEEN, a_n=290),))
    book = condensed(a_book(entries), QUARTER, {50, 410}, 99)
    assert samples(book) == sorted({*range(0, 64, 4), 29, 5, 41})


def test_keyframes_at_both_ends_of_a_stand_and_of_a_segment_stay() -> None:
    entries = [entry for entry in driven() if not 21 < entry.seq < 27]
    entries = [
        replace(entry, keyframes=(replace(entry.keyframes[0], segment=int(entry.seq >= 42)),))
        for entry in entries
    ]
    book = condensed(a_book(entries), QUARTER, set(), 99)
    assert set(samples(book)) - set(range(0, 64, 4)) == {21, 27, 41, 42}


@pytest.mark.parametrize(("rate", "is_bent"), [(0.05, False), (0.2, True)])
def test_where_the_way_bends_more_keyframes_stay(rate: float, is_bent: bool) -> None:
    """At 0.5 m/s; a quarter circle of 16 s or more is as long as straight within 3 percent."""
    entries, x, y = [], 0.0, 0.0
    for k in range(128):
        entries.append(
            GraphEntry(k, None, (Keyframe(10 * k, 0, round(x), round(y), round(1e4 * rate * k)),))
        )
        x, y = x + 5_000 * math.cos(rate * k), y + 5_000 * math.sin(rate * k)
    book = condensed(a_book(entries), LEVELS[2], set(), 99)
    assert (len(book.keyframes) > 8) is is_bent
    steps = np.hypot(*np.diff([(k.x, k.y) for k in book.keyframes], axis=0).T)
    last = book.keyframes[-1].n // 10
    assert steps.sum() == pytest.approx(5_000 * last, rel=0.03)
    turns = np.diff([k.theta for k in book.keyframes])
    assert turns.max() <= 1e4 * (chapters.TURNED_RAD + rate)


def test_a_robot_whose_heading_a_gyro_gives_keeps_a_keyframe_every_few_seconds() -> None:
    assert samples(condensed(a_book(driven()), LEVELS[2], set(), 4)) == list(range(0, 64, 4))
    assert samples(condensed(a_book(driven()), LEVELS[2], set(), 16)) == [0, 16, 32, 48]


def test_of_a_closure_the_latest_word_stays_and_of_first_words_two_of_each_cell() -> None:
    words = [
        (1, replace(SEEN, number=0, a_n=10)),
        (2, replace(SEEN, number=1, a_n=20)),
        (3, replace(SEEN, number=2, a_n=30)),
        (4, replace(SEEN, number=3, a_n=40)),
        (9, replace(SEEN, number=1, a_n=20, kept=False)),
        (12, replace(SEEN, number=1, a_n=20, b_n=7)),
        (13, replace(SEEN, number=0, peer=B, kept=False)),
    ]
    entries = driven()
    for seq, word in words:
        entries[seq] = replace(entries[seq], closures=(word,))
    book = a_book(entries)
    assert [place // 4096 for place, _ in book.words] == [12, 13]
    assert [place // 4096 for place, _ in book.closures] == [1, 3, 4]
    few_of_them = condensed(book, QUARTER, set(), 99)
    assert few_of_them.words == book.words
    assert len(few_of_them.closures) == 2


def test_each_part_of_a_book_names_few_peers_and_together_they_say_all_of_it() -> None:
    peers = [Chain(robot, 1) for robot in (4, 5, 6, 7)]
    book = a_book(driven(*reversed(peers)))
    parts = [piece.part() for piece in book.pieces(4)]
    assert [{item.peer for _, item in part.ranges} for part in parts] == [{p} for p in peers]
    assert [len(part.keyframes) for part in parts] == [16] * 4
    assert sorted(p for part in parts for p in part.ranges) == sorted(book.ranges)


def test_the_latest_model_is_said_again() -> None:
    entries = driven()
    for k in (0, 40):
        entries[k] = replace(entries[k], model=UNTOLD)
    assert a_book(entries).models == [(40, UNTOLD)]


def test_what_was_said_again_with_less_digits_has_no_more_to_lose() -> None:
    book = a_book(driven(A))
    assert coarse(coarse(book)) == coarse(book)


@pytest.mark.parametrize(
    ("recent_s", "sizes"),
    [
        (300, [256, 256, 1_024, 4_096]),
        (150, [128, 192, 512, 2_048]),
        (75, [64, 192, 512, 1_024]),
        (37, [64, 192, 512, 1_024]),
        (1_000, [256, 256, 1_024, 4_096]),
    ],
)
def test_the_sooner_a_graph_thins_times_the_fewer_entries_has_a_chapter(
    recent_s: int, sizes: list[int]
) -> None:
    """In proportion to 300 s; no fewer than fill messages and have some cells of time."""
    assert [level.size(recent_s) for level in LEVELS] == sizes


@pytest.mark.parametrize("level", LEVELS[1:])
@pytest.mark.parametrize("recent_s", [RECENT_S, RECENT_S // 4])
def test_the_graph_has_cells_as_long_when_a_chapter_has_so_little(
    level: chapters.Detail, recent_s: int
) -> None:
    """However the clocks of two robots lie, and however their steps of time fall."""
    for other in range(0, STEP, 7):
        newest = {0: 100_000, 1: 100_000 - other}
        step = ages(newest, [{0: 0.0, 1: float(other % 80)}])[0]
        oldest_that_stays = newest[0] - 10 * level.age_s(recent_s)
        cells = [
            4**s.level for s in stretches(step, recent_s) if s.first <= oldest_that_stays < s.end
        ]
        assert cells[0] >= level.cell_s
