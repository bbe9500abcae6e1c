"""Counters of fixed width, on both sides of their wrap."""

from __future__ import annotations

import pytest

from drslamd.sensors.wheels.wrapping import wrapped_difference


@pytest.mark.row("D10")
@pytest.mark.parametrize("bits", [16, 32, 64])
def test_a_difference_is_taken_from_the_half_range_around_zero(bits: int) -> None:
    full, half = 2**bits, 2 ** (bits - 1)
    assert wrapped_difference(5, full - 3, bits) == 8
    assert wrapped_difference(full - 3, 5, bits) == -8
    # the largest way forward, the largest way back, and one more, which is the way around
    assert wrapped_difference(half - 1, 0, bits) == half - 1
    assert wrapped_difference(half, 0, bits) == -half
    assert wrapped_difference(half + 1, 0, bits) == -half + 1


def test_signed_and_unsigned_readings_of_one_counter_are_the_same() -> None:
    for new, old in ((-2, 65_530), (65_534, -6), (-2, -6)):
        assert wrapped_difference(new, old, 16) == 4
