"""By how much a robot is surer of its pose, and of another, than what is configured lets it claim.

The noise of a pair's ranges is held at that of the others, and that at what is configured, so much
as a handful of independent ranges would say; likewise the odometry of each robot (`misfit.DOUBT`).
Biases are feared to differ from each other as those of the team were seen to, and to be off alike
as configured; so are scales, since few ranges tell of them. With that noise the same system is
taken apart once more, and each pair gets one factor, by which its covariance is smaller in the mean
of all directions, and each pose in w that of the direction that is smaller by least. It is never
above 1: what is wrong beyond what is configured
is for the covariances of all.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from drslamd.slam.optimizer.banded.band_factor import Solver
from drslamd.slam.optimizer.banded.misfit import squares_of_ranges
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.pairs.expected_squares import expected_squares
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array

ALIKE = 1.7
"""Ranges, one a second, whose squares say as much as one: squares of errors resemble those of their
neighbours by the square of what the errors do (0.64 exp(-t / 2.5 s), see `RangeModel`)."""
PRIOR_RANGES = 5 * ALIKE
"""That say what is configured, which leaves that uncertain by a third."""
LEAST_FEARED = 0.1
"""Of the variance of odometry that is configured: so much is feared however well it fits."""
LEAST_SHARE = 0.2
"""Of a covariance that is left at least."""
MOST_POSES = 12
"""Of which pairs are narrowed: in a larger team each is seen from many sides, and what its ranges
scatter is in the covariances already."""


class SeenNoise(NamedTuple):
    """How wrong sensors are, as far as that was seen.

    Attributes:
        scatter: (pairs,) sigma of ranges over the configured one.
        feared: (robots,) variance of odometry over the configured one.
        own_bias: sigma of what the biases of pairs have of their own, m.
    """

    scatter: Array
    feared: Array
    own_bias: float

    def of_biases(self, problem: Problem) -> Problem:
        """The problem with biases as far as they are feared to differ."""
        priors = problem.priors
        bias = replace(priors.bias, own_sigma=self.own_bias)
        return replace(problem, priors=replace(priors, bias=bias))


def may_narrow(problem: Problem, poses: int) -> bool:
    """Are there pairs, not too many of them, and nobody whose wheels may stand or spin?"""
    return 1 < poses <= MOST_POSES and not problem.freed


def seen_noise(
    equations: Equations,
    point: Point,
    factor: Solver,
    ratio: Array,
    biases: Array,
    made_at: Point | None = None,
) -> SeenNoise | None:
    """None where the matrix gives no solution.

    Args:
        factor: see `expected_squares`.
        ratio: (robots,) s / g of odometry, see `misfit`.
        biases: (pairs,) how wrong they may be, m.
        made_at: the point of the factor, if that is another one.
    """
    expected = expected_squares(equations, made_at or point, factor)
    if expected is None:
        return None
    problem, calibration = equations.problem, point.calibration
    variance = held_variances(squares_of_ranges(problem, point), expected)
    own = calibration.bias - calibration.team_bias[0]
    own_bias = math.sqrt(problem.priors.bias.seen_variance(own, biases**2))
    return SeenNoise(np.sqrt(variance), np.maximum(ratio, LEAST_FEARED), own_bias)


def held_variances(squares: Array, expected: Array) -> Array:
    """(pairs,) variances of ranges over the configured one, and one sigma more of what is uncertain
    of that: nothing is narrowed on the word of a few ranges.

    Args:
        squares: (pairs,) of what is left of ranges, by their weights.
        expected: (pairs,) the same where they are as wrong as configured.
    """
    rest, expected_rest = squares.sum() - squares, expected.sum() - expected
    others = (PRIOR_RANGES + rest) / (PRIOR_RANGES + expected_rest)
    likeliest = (PRIOR_RANGES * others + squares) / (PRIOR_RANGES + expected)
    unsure = np.sqrt(2 * ALIKE / (PRIOR_RANGES + expected.sum()))
    return np.asarray((1 + unsure) * likeliest)


def shares(poses: Array, claimed: Array, seen: Array) -> Array:
    """(k, k) what is left of the covariance of each two of k poses in each other, 1 at most; on the
    diagonal of that of each in w.

    Args:
        poses: (k, 3) w_T_k.
        claimed, seen: (3 k, 3 k) joint covariances as they are claimed, and with the noise that
            was seen.
    """
    count = len(poses)
    out = np.ones((count, count))
    at = np.arange(3 * count).reshape(count, 3)
    alone = at[:, :, None], at[:, None, :]
    np.fill_diagonal(out, _left(claimed[alone], seen[alone], is_of_any=True))
    i, j = np.triu_indices(count, 1)
    across = np.zeros((len(i), 3, 6))
    across[:, :, :3], across[:, :, 3:] = -np.eye(3), np.eye(3)
    across[:, 0, 2], across[:, 1, 2] = (poses[j] - poses[i])[:, 1], -(poses[j] - poses[i])[:, 0]
    both = np.concatenate([at[i], at[j]], axis=1)
    wide, narrow = (
        across @ joint[both[:, :, None], both[:, None, :]] @ np.swapaxes(across, 1, 2)
        for joint in (claimed, seen)
    )
    out[i, j] = out[j, i] = _left(wide, narrow)
    return out


def _left(wide: Array, narrow: Array, is_of_any: bool = False) -> Array:
    """(m,) of covariances (m, 3, 3), in the mean of all directions; all of those that rounding has
    left none.

    Args:
        is_of_any: instead of the direction of which least more is known: how a frame is turned may
            be as unsure as ever where places in it are surer.
    """
    is_sound = np.linalg.eigvalsh(wide)[:, 0] > 0
    left = np.ones(len(wide))
    solved = np.linalg.solve(wide[is_sound], narrow[is_sound])
    if is_of_any:
        left[is_sound] = np.linalg.eigvals(solved).real.max(axis=1, initial=LEAST_SHARE)
    else:
        left[is_sound] = np.einsum("kii->k", solved) / 3
    return np.asarray(np.clip(left, LEAST_SHARE, 1.0))


def narrower(robots: list[int], left: Array) -> dict[tuple[int, ...], float]:
    """What is left of the covariances of poses (a,) in w and of pairs (a, b), a < b, where that is
    not all of it.

    Args:
        left: see `shares`, or of none.
    """
    at = {robot: k for k, robot in enumerate(robots)} if len(left) else {}
    told = [*((a, a) for a in at), *combinations(sorted(at), 2)]
    found = {(a, b) if a != b else (a,): float(left[at[a], at[b]]) for a, b in told}
    return {whose: share for whose, share in found.items() if share < 1.0}
