"""The host's wall clock against the clock that the daemon counts on, and how wrong it may be.

The kernel knows whether anybody sets its clock (NTP, PTP, GPS) and how wrong it can be at most:
`adjtimex` of Linux, which systemd-timesyncd, chrony and ntpd all feed.
"""

from __future__ import annotations

import ctypes
import time
from typing import NamedTuple

from drslamd.io.clock import Clock

STA_UNSYNC = 0x0040
"""Of `status` in linux/timex.h: nobody sets the clock."""
LIKE_NOW_US = 1_000
"""Two readings of one clock that lie farther apart are taken again: the process was interrupted."""
TRIES = 5


class WallClock(NamedTuple):
    """What is to be added to our clock to get UTC, us since 1970.

    Attributes:
        uncertainty_us: at most so wrong; None when nobody sets the host's clock.
    """

    utc_minus_clock_us: int
    uncertainty_us: int | None


class _Timex(ctypes.Structure):
    """`struct timex` of linux/timex.h as far as it is needed, and room for the rest."""

    _fields_ = [
        ("modes", ctypes.c_uint),
        ("offset", ctypes.c_long),
        ("freq", ctypes.c_long),
        ("maxerror", ctypes.c_long),
        ("esterror", ctypes.c_long),
        ("status", ctypes.c_int),
        ("rest", ctypes.c_byte * 256),
    ]


def read_wall_clock(clock: Clock) -> WallClock:
    """Both clocks at one moment."""
    apart = 0
    for _ in range(TRIES):
        before = clock.now()
        wall_us = time.time_ns() // 1_000
        took = clock.now() - before
        apart = wall_us - before - took // 2
        if took < LIKE_NOW_US:
            break
    return WallClock(apart, kernel_uncertainty_us())


def kernel_uncertainty_us() -> int | None:
    """How wrong the host's wall clock is at most; None when nobody sets it, or nobody can say."""
    timex = _Timex()
    try:
        state = ctypes.CDLL(None, use_errno=True).adjtimex(ctypes.byref(timex))
    except (OSError, AttributeError):
        return None
    return None if state < 0 or timex.status & STA_UNSYNC else int(timex.maxerror)
