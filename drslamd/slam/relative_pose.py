"""Module 1: the pose of robot b seen from robot a, out of a short window of ranges (paper III-A).

    x_ab = argmin sum_i (r_i - | p_a,i - x_ab p_b,i |)^2                             (equation 1)

`solve` is the default: all minima of the coarse search, refined together, judged under the full
noise of the window; every pose that the data cannot exclude is kept as a hypothesis. `solve_paper`
is algorithm 1 and its refinement as printed: one seed, white noise, no verdict.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from drslamd.slam import coarse_search, se2
from drslamd.slam.odometry import OdometryNoise
from drslamd.slam.se2 import Array
from drslamd.slam.window import Window
from drslamd.slam.window_noise import RangeNoise, odometry_covariance, range_covariance

SEEDS = 8
"""One seed ends in the wrong basin in 42 % of nearly straight windows, eight in under 1 %."""
MERGE_M, MERGE_RAD = 0.15, 0.10
"""Refined seeds nearer than this are one minimum."""
HYPOTHESES = 4
EXCLUDED_CHI2 = 20.0
"""A minimum this much worse than the best (2 log-likelihood) is no longer carried."""
REFINED = 1e-3
"""Steps (m, rad) below which the refinement leaves the rest to the generalised least squares."""
JUDGED = 8
"""Steps of the generalised least squares at most; mostly two or three are enough."""
HOPELESS, HOPELESS_CHI2 = 5.0, 60.0
"""A minimum that is worse by this factor and sum cannot come back under correlated noise."""
POOR_FIT = 4.0
"""Chi-squared per degree of freedom beyond which the model does not explain the window."""
NEWEST, NEWEST_SIGMAS = 3, 2.0
"""So many last measurements may not lie off the rest by so much in the median: near the end of a
window a burst and odometry that has just failed look alike."""
MAX_SIGMA_M, MAX_SIGMA_RAD = 1.5, 0.5
"""A pose known worse than this helps nobody."""
LEAST_DAMPING = 1e-12
"""Relative to the diagonal: above rounding, so that no step meets a singular matrix however
little a window says."""
PRIOR = 1e-9
"""Information, 1/m^2 and 1/rad^2, of directions of which a window says nothing at all."""
PAPER_PRIOR = 1e-4
"""The same where no verdict keeps such windows back: a covariance of 100 m can still be sent."""
ROBUST_SIGMAS = 2.5
"""Huber's threshold: beyond it a range loses weight (bursts are 0.3 m and more)."""


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
class Estimate:
    """Result of module 1; `hypotheses` is empty unless the verdict is UNIQUE or AMBIGUOUS."""

    verdict: Verdict
    hypotheses: tuple[Hypothesis, ...] = ()


@dataclass(frozen=True)
class Noise:
    """All that `solve` must know about the sensors of both robots."""

    ranges: RangeNoise
    a: OdometryNoise
    b: OdometryNoise


def solve(window: Window, noise: Noise, delta: float) -> Estimate:
    """Relative pose with its uncertainty.

    Args:
        window: at least 6 measurements, else the verdict is TOO_FEW.
        noise: sigmas of ranges and odometries.
        delta: step of the coarse search, radians.
    """
    if len(window) < 6:
        return Estimate(Verdict.TOO_FEW)
    a, b = window.a_points, window.b_points
    nearest = np.argsort(np.abs(window.t), kind="stable")[:3]
    rho = max(0.1, float(np.median(window.ranges[nearest])))
    candidates = coarse_search.seeds(a, b, window.ranges, rho, delta, SEEDS)
    candidates = refine(a, b, window.ranges, candidates, noise.ranges)
    judged = [_judge(window, noise, candidates[k]) for k in _distinct(candidates)]
    judged.sort(key=lambda hypothesis: hypothesis.chi2)
    # under the full noise two candidates may have come to the same minimum
    judged = [judged[k] for k in _distinct(np.array([h.a_T_b for h in judged]))]
    best = judged[0]
    if best.chi2 > POOR_FIT * (len(window) - 3) or _end_is_off(window, noise, best.a_T_b):
        return Estimate(Verdict.POOR_FIT)
    kept = [h for h in judged if h.chi2 < best.chi2 + EXCLUDED_CHI2][:HYPOTHESES]
    if not all(_observable(h.covariance) for h in kept):
        return Estimate(Verdict.UNOBSERVABLE)
    return Estimate(Verdict.UNIQUE if len(kept) == 1 else Verdict.AMBIGUOUS, tuple(kept))


def _end_is_off(window: Window, noise: Noise, pose: Array) -> bool:
    e = residuals(pose[None], window.a_points, window.b_points, window.ranges)[0][0]
    off = np.abs(e[-NEWEST:] - np.median(e))
    return bool(np.median(off) > NEWEST_SIGMAS * noise.ranges.sigma)


def _observable(covariance: Array) -> bool:
    spread = np.linalg.eigvalsh(covariance[:2, :2])[-1]
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


def refine(a: Array, b: Array, ranges: Array, seeds: Array, noise: RangeNoise) -> Array:
    """Robust Levenberg-Marquardt on all seeds (k, 3) at once, the pair's bias a fourth unknown.

    Returns:
        (k, 3) the minima, best first, without those that are worse than the best beyond doubt.
    """
    x = np.concatenate([seeds, np.zeros((len(seeds), 1))], axis=1)
    damping = np.full(len(x), 1e-3)
    cost, gradient, hessian = _normal_equations(x, a, b, ranges, noise)
    for _ in range(25):
        lift = np.maximum(damping, LEAST_DAMPING)[:, None] * np.einsum("kii->ki", hessian)
        step = -np.linalg.solve(hessian + lift[..., None] * np.eye(4), gradient[..., None])[..., 0]
        trial = x + step
        new = _normal_equations(trial, a, b, ranges, noise)
        better = new[0] <= cost
        x = np.where(better[:, None], trial, x)
        cost = np.where(better, new[0], cost)
        gradient = np.where(better[:, None], new[1], gradient)
        hessian = np.where(better[:, None, None], new[2], hessian)
        damping = np.where(better, damping / 5, damping * 8)
        hopeful = cost < cost.min() * HOPELESS + HOPELESS_CHI2
        settled = (np.abs(step).max(axis=1) < REFINED) | (damping > 1e6)
        if np.all(settled | ~hopeful):
            break
    order = np.argsort(cost, kind="stable")
    return np.asarray(x[order[hopeful[order]], :3])


def _normal_equations(
    x: Array, a: Array, b: Array, ranges: Array, noise: RangeNoise
) -> tuple[Array, Array, Array]:
    """Cost (k,), gradient (k, 4) and Gauss-Newton Hessian (k, 4, 4) of Huber's cost."""
    e, _, j = residuals(x[:, :3], a, b, ranges)
    e = (e + x[:, 3:]) / noise.sigma
    j = np.concatenate([j, np.ones((*e.shape, 1))], axis=-1) / noise.sigma
    size = np.abs(e)
    weight = np.minimum(1.0, ROBUST_SIGMAS / np.maximum(size, 1e-9))
    cost = np.where(size < ROBUST_SIGMAS, e * e, ROBUST_SIGMAS * (2 * size - ROBUST_SIGMAS))
    jw = j * weight[..., None]
    gradient = np.einsum("knp,kn->kp", jw, e)
    hessian = np.swapaxes(jw, 1, 2) @ j
    prior = 1 / noise.bias_sigma**2
    gradient[:, 3] += x[:, 3] * prior
    hessian[:, 3, 3] += prior
    hessian[:, np.arange(4), np.arange(4)] += PRIOR
    return cost.sum(axis=1) + x[:, 3] ** 2 * prior, gradient, hessian


def _distinct(poses: Array) -> list[int]:
    """Which of the poses (k, 3), best first, are not near a better one."""
    kept: list[int] = []
    for k, pose in enumerate(poses):
        off = poses[kept] - pose
        near = (np.hypot(off[:, 0], off[:, 1]) < MERGE_M) & (
            np.abs(se2.wrap(off[:, 2])) < MERGE_RAD
        )
        if not near.any():
            kept.append(k)
    return kept


def _judge(window: Window, noise: Noise, pose: Array) -> Hypothesis:
    """Generalised least squares from one pose, under the noise of the whole window."""
    a, b = window.a_points, window.b_points
    for _ in range(JUDGED):
        e, u, j = (value[0] for value in residuals(pose[None], a, b, window.ranges))
        level = np.median(e)
        size = np.abs(e - level) / noise.ranges.sigma
        weights = np.minimum(1.0, ROBUST_SIGMAS / np.maximum(size, 1e-9)) ** 2
        covariance = range_covariance(window.t, window.ranges, noise.ranges, weights)
        before = window.before
        covariance += odometry_covariance(a, window.a_poses[:, :2], u, noise.a, before)
        u_in_b = se2.rotate(-pose[2], u)
        covariance += odometry_covariance(b, window.b_poses[:, :2], u_in_b, noise.b, before)
        # absurd odometry of a peer could round the smallest eigenvalue below zero
        covariance[np.diag_indices(len(e))] *= 1 + 1e-12
        factor = cho_factor(covariance, lower=True, check_finite=False)
        weighted = cho_solve(factor, np.column_stack([j, e]), check_finite=False)
        information = j.T @ weighted[:, :3] + PRIOR * np.eye(3)
        chi2 = float(e @ weighted[:, 3])
        step = np.linalg.solve(information, -j.T @ weighted[:, 3])
        size = float(np.abs(step).max())
        pose = pose + step * min(1.0, 0.5 / (size + 1e-12))
        if size < REFINED:
            break
    pose = np.append(pose[:2], se2.wrap(pose[2]))
    return Hypothesis(pose, np.linalg.inv(information), chi2)


def solve_paper(window: Window, range_sigma: float, delta: float) -> Estimate:
    """Algorithm 1 and equation 1 as printed; covariance sigma_r^2 (J' J)^-1.

    Args:
        window: tau measurements at 10 Hz.
        range_sigma: metres.
        delta: step of the inclusive grid -w .. w, w = ceil(pi / delta).
    """
    if len(window) < 4:
        return Estimate(Verdict.TOO_FEW)
    a, b, ranges = window.a_points, window.b_points, window.ranges
    coarse = coarse_paper(a, b, ranges, delta)
    pose = _least_squares(a, b, ranges, coarse)
    e, _, j = (value[0] for value in residuals(pose[None], a, b, ranges))
    information = j.T @ j / range_sigma**2 + PAPER_PRIOR * np.eye(3)
    chi2 = float(e @ e) / range_sigma**2
    pose = np.append(pose[:2], se2.wrap(pose[2]))
    return Estimate(Verdict.UNIQUE, (Hypothesis(pose, np.linalg.inv(information), chi2),))


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
