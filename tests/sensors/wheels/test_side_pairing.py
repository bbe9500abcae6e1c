"""Two sides that report one after the other, brought to a common time."""

from __future__ import annotations

import pytest

from drslamd.sensors.wheels.side_pairing import (
    MAX_APART_US,
    Pair,
    Side,
    SidePairing,
    linear,
    wrapping,
)


def paired(*values: tuple[Side, int, float]) -> tuple[list[Pair], int]:
    pairing = SidePairing(linear)
    pairs = [pairing.add(side, utime, value) for side, utime, value in values]
    return [pair for pair in pairs if pair is not None], pairing.unpaired


FIRST, SECOND = Side.FIRST, Side.SECOND


def test_the_second_side_is_interpolated_to_the_time_of_the_first() -> None:
    pairs, unpaired = paired((SECOND, 0, 1.0), (FIRST, 2_500, 7.0), (SECOND, 10_000, 2.0))
    assert (pairs, unpaired) == ([Pair(2_500, 7.0, 1.25)], 0)


def test_equal_times_need_no_interpolation() -> None:
    assert paired((FIRST, 5, 7.0), (SECOND, 5, 1.0)) == ([Pair(5, 7.0, 1.0)], 0)


def test_each_value_of_the_first_side_is_used_once() -> None:
    values = [(SECOND, 0, 0.0)]
    for k in range(1, 20):
        values += [(FIRST, k * 10_000 - 3_000, k), (SECOND, k * 10_000, k)]
    pairs, unpaired = paired(*values)
    assert [pair.utime for pair in pairs] == [k * 10_000 - 3_000 for k in range(1, 20)]
    assert unpaired == 0


@pytest.mark.parametrize(("apart", "found"), [(MAX_APART_US, 1), (MAX_APART_US + 1, 0)])
def test_values_too_far_apart_are_no_pair(apart: int, found: int) -> None:
    pairs, unpaired = paired((SECOND, 0, 1.0), (FIRST, 1, 7.0), (SECOND, apart, 2.0))
    assert (len(pairs), unpaired) == (found, 1 - found)


def test_without_an_earlier_value_there_is_nothing_to_interpolate() -> None:
    assert paired((FIRST, 0, 7.0), (SECOND, 1, 2.0)) == ([], 1)


@pytest.mark.parametrize("utime", [9_999, 20_001])
def test_nothing_is_extrapolated(utime: int) -> None:
    for last in (10_000, 20_000):
        values = [(SECOND, 10_000, 0.0), (FIRST, utime, 7.0), (SECOND, last, 1.0)]
        assert paired(*values) == ([], 1)


def test_a_value_of_the_first_side_that_is_overtaken_counts_as_unpaired() -> None:
    pairs, unpaired = paired((SECOND, 0, 0.0), (FIRST, 1, 5.0), (FIRST, 2, 6.0), (SECOND, 4, 4.0))
    assert (pairs, unpaired) == ([Pair(2, 6.0, 2.0)], 1)


@pytest.mark.parametrize(
    ("period_ms", "apart_ms"), [(50, 11), (100, 50), (20, 1), (200, 199), (7, 3), (500, 250)]
)
def test_sides_that_speak_in_turn_make_a_pair_each_period(period_ms: int, apart_ms: int) -> None:
    values: list[tuple[Side, int, float]] = []
    for k in range(20):
        values.append((FIRST, k * period_ms * 1000, k * period_ms))
        values.append((SECOND, (k * period_ms + apart_ms) * 1000, k * period_ms + apart_ms))
    pairs, unpaired = paired(*values)
    assert (len(pairs), unpaired) == (19, 1)
    assert all(pair.second == pytest.approx(pair.first) for pair in pairs)


def test_sides_of_different_rates_make_pairs_at_the_lower_one() -> None:
    values = [(FIRST, k * 10_000, k * 10.0) for k in range(100)]
    values += [(SECOND, k * 130_000 + 3_000, k * 130.0 + 3) for k in range(7)]
    pairs, _ = paired(*sorted(values, key=lambda value: value[1]))
    assert len(pairs) == 6
    assert all(pair.second == pytest.approx(pair.first) for pair in pairs)


@pytest.mark.row("D10")
def test_counters_are_interpolated_over_their_wrap() -> None:
    between = wrapping(lambda: 1 << 16)
    assert between(65_530, 10, 0.5) == 2
    assert between(10, 65_530, 0.75) == 65_534
    assert wrapping(lambda: 1000)(990, 10, 0.5) == 0
    assert wrapping(lambda: 1 << 64)((1 << 63) + 1, (1 << 63) + 3, 0.5) == (1 << 63) + 2
