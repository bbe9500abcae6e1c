"""A sleep shows in one clock of the kernel and not in the other."""

from __future__ import annotations

import time

import pytest

from drslamd.io.watch.sleep_watch import SleepWatch

S = 1_000_000_000
MS = 1_000_000


class Kernel:
    """Its two clocks."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.ran, self.slept = 5 * S, 2 * S
        self.between_readings = 0
        self.monotonic_reads = 0
        monkeypatch.setattr(time, "monotonic_ns", self._monotonic)
        monkeypatch.setattr(time, "clock_gettime_ns", self._clock)

    def _monotonic(self) -> int:
        self.monotonic_reads += 1
        self.ran += self.between_readings
        return self.ran

    def _clock(self, which: int) -> int:
        assert which == time.CLOCK_BOOTTIME
        self.ran += self.between_readings
        return self.ran + self.slept


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> Kernel:
    return Kernel(monkeypatch)


@pytest.mark.row("T2")
@pytest.mark.parametrize("seconds", [1, 60, 8 * 3600])
def test_a_sleep_is_noticed_once_and_in_full(kernel: Kernel, seconds: int) -> None:
    watch = SleepWatch()
    kernel.ran += 3 * S
    assert watch.slept_us() == 0
    kernel.slept += seconds * S
    assert watch.slept_us() == seconds * 1_000_000
    assert watch.slept_us() == 0
    kernel.slept += 2 * S
    assert watch.slept_us() == 2_000_000


@pytest.mark.parametrize(("ms", "noticed"), [(99, 0), (100, 100_000)])
def test_less_than_a_sample_of_the_odometry_is_no_sleep(
    kernel: Kernel, ms: int, noticed: int
) -> None:
    watch = SleepWatch()
    kernel.slept += ms * MS
    assert watch.slept_us() == noticed


def test_who_is_held_up_between_two_readings_did_not_sleep(kernel: Kernel) -> None:
    watch = SleepWatch()
    kernel.between_readings = 3 * S
    assert watch.slept_us() == 0
    kernel.between_readings = 0
    assert watch.slept_us() == 0
    kernel.slept += S
    assert watch.slept_us() == 1_000_000


def test_this_computer_did_not_sleep_during_this_test() -> None:
    watch = SleepWatch()
    assert [watch.slept_us() for _ in range(1_000)] == [0] * 1_000


@pytest.mark.parametrize(("ms", "compared"), [(40, 1), (125, 9)])
def test_who_is_asked_often_compares_both_clocks_once_a_second(
    kernel: Kernel, ms: int, compared: int
) -> None:
    """Over a bit more than a second; reading both takes the other clock before and after."""
    watch = SleepWatch()
    kernel.monotonic_reads = 0
    for _ in range(1125 // ms):
        kernel.ran += ms * MS
        assert watch.slept_us() == 0
    assert kernel.monotonic_reads == 2 * compared
