"""The robot's clock is one that nobody can set; the wall clock only numbers starts."""

from __future__ import annotations

import time

import pytest

from drslamd.io.clock import MonotonicClock, cpu_s, uptime_s, wall_s


@pytest.mark.row("T1")
def test_the_clock_is_that_of_the_kernel_to_the_microsecond() -> None:
    before = time.clock_gettime_ns(time.CLOCK_BOOTTIME) // 1_000
    now = MonotonicClock().now()
    after = time.clock_gettime_ns(time.CLOCK_BOOTTIME) // 1_000
    assert before <= now <= after
    assert isinstance(now, int)


def test_two_clocks_of_one_host_agree_and_grow() -> None:
    clocks = [MonotonicClock(), MonotonicClock()]
    read = [clocks[k % 2].now() for k in range(1_000)]
    assert read == sorted(read)
    time.sleep(0.01)
    assert clocks[0].now() - read[-1] >= 10_000


@pytest.mark.row("T1")
def test_setting_the_wall_clock_moves_the_clock_by_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = MonotonicClock()
    before = clock.now()
    for name, value in (("time", 4e9), ("time_ns", 4 * 10**18)):
        monkeypatch.setattr(time, name, lambda value=value: value)
    assert 0 <= clock.now() - before < 60_000_000


@pytest.mark.row("T2")
def test_the_clock_goes_on_while_the_computer_sleeps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Then the clock that others call monotonic stands."""
    stands, goes_on = time.monotonic_ns(), time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    monkeypatch.setattr(time, "monotonic_ns", lambda: stands)
    monkeypatch.setattr(time, "clock_gettime_ns", lambda which: goes_on + 60 * 10**9)
    assert MonotonicClock().now() == goes_on // 1_000 + 60_000_000


@pytest.mark.parametrize(
    ("ns", "seconds"), [(1_764_000_000_999_999_999, 1_764_000_000), (0, 0), (-1, -1)]
)
@pytest.mark.row("T5")
def test_the_wall_clock_is_read_in_whole_seconds(
    ns: int, seconds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(time, "time_ns", lambda: ns)
    assert wall_s() == seconds


def test_the_time_since_the_computer_began_is_that_of_the_kernel() -> None:
    with open("/proc/uptime") as file:
        seconds = float(file.read().split()[0])
    assert abs(uptime_s() - seconds) < 5


def test_the_time_of_the_processor_grows_with_work_and_not_with_waiting() -> None:
    before = cpu_s()
    time.sleep(0.05)
    waited = cpu_s()
    end = time.process_time() + 0.02
    while time.process_time() < end:
        pass
    assert waited - before < 0.04
    assert cpu_s() - waited >= 0.02
