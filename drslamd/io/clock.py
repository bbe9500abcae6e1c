"""The robot's own clock."""

from __future__ import annotations

import time
from typing import Protocol

from drslamd.conventions import MILLISECOND_US


class Clock(Protocol):
    """Microseconds that only ever grow."""

    def now(self) -> int: ...


class MonotonicClock:
    """The kernel's monotonic clock, which no one can set."""

    def now(self) -> int:
        return time.monotonic_ns() // 1_000


def wall_epoch() -> int:
    """A number for this start: milliseconds of the wall clock, if it has ever been set."""
    return time.time_ns() // (1_000 * MILLISECOND_US)
