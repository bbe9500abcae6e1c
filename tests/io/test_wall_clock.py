"""The host's wall clock against ours, and what the kernel says of it."""

from __future__ import annotations

import ctypes
import time

import pytest

from drslamd.io import wall_clock
from drslamd.io.clock import MonotonicClock
from drslamd.io.wall_clock import kernel_uncertainty_us, read_wall_clock


class Ahead:
    """The monotonic clock, hours ahead."""

    def now(self) -> int:
        return MonotonicClock().now() + 7_200_000_000


def test_what_is_added_to_a_clock_gives_utc() -> None:
    for clock in (MonotonicClock(), Ahead()):
        found = read_wall_clock(clock)
        off = clock.now() + found.utc_minus_clock_us - time.time_ns() // 1_000
        assert abs(off) < 5_000


class Interrupted:
    """A clock whose first readings lie far apart."""

    def __init__(self) -> None:
        self.reads = 0

    def now(self) -> int:
        self.reads += 1
        return MonotonicClock().now() + (500_000 if self.reads == 2 else 0)


def test_a_reading_during_which_the_process_was_interrupted_is_taken_again() -> None:
    clock = Interrupted()
    found = read_wall_clock(clock)
    assert clock.reads == 4
    assert abs(MonotonicClock().now() + found.utc_minus_clock_us - time.time_ns() // 1_000) < 5_000


@pytest.mark.parametrize(
    ("returned", "status", "said"),
    [
        (0, 0x0001, 1_234),
        (0, 0x2001, 1_234),
        (5, 0x0040, None),
        (0, 0x0041, None),
        (-1, 0x0001, None),
    ],
)
def test_a_clock_that_nobody_sets_has_no_uncertainty_that_could_be_said(
    returned: int, status: int, said: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Kernel:
        @staticmethod
        def adjtimex(timex: object) -> int:
            timex._obj.maxerror = 1_234  # type: ignore[attr-defined]
            timex._obj.status = status  # type: ignore[attr-defined]
            return returned

    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: Kernel)
    assert kernel_uncertainty_us() == said


def test_without_such_a_call_nothing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: object())
    assert kernel_uncertainty_us() is None


def test_the_layout_is_that_of_the_kernel() -> None:
    """Offsets of linux/timex.h: five longs after a padded unsigned int, then the status."""
    long = ctypes.sizeof(ctypes.c_long)
    assert wall_clock._Timex.maxerror.offset == 3 * long
    assert wall_clock._Timex.status.offset == 5 * long
