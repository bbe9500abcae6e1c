"""One robot's log as another holds it: what is held, what lacks, what is given up."""

from __future__ import annotations

import random

import pytest

from drslamd.gossip import replicated_log
from drslamd.gossip.replicated_log import ReplicatedLog


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


def test_what_is_given_up_is_no_longer_waited_for() -> None:
    log = holding(0, 5, 6, 8)
    log.forget_before(5)
    assert numbers(log) == (5, 7, 9, 9)
    assert sorted(log.sealed) == [5, 6, 8]


def test_what_was_given_up_stays_given_up() -> None:
    log = holding(0, 1, 2)
    log.forget_before(2)
    for earlier in (2, 1, 0, -5):
        log.forget_before(earlier)
        assert numbers(log) == (2, 3, 3, 3)


def test_giving_up_more_than_is_held_leaves_an_empty_log_that_begins_there() -> None:
    log = holding(0, 1, 2)
    log.forget_before(2**31 - 1)
    assert numbers(log) == (2**31 - 1,) * 4
    assert not log.sealed


def test_when_an_entry_was_on_the_air_is_forgotten_with_it() -> None:
    log = holding(0, 1)
    log.aired = {0: 10, 1: 11}
    log.forget_before(1)
    assert log.aired == {1: 11}


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
