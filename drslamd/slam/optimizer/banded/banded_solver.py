"""Module 3, default: the team's graph solved exactly, because ordered by time it is a band.

The Gauss-Newton Hessian of the team has a half-bandwidth of about 3 R for R robots (`layout`), so
one banded Cholesky factorisation solves it exactly in linear time. The border is eliminated by its
Schur complement. A second system, at the solution, says what may be claimed of it.

The cost of a step grows with the cube of the number of robots; up to about a dozen robots in one
connected group it stays below the cost of linearising.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam import se2
from drslamd.slam.calibration.range_scatter import LEAST_SCATTER, inlier_scatter, scatter_ratios
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.normal_equations import Equations, System
from drslamd.slam.optimizer.problem import Calibration, Problem, Solution, range_errors
from drslamd.slam.se2 import Array, Index

LEAST_DAMPING = 1e-6
"""Of Levenberg and Marquardt, relative to the diagonal."""
MOST_DAMPING = 1e6
"""Beyond it no step helps."""
UNKNOWN = 1e6
"""m^2 and rad^2: the covariance of a pose that nothing holds."""
TOLERANCE = 3e-7
"""m and rad: largest step after which the solution counts as reached. Far below every noise, so that
robots which hold the same graph have the same answer wherever they started from."""


@dataclass(frozen=True)
class _Point:
    """A solution on its way.

    Attributes:
        threshold: (pairs,) sigmas beyond which a range loses weight.
    """

    poses: Array
    calibration: Calibration
    threshold: Array
    cost: float


def solve(
    problem: Problem,
    start: Calibration | None = None,
    marginals: tuple[int, ...] = (),
    most: int = 30,
    tolerance: float = TOLERANCE,
) -> Solution:
    """Levenberg-Marquardt to convergence.

    Whatever the factors say, there is a solution; when they make no sense, or leave poses loose, it
    is the best that was met and does not count as converged.

    Args:
        problem: one connected group.
        start: calibration to start from (zero when left out).
        marginals: poses whose joint covariance is wanted.
        most: bound on iterations.
        tolerance: see `TOLERANCE`.
    """
    equations = Equations(problem)
    calibration = start or Calibration.zero(problem.pairs, len(problem.priors.scale))
    point = _point(equations, problem, problem.initial.copy(), calibration)
    system = equations.at(point.poses, point.calibration, point.threshold)
    damping, steps, converged = LEAST_DAMPING, 0, False
    while steps < most and not converged and damping < MOST_DAMPING:
        steps += 1
        step = _step(system, damping)
        if step is None:
            damping *= 10
            continue
        poses = point.poses + step[equations.layout.poses]
        calibration = point.calibration.plus(equations.layout.calibration(step))
        cost = equations.cost(poses, calibration, point.threshold)
        if not cost <= point.cost + 1e-12 * (1 + abs(point.cost)):
            damping *= 10
            continue
        damping /= 10
        converged = bool(np.abs(step[equations.layout.poses]).max() < tolerance)
        point = _point(equations, problem, poses, calibration)
        if not converged:
            system = equations.at(point.poses, point.calibration, point.threshold)
    return _solution(equations, problem, point, marginals, steps, converged)


def _point(
    equations: Equations, problem: Problem, poses: Array, calibration: Calibration
) -> _Point:
    threshold = _threshold(problem, poses, calibration)
    cost = equations.cost(poses, calibration, threshold)
    return _Point(poses, calibration, threshold, cost)


def _threshold(problem: Problem, poses: Array, calibration: Calibration) -> Array:
    """(pairs,) follows how much the ranges of a pair scatter, outliers left out."""
    ranges, model = problem.ranges, problem.model
    errors = range_errors(poses, ranges, calibration, model)[0]
    scatter = inlier_scatter(
        errors, ranges.sigma, ranges.pair, pairs=problem.pairs, sigmas_cut=model.cauchy_sigmas
    )
    return model.cauchy_sigmas * scatter


def _step(system: System, damping: float) -> Array | None:
    """Step of all unknowns; None where rounding has made the system indefinite."""
    factor = BandFactor.of(system, damping)
    step = None if factor is None else factor.solved(-system.gradient)
    return step if step is not None and np.isfinite(step).all() else None


def _solution(
    equations: Equations,
    problem: Problem,
    point: _Point,
    marginals: tuple[int, ...],
    steps: int,
    converged: bool,
) -> Solution:
    """The answer, with what may be claimed of it."""
    poses: Array = point.poses.copy()
    poses[:, 2] = se2.wrap(poses[:, 2])
    solution = Solution(
        poses, point.calibration, point.cost, steps, converged, scatter=_scatter(problem, point)
    )
    if not marginals:
        return solution
    layout, model = equations.layout, problem.model
    claims = model.correlated_ratio(1.0) * np.maximum(solution.scatter, LEAST_SCATTER)
    system = equations.claimed(point.poses, point.calibration, point.threshold, claims)
    wanted = layout.poses[list(marginals)].ravel()
    sensors = np.arange(3 * len(poses), layout.band + layout.border)
    joint = _covariance(system, np.concatenate([wanted, sensors]))
    k = len(wanted)
    sigmas = np.zeros(layout.band + layout.border)
    sigmas[sensors] = np.sqrt(np.diag(joint)[k:])
    return Solution(
        poses,
        point.calibration,
        point.cost,
        steps,
        converged,
        scatter=solution.scatter,
        joint=joint[:k, :k],
        spread=layout.calibration(sigmas),
    )


def _covariance(system: System, unknowns: Index) -> Array:
    factor = BandFactor.of(system)
    joint = None if factor is None else factor.joint_covariance(unknowns)
    return UNKNOWN * np.eye(len(unknowns)) if joint is None else joint


def _scatter(problem: Problem, point: _Point) -> Array:
    """(pairs,) how much ranges scatter about the solution, over what is configured."""
    ranges, model = problem.ranges, problem.model
    errors = range_errors(point.poses, ranges, point.calibration, model)[0]
    return scatter_ratios(
        errors,
        ranges.sigma,
        ranges.pair,
        pairs=problem.pairs,
        configured=problem.range_sigma,
        most_sigmas=model.cauchy_sigmas,
    )
