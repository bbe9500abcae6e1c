"""Module 1 (paper III-A): the pose of robot b seen from robot a, out of a window of ranges.

    x_ab = argmin sum_i (r_i - | p_a,i - x_ab p_b,i |)^2                             eq. (1)

All minima of the coarse search are refined together, those of the windows of several pairs too, and
judged under the full noise of their window.
Every pose that the data cannot exclude is kept as a hypothesis. The paper's own version, one seed
and white noise, is in `algorithm_1`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drslamd.slam import se2
from drslamd.slam.relative_pose import coarse_search
from drslamd.slam.relative_pose.descent import FIRST_ITERATIONS, ITERATIONS, Descent
from drslamd.slam.relative_pose.estimate import (
    Hypothesis,
    PairNoise,
    RelativePoseEstimate,
    Verdict,
)
from drslamd.slam.relative_pose.gls import Refined, refine
from drslamd.slam.relative_pose.range_fit import (
    MAX_SIGMA_M,
    MAX_SIGMA_RAD,
    POOR_FIT,
    RangeFit,
)
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.relative_pose.window_end import end_is_off
from drslamd.slam.relative_pose.window_noise import WindowNoise
from drslamd.slam.relative_pose.window_stack import Groups, WindowStack
from drslamd.slam.se2 import Array, Index

FEWEST_RANGES = 6
SPOT_M = 0.5
"""A window in which neither robot came farther from where it is rests on how antennas went round.
Biases that move with bearing by 4 to 10 cm do the same to ranges: of 25 teams four had windows
that named one pose and were wrong by two radians."""
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
MOST_AT_ONCE = 16
"""Windows; of more, what is computed of them no longer stays in the caches."""
MOST_CASES = 48
"""Likewise where only the best of each is held against the full noise."""


def solve(window: Window, noise: PairNoise, delta: float) -> RelativePoseEstimate:
    """Relative pose with its uncertainty.

    Args:
        window: with fewer than `FEWEST_RANGES` the verdict is TOO_FEW.
        noise: of ranges and odometries.
        delta: step of the coarse search, radians.
    """
    return solve_all([window], [noise], delta)[0]


def solve_all(
    windows: Sequence[Window], noises: Sequence[PairNoise], delta: float
) -> list[RelativePoseEstimate]:
    """Relative poses of several pairs, each as it would be found alone.

    Args:
        noises: of ranges and odometries of each window, all of one range model.
    """
    answers = [RelativePoseEstimate(Verdict.TOO_FEW)] * len(windows)
    enough = [k for k, window in enumerate(windows) if len(window) >= FEWEST_RANGES]
    for k in enough:
        answers[k] = RelativePoseEstimate(Verdict.UNOBSERVABLE)
    enough = [k for k in enough if not _is_on_the_spot(windows[k])]
    for first in range(0, len(enough), MOST_AT_ONCE):
        at_once = enough[first : first + MOST_AT_ONCE]
        found = _solved([windows[k] for k in at_once], [noises[k] for k in at_once], delta)
        for k, estimate in zip(at_once, found, strict=True):
            answers[k] = estimate
    return answers


def _is_on_the_spot(window: Window) -> bool:
    places = np.concatenate([window.a_poses, window.b_poses])[:, :2]
    return float(np.hypot(*places.T).max()) < SPOT_M


def least_chi2(windows: Sequence[Window], noises: Sequence[PairNoise], delta: float) -> Array:
    """(w,) how badly windows fit at their best: 2 log-likelihood, also where they are vague.

    Infinite where nothing fits.
    """
    found = np.full(len(windows), np.inf)
    for first in range(0, len(windows), MOST_CASES):
        at_once = slice(first, first + MOST_CASES)
        stack = WindowStack.of(windows[at_once])
        fit = RangeFit.of(stack)
        descent = _descent(stack, fit, noises[at_once], delta)
        descent.run(ITERATIONS)
        minima, groups = descent.minima()
        noise, best = WindowNoise(stack, noises[at_once]), groups.starts
        best_groups = Groups(groups.of[best])
        refined = refine(fit, noise, minima.centred[best], best_groups, wants_vague=True)
        found[first + refined.groups.of] = refined.minima.chi2
    return found


def _solved(
    windows: Sequence[Window], noises: Sequence[PairNoise], delta: float
) -> list[RelativePoseEstimate]:
    stack = WindowStack.of(windows)
    fit = RangeFit.of(stack)
    answers = [RelativePoseEstimate(Verdict.UNOBSERVABLE)] * len(windows)
    centred, groups = _candidates(stack, fit, noises, delta)  # eq. (2), then eq. (1) from each seed
    if not len(centred):
        return answers
    noise = WindowNoise(stack, noises)
    refined = refine(fit, noise, centred, groups)
    if not len(refined.e):
        return answers
    is_poor = _is_poor(fit, noise, refined, stack)
    all_hypotheses = _not_excluded(fit, refined)
    for (window, _), poor in zip(refined.groups.slices(), is_poor, strict=True):
        hypotheses = all_hypotheses[window]
        if poor:
            answers[window] = RelativePoseEstimate(Verdict.POOR_FIT)
        elif all(_is_observable(h.covariance) for h in hypotheses):
            verdict = Verdict.UNIQUE if len(hypotheses) == 1 else Verdict.AMBIGUOUS
            answers[window] = RelativePoseEstimate(verdict, hypotheses)
    return answers


def _candidates(
    stack: WindowStack, fit: RangeFit, noises: Sequence[PairNoise], delta: float
) -> tuple[Array, Groups]:
    """Centred poses (k, 2) of distinct minima; of a window none as soon as its best are vague."""
    descent = _descent(stack, fit, noises, delta)
    descent.run(FIRST_ITERATIONS)
    minima, groups = descent.minima()
    is_vague = np.zeros(len(stack.t), dtype=bool)
    is_vague[groups.of] = fit.rows(groups.of).is_vague(minima, groups)
    descent.leave(is_vague)
    descent.run(ITERATIONS - FIRST_ITERATIONS)
    minima, groups = descent.minima()
    centred, of = _distinct(fit, minima.centred, groups.of)
    near = stack.least_ranges[of] < CLOSE_PASS_M
    if near.any():
        passed = fit.rows(of[near]).other_side(centred[near])
        both = np.concatenate([of, of[near]])
        order = np.argsort(both, kind="stable")
        centred, of = _distinct(fit, np.concatenate([centred, passed])[order], both[order])
    return centred, Groups(of)


def _descent(
    stack: WindowStack, fit: RangeFit, noises: Sequence[PairNoise], delta: float
) -> Descent:
    """From the seeds of the coarse search."""
    rho = np.maximum(0.1, stack.latest_ranges)
    ranges = (
        stack.ranges if stack.held is None else np.where(stack.held, stack.ranges, rho[:, None])
    )
    a, b = stack.points[0], stack.points[1]
    seeds, of = coarse_search.seeds(a, b, ranges, rho, delta, SEEDS)
    centred = fit.rows(of).centred(seeds)
    return Descent(fit, centred, [noise.ranges for noise in noises], of, noises[0].model)


def _is_poor(fit: RangeFit, noise: WindowNoise, refined: Refined, stack: WindowStack) -> list[bool]:
    """Does not even the best minimum explain a window, or its end?"""
    best = refined.groups.starts
    counts = stack.counts[refined.groups.of[best]]
    misfit = refined.minima.chi2[best] > POOR_FIT * (counts - 3)
    poor: list[bool] = (misfit | end_is_off(fit, noise, refined)).tolist()
    return poor


def _not_excluded(fit: RangeFit, refined: Refined) -> dict[int, tuple[Hypothesis, ...]]:
    """The minima of each window that the data cannot exclude, best first."""
    minima, groups = refined.minima, refined.groups
    rows = fit.rows(groups.of)
    poses, covariances = rows.poses(minima.centred), rows.covariances(minima)
    # under the full noise two candidates may have come to the same minimum
    kept = _is_distinct(poses, groups.of)
    kept &= minima.chi2 < groups.least(minima.chi2) + EXCLUDED_CHI2
    found = {}
    for window, span in groups.slices():
        some = [k for k in range(span.start, span.stop) if kept[k]][:HYPOTHESES]
        found[window] = tuple(
            Hypothesis(poses[k], covariances[k], float(minima.chi2[k])) for k in some
        )
    return found


def _is_observable(covariance: Array) -> bool:
    xx, xy, yy, tt = (float(covariance[at]) for at in ((0, 0), (0, 1), (1, 1), (2, 2)))
    spread = (xx + yy) / 2 + math.hypot((xx - yy) / 2, xy)
    return spread < MAX_SIGMA_M**2 and tt < MAX_SIGMA_RAD**2


def _distinct(fit: RangeFit, centred: Array, of: Index) -> tuple[Array, Index]:
    """Those of centred poses (k, 2), best first in each window, that are not near a better one."""
    kept = _is_distinct(fit.rows(of).poses(centred), of)
    return centred[kept], of[kept]


def _is_distinct(poses: Array, of: Index) -> NDArray[np.bool_]:
    """(k,) which of poses (k, 3), best first in each window, are not near a better one."""
    kept = np.ones(len(poses), dtype=bool)
    one, better = np.nonzero(np.tri(len(of), k=-1, dtype=bool) & (of[:, None] == of))
    off = poses[one] - poses[better]
    near = np.hypot(off[:, 0], off[:, 1]) < MERGE_M
    near &= np.abs(se2.wrap(off[:, 2])) < MERGE_RAD
    for k, other in zip(one[near].tolist(), better[near].tolist(), strict=True):
        # whose better ones are judged already
        if kept[other]:
            kept[k] = False
    return kept
