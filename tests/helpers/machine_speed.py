"""Limits of CPU time on machines that are slower than that of the figures, or are so for an hour.

A machine that shares its processors and caches takes up to 2.5 times as long in one hour as in
another, and no small yardstick follows real work closer than 1.5 times. So the slowest of three
(arithmetic, many small objects, small matrices) says what may be allowed, and a limit of this kind
tells work that takes twice as long, not a tenth more: for that, runs are paired in tools/benchmark.
"""

from __future__ import annotations

import ast
import time
from collections.abc import Callable

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

ROUNDS = 9
MOST_TIMES = 5.0
"""A machine that is slower still is none to measure on."""
BANDED = np.vstack([np.full((11, 1200), 0.02), np.ones(1200)])
BLOCKS = np.tile(2.0 * np.eye(3) + 0.1, (400, 1, 1))
SOURCE = "\n".join(f"value_{k} = [{k}, 'a', other({k}, key={k} + 1)]" for k in range(500))


def _arithmetic() -> None:
    total = 0
    for step in range(100_000):
        total += step * step % 7


def _objects() -> None:
    compile(ast.parse(SOURCE), "yardstick", "exec")


def _matrices() -> None:
    solved = cho_solve_banded((cholesky_banded(BANDED), False), np.ones(1200)).reshape(-1, 3)
    np.linalg.solve(BLOCKS, np.einsum("kij,kj->ki", BLOCKS, solved)[..., None])


YARDSTICKS: dict[Callable[[], None], float] = {
    _arithmetic: 0.0070,
    _objects: 0.027,
    _matrices: 0.00052,
}
"""CPU seconds of each in the best moments of a virtual machine of two cores."""


def allowed_s(seconds: float) -> float:
    """CPU seconds that may have passed here, a moment ago, for what takes `seconds` where the
    figures were taken."""
    return seconds * times_slower()


def times_slower() -> float:
    """Than in those moments: 1 to `MOST_TIMES`, by the slowest yardstick, the median of its
    rounds."""
    slowest = max(_median_s(work) / best for work, best in YARDSTICKS.items())
    return min(max(1.0, slowest), MOST_TIMES)


def _median_s(work: Callable[[], None]) -> float:
    return sorted(_once_s(work) for _ in range(ROUNDS))[ROUNDS // 2]


def _once_s(work: Callable[[], None]) -> float:
    began = time.thread_time()
    work()
    return time.thread_time() - began
