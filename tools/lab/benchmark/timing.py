"""Time on one core, of several programs in turns.

What is timed is the CPU time of this process, pinned to one core: what other processes do to the
clock does not count, and a peer's threads cannot hide. In turns, so that whatever slows the machine
down slows all of them down.
"""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Times:
    """Of one program, ms."""

    median: float
    p99: float
    count: int


def pin() -> None:
    """Stay on one core from here on, where the system allows it."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def in_turns(
    programs: Mapping[str, Callable[[], object]], rounds: int, most_s: float
) -> dict[str, Times]:
    """Run every program once a round, after one round that is not counted.

    Args:
        rounds: at most; fewer when `most_s` is over.
        most_s: seconds of CPU for all of them, after the first counted round.
    """
    for program in programs.values():
        program()
    taken: dict[str, list[float]] = {name: [] for name in programs}
    began = now_ms()
    for _ in range(rounds):
        for name, program in programs.items():
            started = now_ms()
            program()
            taken[name].append(now_ms() - started)
        if now_ms() - began > most_s * 1e3:
            break
    return {name: times(values) for name, values in taken.items()}


def peak_mb() -> float:
    """Memory that this process had resident at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def now_ms() -> float:
    """CPU that this process has used."""
    return time.process_time() * 1e3


def times(values: list[float]) -> Times:
    """Of values in ms."""
    median, p99 = np.quantile(values, [0.5, 0.99])
    return Times(float(median), float(p99), len(values))
