"""Which counters of one start were seen, at both edges of what is remembered."""

from __future__ import annotations

import random

import pytest

from drslamd.gossip.replay_window import FIRST_COUNTER, WINDOW, ReplayWindow


def seen(*counters: int) -> ReplayWindow:
    window = ReplayWindow()
    for counter in counters:
        window.commit(counter)
    return window


def test_a_counter_is_new_until_it_was_seen() -> None:
    window = seen(7)
    assert not window.is_new(7)
    assert window.is_new(6)
    assert window.is_new(8)


@pytest.mark.parametrize(("back", "is_new"), [(WINDOW - 1, True), (WINDOW, False)])
def test_what_is_older_than_the_window_is_taken_as_seen(back: int, is_new: bool) -> None:
    assert seen(5_000).is_new(5_000 - back) is is_new


@pytest.mark.parametrize(("ahead", "is_new"), [(WINDOW, True), (WINDOW + 1, False)])
def test_a_leap_leaves_behind_what_it_never_saw(ahead: int, is_new: bool) -> None:
    window = seen(5, 5 + ahead)
    assert not window.is_new(5)
    assert window.is_new(6) is is_new


@pytest.mark.parametrize(("counter", "is_new"), [(FIRST_COUNTER, True), (0, False), (-1, False)])
def test_no_message_has_a_counter_below_the_first(counter: int, is_new: bool) -> None:
    assert ReplayWindow().is_new(counter) is is_new
    assert seen(3).is_new(counter) is is_new


def test_a_counter_that_comes_late_does_not_move_the_window() -> None:
    window = seen(2_000, 1_990)
    assert not window.is_new(1_990)
    assert not window.is_new(2_000)
    assert window.is_new(2_000 - WINDOW + 1)


def test_a_window_takes_no_more_memory_however_far_it_leaps() -> None:
    window = seen(1, 10**6, 10**6 + 5, 2**31 - 1)
    assert window._seen.bit_length() <= WINDOW


def test_the_window_agrees_with_a_set_of_all_that_was_seen() -> None:
    draw, window = random.Random(6), ReplayWindow()
    seen: set[int] = set()
    at = 1
    for _ in range(20_000):
        at = max(1, at + draw.choice([1, 1, 2, -1, -3, -500, 501, -1023, 1025, 3000, -2900]))
        newest = max(seen, default=0)
        expected = at not in seen and at > newest - 1024
        assert window.is_new(at) == expected
        if expected:
            window.commit(at)
            seen.add(at)


def test_asking_the_window_changes_nothing() -> None:
    window = ReplayWindow()
    assert [window.is_new(5) for _ in range(3)] == [True] * 3
