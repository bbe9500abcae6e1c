"""Which counters of one start were seen: both edges of what is remembered, and leaps ahead."""

from __future__ import annotations

import random

import pytest

from drslamd.gossip.replay_window import FIRST_COUNTER, FOLLOWS, MAX_LEAPS, WINDOW, ReplayWindow

LAST_COUNTER = 2**31 - 1


def taken(window: ReplayWindow, *counters: int) -> list[bool]:
    """Which of them were new, one after the other."""
    answers = []
    for counter in counters:
        answers.append(window.is_new(counter))
        if answers[-1]:
            window.commit(counter)
    return answers


def seen(*counters: int) -> ReplayWindow:
    window = ReplayWindow()
    for counter in counters:
        window.commit(counter)
    return window


def ending_at(newest: int) -> ReplayWindow:
    """As many as it takes to bring a window there."""
    return seen(*range(newest - FOLLOWS + 1, newest + 1))


def test_a_counter_is_new_until_it_was_seen() -> None:
    window = seen(7)
    assert not window.is_new(7)
    assert window.is_new(6)
    assert window.is_new(8)


@pytest.mark.parametrize(("back", "is_new"), [(WINDOW, True), (WINDOW + 1, False)])
def test_what_is_older_than_the_window_is_taken_as_seen(back: int, is_new: bool) -> None:
    assert ending_at(5_000).is_new(5_000 - back) is is_new


def test_a_window_that_moves_by_its_whole_length_leaves_behind_what_it_never_saw() -> None:
    window = seen(5, 5 + WINDOW)
    assert not window.is_new(5)
    assert window.is_new(6)
    window.commit(5 + WINDOW + 1)
    assert not window.is_new(5)
    assert window.is_new(6)
    window.commit(5 + WINDOW + 2)
    assert not window.is_new(6)
    assert window.is_new(7)


@pytest.mark.parametrize(("counter", "is_new"), [(FIRST_COUNTER, True), (0, False), (-1, False)])
def test_no_message_has_a_counter_below_the_first(counter: int, is_new: bool) -> None:
    assert ReplayWindow().is_new(counter) is is_new
    assert seen(3).is_new(counter) is is_new


def test_a_counter_that_comes_late_does_not_move_the_window() -> None:
    window = ending_at(2_000)
    window.commit(1_990)
    assert not window.is_new(1_990)
    assert not window.is_new(2_000)
    assert window.is_new(2_000 - WINDOW + 1)


@pytest.mark.parametrize("leap", [WINDOW, WINDOW + 1, 5_000, LAST_COUNTER - 3])
def test_one_message_that_leaps_ahead_silences_none_of_those_that_follow(leap: int) -> None:
    window, ahead = seen(1, 2, 3), 3 + leap
    window.commit(ahead)
    follow = [counter for counter in range(4, 3_000) if counter != ahead]
    if leap == WINDOW:
        follow = follow[: WINDOW - 1]
    assert all(taken(window, *follow))
    assert not window.is_new(ahead)


@pytest.mark.parametrize("ahead", [FOLLOWS - 1, FOLLOWS])
def test_some_messages_from_far_ahead_take_the_window_there(ahead: int) -> None:
    """A robot that was out of range for hours is heard at once, and then as ever."""
    leapt = range(50_000, 50_000 + ahead)
    window = seen(1, 2, *leapt)
    assert not any(map(window.is_new, leapt))
    assert window.is_new(3) is (ahead < FOLLOWS)


def test_messages_far_ahead_that_are_not_together_take_the_window_nowhere() -> None:
    leaps = [5_000 * k for k in range(1, MAX_LEAPS + 1)]
    window = seen(1, *leaps)
    assert taken(window, 2, *leaps, 3) == [True] + [False] * MAX_LEAPS + [True]


@pytest.mark.row("S3")
def test_one_leap_more_than_are_remembered_moves_the_window_to_the_first_of_them() -> None:
    leaps = [5_000 * k for k in range(1, MAX_LEAPS + 2)]
    window = seen(1, *leaps)
    assert taken(window, 2, *leaps, 5_001) == [False] * (2 + MAX_LEAPS) + [True]


def test_a_window_takes_no_more_memory_however_far_it_leaps() -> None:
    window = seen(1, *range(10**6, 10**9, 10**7), 10**6 + 5, LAST_COUNTER)
    assert window._seen.bit_length() <= WINDOW + 1
    assert len(window._ahead) <= MAX_LEAPS


@pytest.mark.row("S3")
def test_the_window_takes_nothing_twice_wherever_counters_leap() -> None:
    draw, window = random.Random(6), ReplayWindow()
    taken: set[int] = set()
    at = 1
    for _ in range(20_000):
        at = max(1, at + draw.choice([1, 1, 2, -1, -3, -500, 501, -1024, 1025, 3000, -2900]))
        if window.is_new(at):
            assert at not in taken
            window.commit(at)
            taken.add(at)
        assert not window.is_new(at)
        assert len(window._ahead) <= MAX_LEAPS
    assert len(taken) > 500


def test_the_window_agrees_with_a_set_of_all_that_was_seen_while_no_counter_leaps() -> None:
    draw, window = random.Random(7), ReplayWindow()
    taken: set[int] = set()
    at = 1
    for _ in range(20_000):
        at = max(1, at + draw.choice([1, 1, 2, -1, -3, -500, 501, -1024, 1024, -900]))
        newest = max(taken, default=0)
        at = min(at, newest + WINDOW)
        expected = at not in taken and at >= newest - WINDOW
        assert window.is_new(at) == expected
        if expected:
            window.commit(at)
            taken.add(at)


def test_asking_the_window_changes_nothing() -> None:
    window = ReplayWindow()
    assert [window.is_new(5) for _ in range(3)] == [True] * 3
