"""How much worse than configured the odometry of a whole team was, by what all of it says together.

Wheels that slip a little now and then leave in each robot too little to stand out (`misfit`), and
whoever looks for the moment and the robot finds a wrong one. But the ground is the same for all,
and one number for everybody is well known long before: the factor k of all variances of odometry
under which the ranges are likeliest, whatever the poses (the evidence, by Laplace's approximation):

    -2 log p(ranges | k) = cost at the solution + log det of its matrix and of the covariances

It falls from k = 1 on just where the squares of all links come to more than they should. As
modelled that does not happen; where one robot alone explains it better, only that one is believed
less.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.misfit import Misfit, guessed_misfit, ratio_of
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.odometry_levels import ROUGH, STEPS_OF_ROUND, raised
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array

ASKS = 1.25
"""s / g of all robots together above which it is looked into; as modelled it is below 1."""
STEP = 2.0
"""From one factor that is tried to the next."""
MOST = 32.0
"""Nearly six times the sigma; where so much is asked for it is no slip."""
CLEAR = 1.0
"""Of -2 log p that a factor must bring; as modelled it brings nothing."""
ALONE = 10.0
"""By so much more than everybody one robot must explain, for the others to be as configured; where
all slip one explains up to 6 more by chance."""
FEWEST = 3
"""Robots: of two nobody can tell who it was."""
TAILS = 4.0
"""Slip is a few large errors and not many small ones: how many times what is likeliest beside the
configured variance is feared."""


@dataclass(frozen=True)
class CommonLevel:
    """
    Attributes:
        variance: (m,) of links of odometry, over the configured one.
        point: the solution with that.
        gain: by how much -2 log p fell.
        ratio: (robots,) s / g there.
        is_alone: is it of one robot only?
    """

    variance: Array
    point: Point
    gain: float
    ratio: Array
    is_alone: bool


def pooled(problem: Problem, found: Misfit) -> float:
    """s / g of all robots together, without what is known to have stood or spun."""
    counts = np.ones(len(problem.odometry), dtype=bool)
    for freed in problem.freed:
        counts[freed.links] = False
    s, g = found.squares[counts].sum(), found.checked[counts].sum()
    return float(ratio_of(s, g))


def common_level(
    equations: Equations, nominal: Point, most: int, tolerance: float
) -> CommonLevel | None:
    """None where odometry as configured is as likely.

    Args:
        nominal: the solution as configured.
        most, tolerance: of the final solution, see `descend`.
    """
    problem = equations.problem
    before = _surprise(equations, nominal, nominal.threshold)
    if before is None:
        return None
    links = problem.odometry.robot
    everybody = np.ones(len(links), dtype=bool)
    variance, gain, near = _likeliest(equations, nominal, before, everybody)
    if gain < CLEAR:
        return None
    robots, is_alone = len(problem.priors.scale), False
    if robots >= FEWEST:
        worst = _worst(equations, nominal, robots)
        alone, more, beside = _likeliest(equations, nominal, before, links == worst)
        is_alone = more >= gain + ALONE
        if is_alone:
            variance, gain, near = alone, more, beside
    if variance.max() > 0.99 * MOST:
        return None  # more would be as likely
    believed = Equations(raised(problem, variance, near), like=equations)
    point = descend(believed, near.calibration, most, tolerance)
    factor = BandFactor.of(believed.weighed(point))
    if factor is None or not point.converged:
        return None
    ratio = guessed_misfit(believed, point, factor).ratio(links, robots)
    return CommonLevel(variance, point, gain, ratio, is_alone)


def _worst(equations: Equations, nominal: Point, robots: int) -> int:
    """Whose odometry fits least."""
    factor = BandFactor.of(equations.weighed(nominal))
    assert factor is not None
    found = guessed_misfit(equations, nominal, factor)
    excess = np.bincount(equations.problem.odometry.robot, found.squares - found.checked, robots)
    return int(excess.argmax())


def _likeliest(
    equations: Equations, nominal: Point, before: float, who: NDArray[np.bool_]
) -> tuple[Array, float, Point]:
    """(m,) the likeliest variances over those configured, of some links, the gain, and a solution
    near by."""
    logs, surprises, points = [0.0], [before], [nominal]
    for factor, surprise, point in _tried(equations, nominal, who):
        logs.append(np.log(factor))
        surprises.append(surprise)
        points.append(point)
        if surprise > surprises[-2]:
            break
    at = int(np.argmin(surprises))
    log, gain = logs[at], before - surprises[at]
    if 0 < at < len(logs) - 1:
        # the vertex of the parabola through the best and those beside it
        left, here, right = surprises[at - 1 : at + 2]
        log += np.log(STEP) * (left - right) / (2 * (left - 2 * here + right))
    return np.where(who, np.exp(log), 1.0), gain, points[at]


def _tried(
    equations: Equations, nominal: Point, who: NDArray[np.bool_]
) -> Iterator[tuple[float, float, Point]]:
    """Factors, -2 log p of each but for a constant, and solutions; as long as there are any."""
    factor, near = STEP, nominal
    while factor <= MOST:
        problem = raised(equations.problem, np.where(who, factor, 1.0), near)
        believed = Equations(problem, like=equations)
        point = descend(believed, near.calibration, STEPS_OF_ROUND, ROUGH)
        surprise = _surprise(believed, point, nominal.threshold)
        if surprise is None:
            return
        yield factor, surprise, point
        factor, near = factor * STEP, point


def _surprise(equations: Equations, point: Point, threshold: Array) -> float | None:
    """-2 log p of what was measured, but for a constant; None of a matrix that is none.

    Args:
        threshold: see `Equations.cost`.
    """
    factor = BandFactor.of(equations.weighed(point))
    if factor is None:
        return None
    sign, corner = np.linalg.slogdet(factor.schur)
    if sign <= 0:
        return None
    matrix = 2 * float(np.log(factor.lower[0]).sum()) + float(corner)
    noise = float(np.linalg.slogdet(equations.problem.odometry.covariance)[1].sum())
    return equations.cost(point, threshold) + matrix + noise
