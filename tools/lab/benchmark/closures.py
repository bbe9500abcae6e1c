"""Closures of one pair of robots as module 2 meets them: good ones with noise, and wrong ones."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drslamd.slam import se2
from drslamd.slam.consistency.pcm import Candidate
from drslamd.slam.odometry.noise import OdometryNoise, growth

NOISE = OdometryNoise(1e-3, 1e-3, 0.04, 0.016)
"""Steps of a quarter of a metre with sigmas of 0.02 m and 0.008 rad, as in the team graphs."""
STEP_M = 0.25
SIGMAS = np.array([0.15, 0.15, 0.05])
"""Of a good closure, m and rad, as in the team graphs."""
REACH_M = 15.0


def candidates(count: int, good: float, seed: int, understated: float = 1.0) -> Iterator[Candidate]:
    """One closure a step while both robots wander; wrong ones are anywhere within reach.

    Args:
        good: share of closures that are right.
        understated: by what the sigmas of the closures are larger than they say; then many good
            ones disagree, and the largest clique is hard to find.
    """
    rng = np.random.default_rng(seed)
    truth = [_wander(rng, count) for _ in range(2)]
    odometry = [_drifted(rng, path) for path in truth]
    sums = [growth(path) for path in odometry]
    covariance = np.diag((SIGMAS / understated) ** 2)
    for k in range(count):
        a_T_b = se2.between(truth[0][k], truth[1][k]) + SIGMAS * rng.normal(size=3)
        if rng.random() >= good:
            a_T_b = rng.uniform(-1, 1, 3) * [REACH_M, REACH_M, np.pi]
        yield Candidate(
            k, a_T_b, covariance, odometry[0][k], odometry[1][k], sums[0][k], sums[1][k]
        )


def _wander(rng: np.random.Generator, count: int) -> np.ndarray:
    poses = np.zeros((count, 3))
    poses[0] = rng.uniform(-5, 5, 3)
    turn = 0.0
    for k in range(1, count):
        turn = 0.9 * turn + rng.normal(0, 0.1)
        poses[k] = se2.compose(poses[k - 1], np.array([STEP_M, 0.0, turn]))
    return poses


def _drifted(rng: np.random.Generator, truth: np.ndarray) -> np.ndarray:
    """What the wheels say of a path, from the origin, angles counting on."""
    steps = se2.between(truth[:-1], truth[1:])
    steps[:, 2] = se2.wrap(steps[:, 2])
    steps += rng.normal(size=steps.shape) * [0.02, 0.02, 0.008]
    out = np.zeros_like(truth)
    for k, step in enumerate(steps, start=1):
        out[k] = se2.compose(out[k - 1], step)
    return out
