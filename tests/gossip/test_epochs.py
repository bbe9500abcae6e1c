"""Which epochs are believed, and how the next one is chosen."""

from __future__ import annotations

import random

import pytest

from drslamd.gossip.epochs import highest_believed, is_kept_epoch, kept_epochs, next_epoch

YEAR_2255 = 2**53
STEP = 2**32
LAST_KEPT = 2**53 + 2**44
NOW_S = 1_764_000_000


def test_a_start_is_a_second_of_the_wall_clock_and_a_random_part() -> None:
    assert next_epoch(0, NOW_S, 0) == 1_764_000_000_000_000
    assert next_epoch(0, NOW_S, 999_999) == 1_764_000_000_999_999


@pytest.mark.row("T1")
@pytest.mark.parametrize("wall_s", [NOW_S, NOW_S - 1, 0, -5, 2**40])
def test_an_epoch_is_above_the_last_even_when_the_wall_clock_went_wrong(wall_s: int) -> None:
    last = 1_764_000_000_999_999
    assert last < next_epoch(last, wall_s, 0) <= last + 1_000_000
    assert next_epoch(last, wall_s, 7) == 1_764_000_001_000_007


def test_starts_of_an_older_version_counted_milliseconds_and_lie_before() -> None:
    assert next_epoch(1_764_000_000_123, NOW_S, 5) == 1_764_000_000_000_005


def test_starts_a_second_apart_are_in_order_whatever_is_drawn() -> None:
    draw = random.Random(1)
    epochs = [next_epoch(0, NOW_S + k, draw.randrange(10**6)) for k in range(1_000)]
    assert epochs == sorted(set(epochs))


def test_starts_of_one_and_the_same_second_are_told_apart_by_chance() -> None:
    draw = random.Random(2)
    assert len({next_epoch(0, 0, draw.randrange(10**6)) for _ in range(100)}) == 100


@pytest.mark.row("T5")
@pytest.mark.parametrize(
    ("wall_s", "is_set"), [(YEAR_2255 // 10**6 - 1, True), (YEAR_2255 // 10**6, False)]
)
def test_a_clock_beyond_the_year_2255_was_never_set(wall_s: int, is_set: bool) -> None:
    assert (next_epoch(5, wall_s, 0) == wall_s * 10**6) == is_set
    assert is_set or next_epoch(5, wall_s, 0) == 1_000_000


@pytest.mark.parametrize("above", [LAST_KEPT - 2_000_000, LAST_KEPT - 1, LAST_KEPT])
def test_whatever_was_kept_the_next_epoch_can_be_kept_too(above: int) -> None:
    for draw_us in (0, 999_999):
        assert is_kept_epoch(next_epoch(above, NOW_S, draw_us))


def test_epochs_counted_up_from_any_kept_one_never_leave_what_can_be_kept() -> None:
    draw = random.Random(3)
    for above in (0, 10**15, YEAR_2255 - 1, YEAR_2255, LAST_KEPT - 10**8):
        epoch = above
        for _ in range(200):
            epoch = next_epoch(epoch, draw.choice([0, NOW_S, 2**62]), draw.randrange(10**6))
            assert is_kept_epoch(epoch)


@pytest.mark.parametrize(
    ("latest", "highest"),
    [
        (0, YEAR_2255 + STEP),
        (YEAR_2255, YEAR_2255 + STEP),
        (YEAR_2255 + 1, YEAR_2255 + 1 + STEP),
        (2**62 - STEP, 2**62),
        (2**62, 2**62),
    ],
)
def test_above_all_clocks_an_epoch_is_believed_in_steps(latest: int, highest: int) -> None:
    assert highest_believed(latest) == highest


@pytest.mark.parametrize(
    ("value", "kept"),
    [
        (0, True),
        (LAST_KEPT, True),
        (LAST_KEPT + 1, False),
        (-1, False),
        (2**63 - 1, False),
        (10**400, False),
        (True, False),
        (1.0, False),
        ("1", False),
        (None, False),
    ],
)
def test_what_a_state_file_may_hold(value: object, kept: bool) -> None:
    assert is_kept_epoch(value) == kept


def test_epochs_that_a_file_may_not_hold_are_left_out() -> None:
    assert kept_epochs({1: 5, 2: LAST_KEPT + 1, 3: LAST_KEPT}) == {1: 5, 3: LAST_KEPT}
