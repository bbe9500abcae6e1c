"""The robot's own clock."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Microseconds that only ever grow."""

    def now(self) -> int: ...


class MonotonicClock:
    """The kernel's clock since it began, which no one can set and which goes on in its sleep."""

    def now(self) -> int:
        return time.clock_gettime_ns(time.CLOCK_BOOTTIME) // 1_000


def wall_s() -> int:
    """The wall clock, s since 1970; anybody may set it, and it may never have been set."""
    return time.time_ns() // 1_000_000_000


def uptime_s() -> int:
    """Since the computer began, sleep and all."""
    return int(time.clock_gettime(time.CLOCK_BOOTTIME))


def cpu_s() -> float:
    """What this process has taken of the processor, s."""
    return time.process_time()
