"""Module 1 (paper III-A): the pose of robot b seen from robot a, out of a window of ranges.

    x_ab = argmin sum_i (r_i - | p_a,i - x_ab p_b,i |)^2                             eq. (1)

All minima of the coarse search are refined together and judged under the full noise of the window.
Every pose that the data cannot exclude is kept as a hypothesis. The paper's own version, one seed
and white noise, is in `algorithm_1`.
"""

from __future__ import annotations

import numpy as np

from drslamd.slam import se2
from drslamd.slam.relative_pose import coarse_search
from drslamd.slam.relative_pose.descent import FIRST_ITERATIONS, ITERATIONS, Descent
from drslamd.slam.relative_pose.estimate import (
    Hypothesis,
    PairNoise,
    RelativePoseEstimate,
    Verdict,
)
from drslamd.slam.relative_pose.gls import Refined, middle, refine
from drslamd.slam.relative_pose.range_fit import (
    MAX_SIGMA_M,
    MAX_SIGMA_RAD,
    POOR_FIT,
    RangeFit,
)
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.relative_pose.window_noise import WindowNoise
from drslamd.slam.se2 import Array

FEWEST_RANGES = 6
SEEDS = 8
"""One seed ends in the wrong basin in 42 % of nearly straight windows, eight in under 1 %."""
CLOSE_PASS_M = 1.5
"""Robots that came so near have two minima side by side: few ranges tell on which side one passed
the other, and the way from one minimum to the other leads through robots that collide."""
MERGE_M = 0.15
"""Refined seeds that are nearer than this, and than `MERGE_RAD`, are one minimum."""
MERGE_RAD = 0.10
"""See `MERGE_M`."""
HYPOTHESES = 4
"""Poses of one window that are carried on."""
EXCLUDED_CHI2 = 20.0
"""A minimum this much worse than the best (2 log-likelihood) is no longer carried."""
NEWEST = 3
"""So many last measurements may not lie off the rest: near the end of a window a burst and
odometry that has just failed look alike."""
NEWEST_SIGMAS = 2.0
"""In the median they may be so many sigmas off."""


def solve(window: Window, noise: PairNoise, delta: float) -> RelativePoseEstimate:
    """Relative pose with its uncertainty.

    Args:
        window: with fewer than `FEWEST_RANGES` the verdict is TOO_FEW.
        noise: of ranges and odometries.
        delta: step of the coarse search, radians.
    """
    if len(window) < FEWEST_RANGES:
        return RelativePoseEstimate(Verdict.TOO_FEW)
    fit = RangeFit(window.a_points, window.b_points, window.ranges)
    candidates = _candidates(window, fit, noise, delta)  # eq. (2), then eq. (1) from each seed
    if candidates is None:
        return RelativePoseEstimate(Verdict.UNOBSERVABLE)
    refined = refine(fit, _window_noise(window, noise), candidates)
    if refined is None:
        return RelativePoseEstimate(Verdict.UNOBSERVABLE)
    if _is_poor(refined, noise):
        return RelativePoseEstimate(Verdict.POOR_FIT)
    hypotheses = _not_excluded(fit, refined)
    if not all(_is_observable(h.covariance) for h in hypotheses):
        return RelativePoseEstimate(Verdict.UNOBSERVABLE)
    verdict = Verdict.UNIQUE if len(hypotheses) == 1 else Verdict.AMBIGUOUS
    return RelativePoseEstimate(verdict, hypotheses)


def least_chi2(window: Window, noise: PairNoise, delta: float) -> float:
    """How badly a window fits at its best: 2 log-likelihood, also where it is vague."""
    fit = RangeFit(window.a_points, window.b_points, window.ranges)
    descent = _descent(window, fit, noise, delta)
    descent.run(ITERATIONS)
    best = descent.minima().centred[:1]
    refined = refine(fit, _window_noise(window, noise), best, wants_vague=True)
    return float("inf") if refined is None else float(refined.minima.chi2[0])


def _candidates(window: Window, fit: RangeFit, noise: PairNoise, delta: float) -> Array | None:
    """Centred poses (k, 2) of distinct minima; None as soon as it shows that the best is vague."""
    descent = _descent(window, fit, noise, delta)
    descent.run(FIRST_ITERATIONS)
    if fit.is_vague(descent.minima()):
        return None
    descent.run(ITERATIONS - FIRST_ITERATIONS)
    minima = descent.minima().centred
    minima = minima[_distinct(fit.poses(minima))]
    if window.ranges.min() < CLOSE_PASS_M:
        minima = np.concatenate([minima, fit.other_side(minima)])
        minima = minima[_distinct(fit.poses(minima))]
    return minima


def _descent(window: Window, fit: RangeFit, noise: PairNoise, delta: float) -> Descent:
    """From the seeds of the coarse search."""
    nearest = np.argsort(np.abs(window.t), kind="stable")[:3]
    rho = max(0.1, float(np.sort(window.ranges[nearest])[1]))
    seeds = coarse_search.seeds(
        window.a_points, window.b_points, window.ranges, rho=rho, delta=delta, most=SEEDS
    )
    return Descent(fit, fit.centred(seeds), noise.ranges, noise.model)


def _window_noise(window: Window, noise: PairNoise) -> WindowNoise:
    return WindowNoise(
        window, window.a_points, window.b_points, noise.ranges, noise.a, noise.b, noise.model
    )


def _is_poor(refined: Refined, noise: PairNoise) -> bool:
    """Does not even the best minimum explain the window, or its end?"""
    e = refined.e[0]
    newest = np.abs(e[-NEWEST:] - middle(e))
    end_is_off = middle(newest) > NEWEST_SIGMAS * noise.ranges.sigma
    return bool(refined.minima.chi2[0] > POOR_FIT * (len(e) - 3) or end_is_off)


def _not_excluded(fit: RangeFit, refined: Refined) -> tuple[Hypothesis, ...]:
    """The minima that the data cannot exclude, best first."""
    minima, chi2 = refined.minima, refined.minima.chi2
    poses, covariances = fit.poses(minima.centred), fit.covariances(minima)
    # under the full noise two candidates may have come to the same minimum
    kept = [k for k in _distinct(poses) if chi2[k] < chi2[0] + EXCLUDED_CHI2][:HYPOTHESES]
    return tuple(Hypothesis(poses[k], covariances[k], float(chi2[k])) for k in kept)


def _is_observable(covariance: Array) -> bool:
    xx, xy, yy = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    spread = (xx + yy) / 2 + np.hypot((xx - yy) / 2, xy)
    return bool(spread < MAX_SIGMA_M**2 and covariance[2, 2] < MAX_SIGMA_RAD**2)


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
