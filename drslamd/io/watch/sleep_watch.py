"""Was the computer asleep? One clock of the kernel stands meanwhile, and another goes on."""

from __future__ import annotations

import time

from drslamd.conventions import MILLISECOND_US, SECOND_US

LEAST_US = 100 * MILLISECOND_US
"""A sample of the odometry; no computer falls asleep and wakes in less."""


class SleepWatch:
    """Compares the two clocks; ask before anything is done with what came in.

    Who was asked a moment ago did not sleep since, which one clock tells: both are compared after
    longer, and once a second, to know of the shortest time between two readings.
    """

    def __init__(self) -> None:
        _, self._most = _asleep_us()
        self._asked = self._compared = _boot_us()

    def slept_us(self) -> int:
        """How long the computer slept since this was last asked, us; mostly 0."""
        now, last = _boot_us(), self._asked
        self._asked = now
        if now - last < LEAST_US and now - self._compared < SECOND_US:
            return 0
        self._compared = now
        least, most = _asleep_us()
        slept = least - self._most
        if slept < LEAST_US:
            # somebody who is held up between two readings has not slept
            self._most = min(most, self._most)
            return 0
        self._most = most
        return slept


def _boot_us() -> int:
    """Since the computer began, sleep and all."""
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME) // 1_000


def _asleep_us() -> tuple[int, int]:
    """How long the computer was asleep since it began: at least, and at most."""
    before = time.monotonic_ns()
    since_boot = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    after = time.monotonic_ns()
    return (since_boot - after) // 1_000, (since_boot - before) // 1_000
