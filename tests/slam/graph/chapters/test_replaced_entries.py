"""For which entries chapters stand."""

from __future__ import annotations

import random

import pytest

from drslamd.slam.graph.chapters.replaced_entries import ReplacedEntries, merged_spans
from drslamd.slam.graph.measurements import Chapter


def test_a_chapter_stands_for_nothing_until_all_its_parts_are_here() -> None:
    found = ReplacedEntries()
    assert found.take(12, Chapter(3, ((0, 4), (6, 9)))) == ()
    assert found.take(10, Chapter(0)) == ()
    assert not found.has(0)
    assert found.take(11, Chapter(0)) == ((0, 4), (6, 9))
    assert [seq for seq in range(13) if found.has(seq)] == [0, 1, 2, 3, 6, 7, 8]
    assert (found.end_of(1), found.end_of(4), found.end_of(8)) == (4, None, 9)
    assert found.spans_from(2) == [(2, 4), (6, 9)]


def test_a_chapter_for_which_another_stands_is_waited_for_no_longer() -> None:
    found = ReplacedEntries()
    found.take(12, Chapter(2, ((0, 9),)))
    assert found.take(20, Chapter(1, ((0, 13),))) == ((0, 13),)
    assert found.take(11, Chapter(0)) == ()
    assert found.spans_from(0) == [(0, 13)]


@pytest.mark.parametrize("seed", range(20))
def test_in_any_order_chapters_stand_for_the_same(seed: int) -> None:
    chapters = {
        10: Chapter(0), 11: Chapter(2, ((0, 10),)), 22: Chapter(1, ((12, 22),)), 23: Chapter(0),
        24: Chapter(2, ((0, 12),)), 40: Chapter(1, ((0, 23), (24, 30))),
    }  # fmt: skip
    order = list(chapters)
    random.Random(seed).shuffle(order)
    found = ReplacedEntries()
    for seq in order:
        found.take(seq, chapters[seq])
    assert found.spans_from(0) == [(0, 23), (24, 30)]


def test_what_lies_before_is_forgotten() -> None:
    found = ReplacedEntries()
    found.take(12, Chapter(1, ((0, 4), (6, 9))))
    found.forget_before(7)
    assert found.spans_from(0) == [(7, 9)]


def test_spans_that_touch_or_overlap_are_one() -> None:
    assert merged_spans([(5, 7), (0, 2), (2, 4), (6, 9), (11, 12)]) == [(0, 4), (5, 9), (11, 12)]
