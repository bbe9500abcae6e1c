"""One robot's log as another holds it: what is held, what lacks, what is given up."""

from __future__ import annotations

import random

import pytest

from drslamd.gossip import replicated_log
from drslamd.gossip.replicated_log import AHEAD, ReplicatedLog
from drslamd.slam.graph.measurements import Chapter

LAST = 2**31 - 1


def holding(*seqs: int) -> ReplicatedLog:
    log = ReplicatedLog(epoch=1)
    for seq in seqs:
        log.put(seq, b"%d" % seq)
    return log


def numbers(log: ReplicatedLog) -> tuple[int, int, int, int]:
    return log.first, log.complete, log.end, log.newest


def test_an_empty_log_lacks_its_first_entry() -> None:
    assert numbers(holding()) == (0, 0, 0, 0)


def test_a_log_is_complete_up_to_its_first_hole() -> None:
    assert numbers(holding(0, 1, 3)) == (0, 2, 4, 4)
    assert numbers(holding(3, 1, 0, 2)) == (0, 4, 4, 4)


def test_what_was_heard_of_stays_known_when_less_is_held() -> None:
    log = holding(0)
    log.newest = 9
    log.put(1, b"1")
    assert numbers(log) == (0, 2, 2, 9)


def test_what_the_owner_no_longer_holds_is_not_waited_for() -> None:
    log = holding(0, 5, 6, 8)
    assert (log.complete, log.lacking) == (1, 5)
    log.on_owner(first=5, newest=9)
    assert (log.start, log.complete, log.lacking) == (5, 7, 1)
    assert sorted(log.sealed) == [0, 5, 6, 8]


def test_what_the_owner_says_of_a_log_replaces_what_it_said_before() -> None:
    log = holding(0, 1, 3)
    log.on_owner(first=LAST, newest=LAST)
    assert (log.complete, log.newest, log.lacking) == (LAST, LAST, 0)
    log.on_owner(first=0, newest=4)
    assert numbers(log) == (0, 2, 4, 4)
    assert log.lacking == 1


def test_less_than_what_is_held_is_not_believed_of_its_end() -> None:
    log = holding(0, 1, 2)
    log.on_owner(first=0, newest=1)
    assert numbers(log) == (0, 3, 3, 3)


def test_an_owner_that_forgot_only_what_is_held_here_changes_nothing() -> None:
    log = holding(0, 1, 2)
    for first in (0, 2, 3):
        log.on_owner(first, newest=3)
        assert (log.start, *numbers(log)) == (0, 0, 3, 3, 3)


@pytest.mark.parametrize("newest", [1, 3, 2 + AHEAD])
def test_what_somebody_else_has_heard_of_counts(newest: int) -> None:
    log = holding(0, 1)
    log.on_hearsay(newest)
    assert log.newest == max(2, newest)


def test_what_somebody_else_has_heard_of_counts_only_so_far_ahead() -> None:
    log = holding(0, 1)
    log.on_hearsay(LAST)
    assert log.newest == 2 + AHEAD
    log.on_owner(0, newest=4)
    assert (log.newest, log.lacking) == (4, 2)


@pytest.mark.row("O7")
def test_when_an_entry_was_on_the_air_is_forgotten_with_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(replicated_log, "MAX_ENTRIES", 2)
    log = holding(0, 1)
    log.aired = {0: 10, 1: 11}
    log.put(2, b"2")
    assert log.aired == {1: 11}


def test_an_entry_far_ahead_gives_up_all_before_it_without_counting_to_it() -> None:
    log = holding(0, 1, LAST)
    first = LAST + 1 - replicated_log.MAX_ENTRIES
    assert numbers(log) == (first, first, LAST + 1, LAST + 1)
    assert sorted(log.sealed) == [LAST]


@pytest.mark.parametrize(("last", "first"), [(9, 0), (10, 1), (25, 16)])
def test_only_so_many_of_the_newest_are_held(
    last: int, first: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replicated_log, "MAX_ENTRIES", 10)
    log = holding(*range(last + 1))
    assert sorted(log.sealed) == list(range(first, last + 1))
    assert numbers(log) == (first, last + 1, last + 1, last + 1)


def test_every_order_of_arrival_gives_the_same_log(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replicated_log, "MAX_ENTRIES", 10)
    for seed in range(50):
        order = [*range(6), *range(8, 20)]
        random.Random(seed).shuffle(order)
        log = ReplicatedLog(epoch=1)
        for seq in order:
            if seq >= log.first:
                log.put(seq, b"%d" % seq)
        assert numbers(log) == (10, 20, 20, 20), f"seed {seed}"
        assert log.sealed == {seq: b"%d" % seq for seq in range(10, 20)}


# chapters


def with_chapter(*missing: int) -> ReplicatedLog:
    """Entries 0 to 9, said again by a chapter in parts 10, 11 and 12."""
    log = ReplicatedLog(1)
    for seq in range(10):
        log.put(seq, b"entry")
    for seq, chapter in ((10, Chapter(0)), (11, Chapter(0)), (12, Chapter(3, ((0, 10),)))):
        if seq not in missing:
            log.put(seq, b"chapter", chapter)
    return log


def test_entries_for_which_a_chapter_stands_are_kept_no_longer_nor_waited_for() -> None:
    log = with_chapter()
    assert sorted(log.sealed) == [10, 11, 12]
    assert (log.complete, log.newest, log.lacking) == (13, 13, 0)
    assert log.is_known(4)
    assert not log.is_held(4)
    assert log.held_from(0) == [10, 11, 12]
    assert log.held_from(12) == [12]
    assert log.held_from(13) == []


def test_entries_are_kept_until_all_parts_of_the_chapter_are_here() -> None:
    log = with_chapter(11)
    assert sorted(log.sealed) == [*range(11), 12]
    assert (log.complete, log.lacking) == (11, 1)
    log.put(11, b"chapter", Chapter(0))
    assert sorted(log.sealed) == [10, 11, 12]
    assert log.complete == 13


def test_who_knows_only_the_chapter_lacks_nothing_for_which_it_stands() -> None:
    log = ReplicatedLog(1)
    for seq, chapter in ((12, Chapter(3, ((0, 10),))), (10, Chapter(0))):
        log.put(seq, b"chapter", chapter)
        assert log.complete == 0
    log.put(11, b"chapter", Chapter(0))
    assert (log.complete, log.lacking) == (13, 0)


def test_a_chapter_of_chapters_stands_for_these_too_and_not_for_what_lies_between() -> None:
    log = with_chapter()
    for seq in range(13, 20):
        log.put(seq, b"entry")
    log.put(20, b"chapter", Chapter(1, ((0, 13), (15, 17))))
    assert sorted(log.sealed) == [13, 14, 17, 18, 19, 20]
    assert (log.complete, log.lacking) == (21, 0)
    newcomer = ReplicatedLog(1)
    newcomer.put(20, b"chapter", Chapter(1, ((0, 13), (15, 17))))
    assert (newcomer.complete, newcomer.lacking) == (13, 5)
    assert newcomer.stretches() == [(15, 17), (20, 21)]


def test_parts_come_in_the_place_of_what_they_stand_for() -> None:
    log = holding(*range(5, 12), 30)
    log.put(28, b"part", Chapter(0))
    log.put(29, b"last", Chapter(2, ((0, 5), (7, 8))))
    assert log.held_from(0) == [28, 29, 5, 6, 8, 9, 10, 11, 30]
    assert [seq for seq in log.sealed if log.is_of_chapter(seq)] == [28, 29]


def test_what_is_forgotten_takes_its_chapters_along(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replicated_log, "MAX_ENTRIES", 20)
    log = with_chapter()
    for seq in range(13, 40):
        log.put(seq, b"entry")
    assert (log.first, log.complete, log.lacking) == (20, 40, 0)
    assert not log.is_known(12)
