"""Module 1: the pose of robot b seen from robot a, out of a short window of ranges (paper III-A).

    x_ab = argmin sum_i (r_i - | p_a,i - x_ab p_b,i |)^2                             (equation 1)

`solve` is the default: all minima of the coarse search, refined together, refined_minima under the full
noise of the window; every pose that the data cannot exclude is kept as a hypothesis. `solve_paper`
is algorithm 1 and its refinement as printed: one seed, white noise, no verdict.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from drslamd.slam import se2
from drslamd.slam.odometry.track import OdometryNoise
from drslamd.slam.relative_pose import coarse_search
from drslamd.slam.relative_pose.gls import middle, refine
from drslamd.slam.relative_pose.range_fit import (
    FIRST_STEPS,
    LEAST_DAMPING,
    MAX_SIGMA_M,
    MAX_SIGMA_RAD,
    POOR_FIT,
    STEPS,
    Descent,
    RangeFit,
)
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.relative_pose.window_noise import RangeNoise, WindowNoise
from drslamd.slam.se2 import Array

SEEDS = 8
"""One seed ends in the wrong basin in 42 % of nearly straight windows, eight in under 1 %."""
CLOSE_PASS_M = 1.5
"""Robots that came so near have two minima side by side: few ranges tell on which side one passed
the other, and the way from one minimum to the other leads through robots that collide."""
MERGE_M, MERGE_RAD = 0.15, 0.10
"""Refined seeds nearer than this are one minimum."""
HYPOTHESES = 4
EXCLUDED_CHI2 = 20.0
"""A minimum this much worse than the best (2 log-likelihood) is no longer carried."""
NEWEST, NEWEST_SIGMAS = 3, 2.0
"""So many last measurements may not lie off the rest by so much in the median: near the end of a
window a burst and odometry that has just failed look alike."""
PAPER_PRIOR = 1e-4
"""Information, 1/m^2 and 1/rad^2, that the paper's solver adds: no verdict keeps windows back that
say nothing, and a covariance of 100 m can still be sent."""


class Verdict(Enum):
    """What one window could tell."""

    UNIQUE = "unique"
    AMBIGUOUS = "ambiguous"
    UNOBSERVABLE = "not enough motion"
    POOR_FIT = "ranges and odometry disagree"
    TOO_FEW = "too few ranges"


@dataclass(frozen=True)
class Hypothesis:
    """One minimum: a_T_b (3,), covariance (3, 3) of x, y, theta in frame a, and chi-squared."""

    a_T_b: Array
    covariance: Array
    chi2: float


@dataclass(frozen=True)
class RelativePoseEstimate:
    """Result of module 1; `hypotheses` is empty unless the verdict is UNIQUE or AMBIGUOUS."""

    verdict: Verdict
    hypotheses: tuple[Hypothesis, ...] = ()


@dataclass(frozen=True)
class PairNoise:
    """All that `solve` must know about the sensors of both robots."""

    ranges: RangeNoise
    a: OdometryNoise
    b: OdometryNoise


def solve(window: Window, noise: PairNoise, delta: float) -> RelativePoseEstimate:
    """Relative pose with its uncertainty.

    Args:
        window: at least 6 measurements, else the verdict is TOO_FEW.
        noise: sigmas of ranges and odometries.
        delta: step of the coarse search, radians.
    """
    if len(window) < 6:
        return RelativePoseEstimate(Verdict.TOO_FEW)
    a, b = window.a_points, window.b_points
    fit = RangeFit(a, b, window.ranges)
    nearest = np.argsort(np.abs(window.t), kind="stable")[:3]
    rho = max(0.1, float(np.sort(window.ranges[nearest])[1]))
    seeds = coarse_search.seeds(a, b, window.ranges, rho, delta, SEEDS)
    descent = Descent(fit, fit.centred(seeds), noise.ranges)
    descent.run(FIRST_STEPS)
    if fit.is_vague(descent.minima()):
        return RelativePoseEstimate(Verdict.UNOBSERVABLE)
    descent.run(STEPS - FIRST_STEPS)
    refined = descent.minima().centred
    candidates = refined[_distinct(fit.poses(refined))]
    if window.ranges.min() < CLOSE_PASS_M:
        candidates = np.concatenate([candidates, fit.other_side(candidates)])
        candidates = candidates[_distinct(fit.poses(candidates))]
    window_noise = WindowNoise(window, a, b, noise.ranges, noise.a, noise.b)
    refined_minima = refine(fit, window_noise, candidates)
    if refined_minima is None:
        return RelativePoseEstimate(Verdict.UNOBSERVABLE)
    minima, chi2 = refined_minima.minima, refined_minima.minima.chi2
    if chi2[0] > POOR_FIT * (len(window) - 3) or _end_is_off(refined_minima.e[0], noise):
        return RelativePoseEstimate(Verdict.POOR_FIT)
    poses, covariances = fit.poses(minima.centred), fit.covariances(minima)
    # under the full noise two candidates may have come to the same minimum
    kept = [k for k in _distinct(poses) if chi2[k] < chi2[0] + EXCLUDED_CHI2][:HYPOTHESES]
    if not all(_observable(covariances[k]) for k in kept):
        return RelativePoseEstimate(Verdict.UNOBSERVABLE)
    hypotheses = tuple(Hypothesis(poses[k], covariances[k], float(chi2[k])) for k in kept)
    return RelativePoseEstimate(Verdict.UNIQUE if len(kept) == 1 else Verdict.AMBIGUOUS, hypotheses)


def _end_is_off(e: Array, noise: PairNoise) -> bool:
    newest = np.abs(e[-NEWEST:] - middle(e))
    return bool(middle(newest) > NEWEST_SIGMAS * noise.ranges.sigma)


def _observable(covariance: Array) -> bool:
    xx, xy, yy = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    spread = (xx + yy) / 2 + np.hypot((xx - yy) / 2, xy)
    return bool(spread < MAX_SIGMA_M**2 and covariance[2, 2] < MAX_SIGMA_RAD**2)


def residuals(poses: Array, a: Array, b: Array, ranges: Array) -> tuple[Array, Array, Array]:
    """Errors of equation 1 at poses (k, 3).

    Returns:
        e (k, n) predicted minus measured range, u (k, n, 2) unit line of sight from a to b in a,
        and the Jacobian (k, n, 3) of e by x, y, theta.
    """
    turned = se2.rotate(poses[:, None, 2], b[None])
    sight = turned + poses[:, None, :2] - a[None]
    distance = np.maximum(np.hypot(sight[..., 0], sight[..., 1]), 1e-6)
    u = sight / distance[..., None]
    by_theta = u[..., 1] * turned[..., 0] - u[..., 0] * turned[..., 1]
    return distance - ranges, u, np.concatenate([u, by_theta[..., None]], axis=-1)


def _distinct(poses: Array) -> list[int]:
    """Which of the poses (k, 3), best first, are not near a better one."""
    if len(poses) == 1:
        return [0]
    off = poses[:, None] - poses
    near = np.hypot(off[..., 0], off[..., 1]) < MERGE_M
    near &= np.abs(se2.wrap(off[..., 2])) < MERGE_RAD
    kept: list[int] = []
    for k, row in enumerate(near.tolist()):
        if not any(row[other] for other in kept):
            kept.append(k)
    return kept


def solve_paper(window: Window, range_sigma: float, delta: float) -> RelativePoseEstimate:
    """Algorithm 1 and equation 1 as printed; covariance sigma_r^2 (J' J)^-1.

    Args:
        window: tau measurements at 10 Hz.
        range_sigma: metres.
        delta: step of the inclusive grid -w .. w, w = ceil(pi / delta).
    """
    if len(window) < 4:
        return RelativePoseEstimate(Verdict.TOO_FEW)
    a, b, ranges = window.a_points, window.b_points, window.ranges
    coarse = coarse_paper(a, b, ranges, delta)
    pose = _least_squares(a, b, ranges, coarse)
    e, _, j = (value[0] for value in residuals(pose[None], a, b, ranges))
    information = j.T @ j / range_sigma**2 + PAPER_PRIOR * np.eye(3)
    chi2 = float(e @ e) / range_sigma**2
    pose = np.append(pose[:2], se2.wrap(pose[2]))
    return RelativePoseEstimate(
        Verdict.UNIQUE, (Hypothesis(pose, np.linalg.inv(information), chi2),)
    )


def coarse_paper(a: Array, b: Array, ranges: Array, delta: float) -> Array:
    """Algorithm 1: the grid point with the smallest sum of squared errors, a_T_b (3,)."""
    w = int(np.ceil(np.pi / delta))
    steps = np.arange(-w, w + 1) * delta
    phi, theta = (x.ravel() for x in np.meshgrid(steps, steps, indexing="ij"))
    r = float(ranges[-1])
    poses = np.stack([r * np.cos(phi), r * np.sin(phi), theta], axis=-1)
    cost = np.zeros(len(poses))
    alive = np.arange(len(poses))
    # the early exit of lines 8-9: a grid point that already lost is not summed further
    for rows in np.array_split(np.arange(len(ranges)), max(1, len(ranges) // 16)):
        e, _, _ = residuals(poses[alive], a[rows], b[rows], ranges[rows])
        cost[alive] += np.sum(e * e, axis=1)
        bound = np.inf if rows[-1] + 1 < len(ranges) else cost[alive].min()
        if rows[-1] + 1 < len(ranges):
            champion = poses[alive[np.argmin(cost[alive])]][None]
            full, _, _ = residuals(champion, a, b, ranges)
            bound = float(np.sum(full * full))
        alive = alive[cost[alive] <= bound * (1 + 1e-12)]
    return np.asarray(poses[alive[np.argmin(cost[alive])]])


def _least_squares(a: Array, b: Array, ranges: Array, pose: Array) -> Array:
    """Levenberg-Marquardt on equation 1 from one pose (3,)."""
    damping = 1e-3
    e, _, j = (value[0] for value in residuals(pose[None], a, b, ranges))
    for _ in range(100):
        hessian = j.T @ j
        lifted = hessian + np.diag(max(damping, LEAST_DAMPING) * np.diag(hessian) + 1e-12)
        step = -np.linalg.solve(lifted, j.T @ e)
        trial = pose + step
        new_e, _, new_j = (value[0] for value in residuals(trial[None], a, b, ranges))
        if new_e @ new_e <= e @ e:
            pose, e, j, damping = trial, new_e, new_j, damping / 5
            if np.abs(step).max() < 1e-6:
                break
        else:
            damping *= 8
            if damping > 1e9:
                break
    return pose
