"""The noise of one window: how wrong the residuals of module 1 may be, all of them together.

Ranges of one pair share a constant bias and a slowly varying part; what odometry got wrong on the
way bends all earlier positions at once. With the covariance of the whole residual vector the pose
is a generalised least-squares problem in three unknowns, its covariance is honest, and a longer
window is never worse than a shorter one, because old measurements lose weight by themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.odometry import OdometryNoise
from drslamd.slam.se2 import Array

SLOW_TIME_S = 2.5
"""Correlation time of the slow range bias (0.7 at 1 s, 0.45 at 2 s in LinkTrack recordings)."""
SLOW_SHARE = 0.8
"""Share of the range sigma that is slow; the rest is white."""

NEAR_BIAS_M, NEAR_REACH_M = 0.20, 1.5
"""Modules misjudge strong signals: over 2 m and more their bias hardly moves, below 1 m it was off
by 0.13 m in LinkTrack recordings (0.07 m at 1.5 m)."""


@dataclass(frozen=True)
class RangeNoise:
    """Sigmas of a range in metres: around its bias, and of the constant bias of the pair."""

    sigma: float
    bias_sigma: float


def near_bias(ranges: Array | float) -> Array:
    """Sigma, m, of what the bias of a pair does at short range and not elsewhere."""
    return np.asarray(NEAR_BIAS_M * np.exp(-np.maximum(ranges, 0.0) / NEAR_REACH_M))


def range_covariance(t: Array, ranges: Array, noise: RangeNoise, weights: Array) -> Array:
    """(n, n): white, slow and constant parts, and what the bias does at short range.

    Args:
        t: (n,) s.
        ranges: (n,) m.
        weights: (n,) in (0, 1], thin out outliers.
    """
    slow = (SLOW_SHARE * noise.sigma) ** 2
    white = noise.sigma**2 - slow
    lag = np.abs(t[:, None] - t[None, :]) / SLOW_TIME_S
    near = near_bias(ranges)
    covariance = slow * np.exp(-lag) + noise.bias_sigma**2 + np.outer(near, near)
    covariance[np.diag_indices(len(t))] += white + noise.sigma**2 * (1 / weights - 1)
    return np.asarray(covariance)


def odometry_covariance(
    points: Array, path: Array, directions: Array, noise: OdometryNoise, before: int | None = None
) -> Array:
    """(n, n): what the noise of one robot's odometry does to the residuals.

    Args:
        points: (n, 2) antenna at each measurement, in the body frame at the reference time.
        path: (n, 2) body positions in the same frame, between which the noise arises.
        directions: (n, 2) unit vectors along the line of sight, in the same frame.
        before: how many of them lie before the reference time; all of them when left out.
    """
    n = len(points)
    k = n if before is None else before
    covariance, bend = np.zeros((n, n)), np.zeros(n)
    # what is random before the reference time is another noise than what is random after it, where
    # the same holds backwards and a yaw error turns the other way
    for side, sign in ((np.arange(k), 1.0), (np.arange(n - 1, k - 1, -1), -1.0)):
        if len(side):
            random, turn = _one_side(points[side], path[side], directions[side], noise)
            covariance[np.ix_(side, side)], bend[side] = random, sign * turn
    stretch = np.sum(directions * path, axis=1) * noise.scale
    return np.asarray(covariance + np.outer(stretch, stretch) + np.outer(bend, bend))


def _one_side(
    points: Array, path: Array, directions: Array, noise: OdometryNoise
) -> tuple[Array, Array]:
    """Random part (n, n), and the effect (n,) of one sigma of the yaw rate; reference last."""
    n = len(points)
    following = np.concatenate([path[1:], np.zeros((1, 2))])
    step = np.hypot(*(following - path).T)
    middle = (path + following) / 2
    # a yaw error on step j swings every earlier point about the middle of that step
    earlier = np.tri(n).T
    across = np.stack([directions[:, 1], -directions[:, 0]], axis=-1)
    swing = (np.sum(across * points, axis=1)[:, None] - across @ middle.T) * earlier
    yaw = (swing * (step * noise.yaw_rad_per_sqrt_m**2)) @ swing.T
    to_go = np.cumsum(step[::-1])[::-1]
    later = np.minimum(to_go[:, None], to_go[None, :])
    shift = later * (directions @ directions.T) * noise.translation_per_sqrt_m**2
    return np.asarray(yaw + shift), np.asarray(swing @ step * noise.yaw_rad_per_m)
