"""Newton's steps down the cost of the team's problem."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drslamd.slam.calibration.range_scatter import inlier_scatter
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE, WEIGHT, WHOLE
from drslamd.slam.optimizer.problem import Calibration, Problem, range_errors
from drslamd.slam.se2 import Array

FIRST_DAMPING = 1e-6
"""Of Levenberg and Marquardt, relative to the diagonal; less after each step that helped."""
MOST_DAMPING = 1e6
"""Beyond it no step helps."""
CURVATURES = (WHOLE, LEAST_CURVATURE, WEIGHT)
"""What heavy tails have at least, from near the solution to far from it."""
FAR = 0.3
"""m and rad: where steps are longer, second derivatives say little of the cost."""
NEAR = 0.03
"""m and rad: after a shorter step the matrix hardly changes, and serves for the next one too ..."""
FASTER = 0.25
"""... while each step is so much shorter than the one before it."""
TOLERANCE = 3e-7
"""m and rad: largest step after which the solution counts as reached. Far below every noise, so
that robots which hold the same graph have the same answer wherever they started from."""


@dataclass(frozen=True)
class Point:
    """A place on the way to the solution.

    Attributes:
        poses: (k, 3) w_T_k.
        calibration: what was learned of the sensors.
        threshold: (pairs,) sigmas beyond which a range loses weight.
        steps: how many were tried to get here.
        converged: is this the solution?
    """

    poses: Array
    calibration: Calibration
    threshold: Array
    steps: int = 0
    converged: bool = False


def descend(
    equations: Equations,
    start: Calibration,
    most: int,
    tolerance: float = TOLERANCE,
) -> Point:
    """From the initial poses of a problem to its least cost, or as near as it goes.

    Args:
        start: calibration to start from.
        most: bound on steps.
        tolerance: see `TOLERANCE`.
    """
    problem, layout = equations.problem, equations.layout
    point = _point(problem, problem.initial.copy(), start)
    factor: BandFactor | None = None
    damping, level, size, steps, converged = FIRST_DAMPING, 1, np.inf, 0, False
    while steps < most and not converged and damping < MOST_DAMPING:
        steps += 1
        is_kept = factor is not None
        if factor is None:
            system, gradient = equations.at(
                point.poses, point.calibration, point.threshold, CURVATURES[level]
            )
            factor = BandFactor.of(system, damping)
        else:
            gradient = equations.gradient(point.poses, point.calibration, point.threshold)
        step = None if factor is None else factor.solved(-gradient)
        if step is None or not np.isfinite(step).all():
            (damping, level), factor = _stiffer(damping, level, 0.0), None
            continue
        poses = point.poses + step[layout.poses]
        calibration = point.calibration.plus(layout.calibration(step))
        before, size = size, float(np.abs(step[layout.poses]).max())
        metres = max(size, float(np.abs(step[layout.bias]).max(initial=0.0)))
        if not is_kept and not _is_better(equations, poses, calibration, point):
            (damping, level), factor = _stiffer(damping, level, metres), None
            continue
        level = 0 if metres < NEAR else 1 if metres < FAR else 2
        if metres > NEAR or size > FASTER * before:
            damping, factor = damping / 10, None
        converged = size < tolerance
        point = _point(problem, poses, calibration)
    return replace(point, steps=steps, converged=converged)


def _stiffer(damping: float, level: int, size: float) -> tuple[float, int]:
    """After a step of such a size that did not help: another curvature, then more damping."""
    most = 2 if size > FAR else 1
    return (damping, level + 1) if level < most else (10 * damping, level)


def _point(problem: Problem, poses: Array, calibration: Calibration) -> Point:
    """Thresholds follow how much the ranges of a pair scatter, outliers left out."""
    ranges, model = problem.ranges, problem.model
    errors = range_errors(poses, ranges, calibration, model)[0]
    scatter = inlier_scatter(
        errors, ranges.sigma, ranges.pair, pairs=problem.pairs, sigmas_cut=model.cauchy_sigmas
    )
    return Point(poses, calibration, model.cauchy_sigmas * scatter)


def _is_better(equations: Equations, poses: Array, calibration: Calibration, than: Point) -> bool:
    """Does all together cost no more than before, rounding apart?"""
    before = equations.cost(than.poses, than.calibration, than.threshold)
    cost = equations.cost(poses, calibration, than.threshold)
    return cost <= before + 1e-12 * (1 + abs(before))
