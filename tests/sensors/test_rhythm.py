"""How long a base may be silent: ten of its periods, half a second at least, a second at most."""

from __future__ import annotations

import pytest

from drslamd.conventions import SECOND_US
from drslamd.sensors.rhythm import Rhythm


def after(period_us: int, count: int = 1, times: int = 200) -> Rhythm:
    """A base that said `count` motions at once every so often."""
    rhythm = Rhythm()
    for k in range(times):
        rhythm.add(count, 5 * SECOND_US + k * period_us)
    return rhythm


@pytest.mark.row("D9")
@pytest.mark.parametrize(
    ("hz", "valid_s"), [(50, 0.5), (20, 0.5), (16, 0.625), (12.5, 0.8), (10, 1.0), (4, 1.0)]
)
def test_ten_periods_of_silence_are_one(hz: float, valid_s: float) -> None:
    assert after(round(SECOND_US / hz)).valid_us == pytest.approx(valid_s * SECOND_US, rel=1e-3)


def test_before_it_is_known_a_second_is_given() -> None:
    assert Rhythm().valid_us == SECOND_US
    assert after(50_000, times=3).valid_us > 0.8 * SECOND_US


@pytest.mark.parametrize(("pause_us", "valid_us"), [(200_000, 500_000), (400_000, 800_000)])
def test_bytes_that_come_in_bursts_are_given_two_pauses(pause_us: int, valid_us: int) -> None:
    """At 50 motions a second."""
    rhythm = after(pause_us, count=pause_us // 20_000)
    assert rhythm.valid_us == valid_us


def test_one_long_pause_is_forgotten_after_some_ten_seconds() -> None:
    rhythm = after(50_000)
    at = 5 * SECOND_US + 199 * 50_000 + 2 * SECOND_US
    rhythm.add(1, at)
    assert rhythm.valid_us == SECOND_US
    for k in range(1, 10):
        rhythm.add(1, at + k * 50_000)
    assert rhythm.valid_us == SECOND_US
    for k in range(10, 400):
        rhythm.add(1, at + k * 50_000)
    assert rhythm.valid_us == 500_000


def test_a_clock_that_goes_back_is_no_pause() -> None:
    rhythm = after(50_000)
    rhythm.add(1, 0)
    assert rhythm.valid_us == 500_000
