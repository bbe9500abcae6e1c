"""How much worse than configured odometry was, robot by robot and moment by moment.

Of a right model the weighed squares s of a stretch's errors come to g, its share of the degrees of
freedom: what the other measurements could check of it (Baarda, Foerstner).

    s = sum e' W e     g = sum (3 - tr W P)     P = J H^-1 J'

A robot whose s / g stands out slipped, was stuck, or is otherwise not as configured. Its noise is
raised until the ratio is as it should be: first all along its way, then cell by cell of time as far
as each cell asks for it, so that a moment of slip is believed less and the rest as before. Each
time the team is solved again.

Long-lasting errors of ranges look alike. What tells them apart: with the right stretches raised
hardly any range is an outlier any more. Else nobody can say who is wrong; then the poses stay what
they were, and only their covariances grow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.descent import Point, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.problem import Problem, corrected, pose_errors, range_errors
from drslamd.slam.se2 import Array, Index

PROBES = 6
"""Rows of random signs by which g of a whole robot is estimated, to some percent, before it is
computed."""
SUSPICIOUS = 3.0
"""Estimated s / g above which it is computed."""
STANDS_OUT = 4.0
"""s / g of a robot with a fault; as modelled it is 0.1 to 1.8, with a fault 5 to 90."""
TARGET = 2.5
"""s / g that levels bring about: what is left is no worse than the worst that is modelled."""
DOUBT = 1.0
"""Degrees of freedom that hold a ratio at 1: a robot has but two or three that ranges can check."""
CELL = 20
"""Steps of the keyframes' grid: a wheel that slips does so for seconds."""
DOUBT_OF_CELL = 0.1
"""Degrees of freedom that hold a cell at its nominal noise."""
ROUNDS_OF_ROBOTS = 4
ROUNDS_OF_CELLS = 8
SETTLED = 0.1
"""Of log variance: levels that move less are done."""
STEPS_OF_ROUND = 10
ROUGH = 1e-3
"""m and rad, while levels are sought; the last solution is as exact as every other."""
MOST_LEVEL = 40.0
"""Times the nominal sigma; more says nothing about the way at all."""
OUTLIER_SIGMAS = 2.5
FEW_OUTLIERS = 0.06
"""Of the ranges of any pair, when odometry alone was at fault; 0.08 to 0.21 where ranges were."""


@dataclass(frozen=True)
class Explained:
    """
    Attributes:
        problem: with odometry as far as it is believed; its solution would be `point`, if
            `is_odometry`.
        variance: (m,) of each link over the nominal one.
        is_odometry: does this explain what was measured?
    """

    problem: Problem
    point: Point
    variance: Array
    is_odometry: bool


@dataclass(frozen=True)
class _Misfit:
    """s and g of each link."""

    squares: Array
    checked: Array

    def ratio(self, group: Index, count: int) -> Array:
        """(count,) s / g of groups of links."""
        s, g = (np.bincount(group, each, count) for each in (self.squares, self.checked))
        return np.asarray((s + DOUBT) / (np.maximum(g, 0.0) + DOUBT))


def explain(equations: Equations, nominal: Point, most: int, tolerance: float) -> Explained:
    """Who must be believed less for the rest to make sense?

    Args:
        nominal: the solution as configured.
        most: bound on steps of each solution.
    """
    problem = equations.problem
    odometry = problem.odometry
    robots = len(problem.priors.scale)
    as_configured = Explained(problem, nominal, np.ones(len(odometry)), True)
    guess = _misfit(equations, nominal, _guessed_hat).ratio(odometry.robot, robots)
    if not (guess > SUSPICIOUS).any():
        return as_configured

    def solved(variance: Array, near: Point) -> tuple[Point, _Misfit]:
        raised = Equations(_raised(problem, variance, near))
        point = descend(raised, near.calibration, STEPS_OF_ROUND, ROUGH)
        return point, _misfit(raised, point, _hat)

    point, misfit = nominal, _misfit(equations, nominal, _hat)
    ratio = misfit.ratio(odometry.robot, robots)
    if not (ratio > STANDS_OUT).any():
        return as_configured
    level = np.ones(robots)
    for _ in range(ROUNDS_OF_ROBOTS):
        raise_by = np.where(ratio > TARGET, 2 * ratio / TARGET, 1.0)
        level = np.minimum(level * raise_by, MOST_LEVEL**2)
        point, misfit = solved(level[odometry.robot], point)
        ratio = misfit.ratio(odometry.robot, robots)
        if not (ratio > TARGET).any():
            break
    variance = level[odometry.robot]
    cell = np.unique(np.stack([odometry.robot, problem.n[odometry.j] // CELL]), axis=1,
                     return_inverse=True)[1].ravel()
    for _ in range(ROUNDS_OF_CELLS):
        wanted = _wanted(misfit, variance, cell)
        if np.abs(np.log(wanted / variance)).max() < SETTLED:
            break
        variance = wanted
        point, misfit = solved(variance, point)
    raised = _raised(problem, variance, point)
    point = descend(Equations(raised), point.calibration, most, tolerance)
    outliers = outlier_share(problem, point)
    is_odometry = point.converged and bool(outliers.max(initial=0) < FEW_OUTLIERS)
    return Explained(raised, point, variance, is_odometry)


def _wanted(misfit: _Misfit, variance: Array, cell: Index) -> Array:
    """(m,) the variance that each link should have had, over the nominal one."""
    s, g = np.bincount(cell, misfit.squares), np.bincount(cell, misfit.checked)
    now = np.zeros(len(s))
    now[cell] = variance
    ratio = (s / TARGET + DOUBT_OF_CELL / now) / (g + DOUBT_OF_CELL)
    return np.asarray(np.clip(now * ratio, 1.0, MOST_LEVEL**2)[cell])


def outlier_share(problem: Problem, point: Point) -> Array:
    """(pairs,) of ranges."""
    ranges = problem.ranges
    errors = range_errors(point.poses, ranges, point.calibration, problem.model)[0]
    outlier = np.abs(errors) > OUTLIER_SIGMAS * ranges.sigma
    count = np.bincount(ranges.pair, minlength=problem.pairs)
    return np.bincount(ranges.pair, outlier, problem.pairs) / np.maximum(count, 1)


def _raised(problem: Problem, variance: Array, near: Point) -> Problem:
    """The problem with odometry that is believed less, to be solved from a point near by."""
    odometry = problem.odometry
    covariance = odometry.covariance * variance[:, None, None]
    return replace(
        problem, initial=near.poses, odometry=replace(odometry, covariance=covariance)
    )


def _misfit(
    equations: Equations, point: Point, hat: Callable[[BandFactor, Array, Index, Array], Array]
) -> _Misfit:
    """
    Args:
        hat: computes tr W P of each link.
    """
    problem, layout = equations.problem, equations.layout
    odometry = problem.odometry
    system = equations.weighed(point.poses, point.calibration, point.threshold)
    factor = BandFactor.of(system)
    error = pose_errors(point.poses, odometry, corrected(odometry, point.calibration))
    squares: Array = np.einsum("ki,kij,kj->k", error, odometry.information, error)
    if factor is None:
        return _Misfit(squares, np.zeros(len(odometry)))
    jacobian = linearised.odometry_jacobian(problem, point.poses)
    share = hat(factor, jacobian, layout.odometry_unknowns(odometry), odometry.information)
    return _Misfit(squares, 3 - share)


def _hat(factor: BandFactor, jacobian: Array, unknowns: Index, information: Array) -> Array:
    """(m,)"""
    covariance = jacobian @ factor.covariance_blocks(unknowns) @ np.swapaxes(jacobian, 1, 2)
    return np.asarray(np.einsum("kij,kji->k", information, covariance))


def _guessed_hat(
    factor: BandFactor, jacobian: Array, unknowns: Index, information: Array
) -> Array:
    """(m,) the same by Hutchinson's estimate, good for sums over many links.

    The signs are the same for everybody who has the same problem.
    """
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(jacobian), 3, PROBES))
    root = np.linalg.cholesky(information)
    whitened = np.swapaxes(root, 1, 2) @ jacobian
    size = len(factor.halfway) + len(factor.schur)
    sums = np.zeros((size, PROBES))
    each = (np.swapaxes(whitened, 1, 2) @ signs).reshape(-1, PROBES)
    for probe in range(PROBES):
        sums[:, probe] = np.bincount(unknowns.ravel(), each[:, probe], size)
    spread = factor.solved(sums)
    if spread is None:
        return np.full(len(jacobian), 3.0)
    seen: Array = signs * (whitened @ spread[unknowns])
    return np.asarray(seen.sum(axis=(1, 2)) / PROBES)
