"""Limits of CPU time that mean the same on any machine, and in any of its hours.

A machine that shares its processors computes 2.5 times slower in one hour than in another. So each
limit is what the work may take where the figures were taken; a plain loop beside it says how much
more that is here and now.
"""

from __future__ import annotations

import time

STEPS = 1_000_000
STEPS_TOOK_S = 0.083
"""Where the figures were taken, on a quiet machine."""
MOST_TIMES = 5.0
"""A machine that is slower still is none to measure on."""


def allowed_s(seconds: float) -> float:
    """CPU seconds that may pass here for what takes `seconds` where the figures were taken."""
    return seconds * times_slower()


def times_slower() -> float:
    """Than where the figures were taken: 1 to `MOST_TIMES`, by the slowest of three loops."""
    return min(max(1.0, *(_loop_s() / STEPS_TOOK_S for _ in range(3))), MOST_TIMES)


def _loop_s() -> float:
    began, total = time.thread_time(), 0
    for step in range(STEPS):
        total += step * step % 7
    return time.thread_time() - began
