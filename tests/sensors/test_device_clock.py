"""Device time on the clock of the host: delays, drift, wraps and restarts."""

from __future__ import annotations

import random

import pytest
from frames import SECOND_US
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.device_clock import BUCKETS, CONTINUITY_US, WINDOW_US, DeviceClock
from drslamd.sensors.wheels.wrapping import wrapped_difference

MS = 1000


def a_clock(bits: int = 32) -> DeviceClock:
    return DeviceClock(bits, MS)


def started(reading: int = 1000, arrival: int = 50 * SECOND_US, bits: int = 32) -> DeviceClock:
    """A clock that believes the counter after two readings, the last as given."""
    clock = a_clock(bits)
    assert clock.to_host((reading - 20) % (1 << bits), arrival - 20 * MS) is None
    assert clock.to_host(reading % (1 << bits), arrival) == arrival
    return clock


@settings(derandomize=True, max_examples=300)
@given(st.integers(2, 64), st.integers(), st.integers(-(1 << 62), (1 << 62) - 1))
def test_a_difference_within_the_half_range_survives_the_wrap(bits: int, old: int, by: int) -> None:
    by = by % (1 << bits) - (1 << (bits - 1))
    assert wrapped_difference((old + by) % (1 << bits), old, bits) == by


def test_nothing_is_believed_before_the_second_reading() -> None:
    clock = a_clock()
    assert clock.offset_us is None
    assert clock.to_host(1000, 0) is None
    assert clock.offset_us is None
    assert clock.to_host(1020, 20 * MS) == 20 * MS
    assert clock.offset_us == -1000 * MS


def test_when_the_first_reading_was_is_told_with_the_second_and_never_again() -> None:
    clock = a_clock()
    assert clock.to_host(1000, 30 * MS) is None
    assert clock.first_us is None
    assert clock.to_host(1020, 40 * MS) == 40 * MS
    assert clock.first_us == 20 * MS  # 10 ms of its 30 were a delay
    clock.to_host(1040, 60 * MS)
    assert clock.first_us is None


def test_a_reading_before_a_restart_was_believed_is_not_the_first() -> None:
    clock = started()
    far = 50 * SECOND_US
    assert clock.to_host(900_000, far + 20 * MS) is None
    assert clock.to_host(900_020, far + 40 * MS) == far + 40 * MS
    assert (clock.restarts, clock.first_us) == (1, None)


def test_a_delayed_arrival_is_stamped_as_if_it_had_not_been_delayed() -> None:
    clock = started()
    assert clock.to_host(1020, 50 * SECOND_US + 20 * MS + 300 * MS) == 50 * SECOND_US + 20 * MS


def test_the_least_delayed_reading_of_the_window_counts() -> None:
    clock = a_clock()
    clock.to_host(0, 90 * MS)
    assert clock.to_host(100, 100 * MS + 70 * MS) == 170 * MS
    assert clock.to_host(200, 200 * MS + 5 * MS) == 205 * MS
    assert clock.to_host(300, 300 * MS + 60 * MS) == 305 * MS


def test_times_never_run_backwards_when_a_less_delayed_reading_comes() -> None:
    clock = a_clock()
    clock.to_host(0, 500 * MS)
    late = clock.to_host(20, 520 * MS)
    assert late == 520 * MS
    assert clock.to_host(40, 530 * MS) == 530 * MS
    assert clock.to_host(60, 530 * MS) == 530 * MS
    assert clock.to_host(80, 530 * MS) == 530 * MS


@pytest.mark.row("D11")
@pytest.mark.parametrize("ppm", [-200, 0, 200])
def test_drift_stays_within_the_documented_bound(ppm: int) -> None:
    draw = random.Random(7)
    clock, shortest = a_clock(), 1 * MS
    for k in range(3000):
        true = 10 * SECOND_US + k * 20 * MS
        reading = round(k * 20 * (1 + ppm * 1e-6))
        arrival = true + shortest + round(draw.expovariate(1 / (5 * MS)))
        mapped = clock.to_host(reading, arrival)
        if mapped is not None and k > 50:
            error = mapped - true
            assert -200e-6 * WINDOW_US - MS <= error <= shortest + 2 * MS
            assert mapped <= arrival


def test_an_old_offset_leaves_the_window() -> None:
    clock = started(arrival=50 * SECOND_US)
    arrival = 50 * SECOND_US
    for k in range(1, BUCKETS + 2):  # from now on every reading is 100 ms late
        arrival = 50 * SECOND_US + k * 500 * MS + 100 * MS
        mapped = clock.to_host(1000 + k * 500, arrival)
    assert mapped == arrival


@pytest.mark.parametrize(("silence_ms", "known"), [(3900, True), (4100, False)])
def test_an_offset_does_not_outlive_a_silence_of_the_window(silence_ms: int, known: bool) -> None:
    clock = started(reading=100_000)
    due = 50 * SECOND_US + silence_ms * MS
    assert clock.to_host(100_000 + silence_ms, due + 70 * MS) == due + (0 if known else 70 * MS)


@pytest.mark.row("D10")
@pytest.mark.parametrize("bits", [16, 32])
def test_time_goes_on_over_the_wrap(bits: int) -> None:
    clock = started((1 << bits) - 10, 50 * SECOND_US, bits)
    assert clock.to_host(10, 50 * SECOND_US + 20 * MS) == 50 * SECOND_US + 20 * MS
    assert clock.to_host(30, 50 * SECOND_US + 40 * MS) == 50 * SECOND_US + 40 * MS
    assert clock.restarts == 0


@settings(derandomize=True, max_examples=100)
@given(st.integers(0, (1 << 16) - 1), st.lists(st.integers(1, 600_000), max_size=8))
def test_silences_of_many_turns_of_the_counter_are_counted(start: int, steps: list[int]) -> None:
    clock, true_ms = a_clock(16), start
    clock.to_host(start, start * MS)
    for step in steps:
        true_ms += step
        assert clock.to_host(true_ms % (1 << 16), true_ms * MS) == true_ms * MS


@pytest.mark.parametrize(("late", "accepted"), [(CONTINUITY_US, True), (CONTINUITY_US + MS, False)])
def test_a_backlog_is_read_on_up_to_the_tolerance(late: int, accepted: bool) -> None:
    clock = started()
    outcome = clock.to_host(1020, 50 * SECOND_US + 20 * MS + late)
    assert outcome == (50 * SECOND_US + 20 * MS if accepted else None)


@pytest.mark.parametrize(("ahead_ms", "accepted"), [(5000, True), (5001, False)])
def test_a_reading_ahead_of_the_host_is_taken_up_to_the_tolerance(
    ahead_ms: int, accepted: bool
) -> None:
    clock = started()
    assert (clock.to_host(1020 + ahead_ms, 50 * SECOND_US + 20 * MS) is not None) == accepted


@pytest.mark.parametrize("back", [0, 1, 20, 900])
def test_a_reading_that_stands_still_or_goes_back_is_refused(back: int) -> None:
    clock = started()
    assert clock.to_host(1000 - back, 50 * SECOND_US + 20 * MS) is None


def test_one_damaged_reading_changes_nothing() -> None:
    clock = started()
    before = clock.offset_us
    assert clock.to_host(99_000_000, 50 * SECOND_US + 20 * MS) is None
    assert clock.offset_us == before
    assert clock.to_host(1040, 50 * SECOND_US + 40 * MS) == 50 * SECOND_US + 40 * MS
    assert clock.restarts == 0


def test_damaged_readings_that_do_not_continue_each_other_change_nothing() -> None:
    clock = started()
    for k, reading in enumerate((99_000_000, 5, 77_000_000, 12_345_678)):
        assert clock.to_host(reading, 50 * SECOND_US + k * 20 * MS) is None
    assert clock.to_host(1100, 50 * SECOND_US + 100 * MS) == 50 * SECOND_US + 100 * MS


def test_a_reading_that_comes_twice_is_no_restart() -> None:
    clock = started()
    assert clock.to_host(1000, 50 * SECOND_US + 10 * MS) is None
    assert clock.to_host(1020, 50 * SECOND_US + 20 * MS) == 50 * SECOND_US + 20 * MS
    assert clock.restarts == 0


def test_damaged_readings_with_a_good_one_between_them_change_nothing() -> None:
    clock = started()
    assert clock.to_host(99_000_000, 50 * SECOND_US + 20 * MS) is None
    assert clock.to_host(1040, 50 * SECOND_US + 40 * MS) is not None
    assert clock.to_host(99_000_040, 50 * SECOND_US + 60 * MS) is None
    assert clock.restarts == 0


@pytest.mark.row("D11")
def test_a_restarted_device_costs_one_reading() -> None:
    clock = started(reading=10_000_000)
    assert clock.to_host(3, 52 * SECOND_US) is None
    assert clock.to_host(23, 52 * SECOND_US + 20 * MS) == 52 * SECOND_US + 20 * MS
    assert clock.restarts == 1


@pytest.mark.row("D11")
@pytest.mark.parametrize("jump_s", [-10, 10])
def test_a_jump_of_ten_seconds_is_a_restart(jump_s: int) -> None:
    clock = started(reading=100_000)
    jumped = 100_000 + jump_s * 1000
    assert clock.to_host(jumped + 20, 50 * SECOND_US + 20 * MS) is None
    assert clock.to_host(jumped + 40, 50 * SECOND_US + 40 * MS) == 50 * SECOND_US + 40 * MS
    assert clock.restarts == 1


@settings(derandomize=True, max_examples=200)
@given(
    st.lists(st.tuples(st.integers(0, (1 << 32) - 1), st.integers(0, 10 * SECOND_US)), max_size=30)
)
def test_whatever_comes_times_are_in_order_and_not_in_the_future(
    readings: list[tuple[int, int]],
) -> None:
    clock, arrival, last = a_clock(), 0, 0
    for reading, pause in readings:
        arrival += pause
        mapped = clock.to_host(reading, arrival)
        if mapped is not None:
            assert last <= mapped <= arrival
            last = mapped
