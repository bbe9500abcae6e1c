"""Limits of CPU time that mean the same on any machine, and in any of its hours.

A machine that shares its processors and caches computes 2.5 times slower in one hour than in
another. So each limit is what the work may take where the figures were taken; work of the same kind
beside it (small matrices, and Python between them) says how much more that is here and now. A plain
loop does not: it was as fast as ever in hours when everything else took twice as long.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

ROUNDS = 60
ROUND_TOOK_S = 0.52e-3
"""Where the figures were taken; by the whole suite, which took 2,454 s there and 5,035 s in a night
in which a round took 1.06 ms."""
MOST_TIMES = 5.0
"""A machine that is slower still is none to measure on."""


def allowed_s(seconds: float) -> float:
    """CPU seconds that may have passed here, a moment ago, for what takes `seconds` where the
    figures were taken."""
    return seconds * times_slower()


def times_slower() -> float:
    """Than where the figures were taken: 1 to `MOST_TIMES`, by the median of its rounds."""
    rng = np.random.default_rng(1)
    blocks, band = rng.normal(size=(400, 3, 3)), rng.uniform(-0.05, 0.05, (12, 1200))
    band[-1] = 1.0
    took = sorted(_round_s(blocks, band) for _ in range(ROUNDS))
    return min(max(1.0, took[ROUNDS // 2] / ROUND_TOOK_S), MOST_TIMES)


def _round_s(blocks: NDArray[np.float64], band: NDArray[np.float64]) -> float:
    began = time.thread_time()
    factor = cholesky_banded(band)
    solved = cho_solve_banded((factor, False), np.ones(band.shape[1])).reshape(-1, 3)
    turned = np.einsum("kij,kj->ki", blocks, solved)
    squares = np.linalg.solve(blocks, turned[..., None])[..., 0]
    sums = np.bincount(np.arange(len(squares)) % 7, (squares * turned).sum(axis=1))
    {key: [row.copy() for row in squares[key::20]] for key in range(20)}
    np.cumsum(sums)
    return time.thread_time() - began
