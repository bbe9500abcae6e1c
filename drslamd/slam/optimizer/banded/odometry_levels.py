"""How much worse than configured odometry was, robot by robot and moment by moment.

A robot whose odometry does not fit (`misfit`) slipped, was stuck, or is otherwise not as
configured. Its noise is raised until the misfit is as it should be: first all along its way, then
cell by cell of time as far as each cell asks for it, so that a moment of slip is believed less and
the rest as before. Each time the team is solved again. Where one or two robots explain it all, the
others are as configured.

Long-lasting errors of ranges look alike. What tells them apart: with the right stretches raised
hardly any range is an outlier any more, and a robot that is wrong contradicts more than one other.
Else nobody can say who is wrong; then the poses stay what they were, and only their covariances
grow.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.misfit import (
    FEW_OUTLIERS,
    Misfit,
    Run,
    misfit,
    outlier_share,
)
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array, Index

STANDS_OUT = 4.0
"""s / g of a robot with a fault; as modelled it is 0.1 to 1.8, with a fault 5 to 90."""
TARGET = 2.5
"""s / g that levels bring about: what is left is no worse than the worst that is modelled."""
CELL = 20
"""Steps of the keyframes' grid: a wheel that slips does so for seconds."""
MEMORY = 200
"""Steps of the grid; ranges need some metres of driving to show what odometry did."""
BEFORE = 30
"""Steps of the grid by which a fault may be older than the first range that shows it."""
DOUBT_OF_CELL = 0.1
"""Degrees of freedom that hold a cell at its nominal noise."""
BESIDE = 0.3
"""Of the worst s / g: a robot below that is believed until the worst ones are not."""
MOST_TRIED = 2
"""Robots that may be to blame for all of it."""
ROUNDS_OF_ROBOTS = 5
ROUNDS_OF_CELLS = 8
SETTLED = 0.1
"""Of log variance: levels that move less are done."""
STEPS_OF_ROUND = 10
ROUGH = 1e-3
"""m and rad, while levels are sought; the last solution is as exact as every other."""
FIRST_LEVEL = 20.0
"""Where a run of outliers says that something happened; it falls as far as it may."""
MOST_LEVEL = 40.0
"""Times the nominal sigma; more says nothing about the way at all."""
FLOOR = np.array([0.004, 0.004, 0.004]) ** 2
"""m^2 and rad^2 that a raised link has at least, over its level: who is stuck measures no way, and
no way has no noise."""
LONG_RUN = 30
"""Outliers of one pair; a wall is passed sooner."""


@dataclass(frozen=True)
class Levels:
    """
    Attributes:
        point: the solution with odometry as far as it deserves to be believed.
        seen: (m,) variance of each link over the nominal one, as far as it was seen.
        feared: (m,) likewise, as far as it must be feared: who slipped before may again.
        lately: (m,) likewise, of the last seconds only.
        is_odometry: does this explain what was measured?
    """

    point: Point
    seen: Array
    feared: Array
    lately: Array
    is_odometry: bool


def levelled(
    equations: Equations,
    nominal: Point,
    ratio: Array,
    found: list[Run],
    most: int,
    tolerance: float,
) -> Levels:
    """Who must be believed less for the rest to make sense?

    Args:
        nominal: the solution as configured; ratio: (robots,) its s / g; found: its runs of
            outliers.
        most, tolerance: of the final solution, see `descend`.
    """
    problem = equations.problem
    robot = problem.odometry.robot
    level, point = _robots_raised(equations, nominal, ratio)
    start = np.maximum(level[robot], _run_level(problem, found))
    seen, point = _fewest_blamed(equations, *_cells_settled(equations, point, start))
    level = np.where(np.bincount(robot, seen > 1.0, len(level)) > 0, level, 1.0)
    believed = Equations(raised(problem, seen, point), like=equations)
    point = descend(believed, point.calibration, most, tolerance)
    lately, so_far = _lingering(problem, seen)
    lately = np.maximum(lately, level[robot])
    return Levels(
        point,
        seen,
        feared=TARGET * np.maximum(lately, so_far),
        lately=TARGET * lately,
        is_odometry=bool(
            point.converged
            and outlier_share(problem, point).max(initial=0) < FEW_OUTLIERS
            and ((ratio > STANDS_OUT).any() or _is_one_robot(found))
        ),
    )


def _robots_raised(equations: Equations, point: Point, ratio: Array) -> tuple[Array, Point]:
    """(robots,) variance over the nominal one that brings each ratio down, all along its way."""
    robot, level = equations.problem.odometry.robot, np.ones(len(ratio))
    if not (ratio > STANDS_OUT).any():
        return level, point
    for _ in range(ROUNDS_OF_ROBOTS):
        # whoever contradicts all others makes them look bad too
        worst = (ratio > TARGET) & (ratio >= ratio.max() * BESIDE)
        raise_by = np.where(worst, 2 * ratio / TARGET, 1.0)
        level = np.minimum(level * raise_by, MOST_LEVEL**2)
        point, now = _solved(equations, level[robot], point)
        ratio = now.ratio(robot, len(ratio))
        if not (ratio > TARGET).any():
            break
    return level, point


def _run_level(problem: Problem, found: list[Run]) -> Array:
    """(m,) what a run of outliers makes of the links that may be the cause."""
    odometry = problem.odometry
    level = np.ones(len(odometry))
    count = _runs_of(found)
    most = max(count.values(), default=0)
    for run in found:
        # where outliers of two pairs meet in one robot, their other ends are witnesses
        for robot, n in ((run.i, run.n_i), (run.j, run.n_j)):
            if count[robot] < most:
                continue
            since = problem.n[odometry.j] >= n - BEFORE
            level[since & (odometry.robot == robot)] = FIRST_LEVEL**2
    return level


def _is_one_robot(found: list[Run]) -> bool:
    """Do outliers of two pairs meet in one robot, or do those of one pair last very long?"""
    meet = any(count > 1 for count in _runs_of(found).values())
    return meet or any(run.count >= LONG_RUN for run in found)


def _runs_of(found: list[Run]) -> Counter[int]:
    """In how many runs of outliers each robot is."""
    return Counter(end for run in found for end in (run.i, run.j))


def _fewest_blamed(equations: Equations, seen: Array, point: Point) -> tuple[Array, Point]:
    """The same with as few robots as explain it no worse: beside one with a fault a few links of
    the others seem wrong too, and nobody is to be doubted for that."""
    problem, robot = equations.problem, equations.problem.odometry.robot
    robots = len(problem.priors.scale)
    blame = np.bincount(robot, np.log(seen), robots)
    if (outlier_share(problem, point) >= FEW_OUTLIERS).any():
        return seen, point  # odometry alone does not explain it, so it is not for us to say whose
    for count in range(1, min(int(np.count_nonzero(blame)), MOST_TRIED + 1)):
        alone = np.isin(robot, np.argsort(-blame)[:count])
        fewer, near = _cells_settled(equations, point, np.where(alone, seen, 1.0), alone)
        near, now = _solved(equations, fewer, near)
        fits = now.ratio(robot, robots) <= STANDS_OUT
        if fits.all() and (outlier_share(problem, near) < FEW_OUTLIERS).all():
            return fewer, near
    return seen, point


def _cells_settled(
    equations: Equations, point: Point, variance: Array, asked: NDArray[np.bool_] | None = None
) -> tuple[Array, Point]:
    """(m,) the variance over the nominal one that every cell of time asks for.

    Args:
        asked: (m,) links of which it may be another one than it is; all of them by default.
    """
    problem, odometry = equations.problem, equations.problem.odometry
    names = np.stack([odometry.robot, problem.n[odometry.j] // CELL])
    cell = np.unique(names, axis=1, return_inverse=True)[1].ravel()
    for _ in range(ROUNDS_OF_CELLS):
        point, now = _solved(equations, variance, point)
        wanted = _wanted(now, variance, cell)
        wanted = wanted if asked is None else np.where(asked, wanted, variance)
        if np.abs(np.log(wanted / variance)).max(initial=0.0) < SETTLED:
            break
        variance = wanted
    return variance, point


def _wanted(now: Misfit, variance: Array, cell: Index) -> Array:
    """(m,) the variance that each link should have had, over the nominal one."""
    s, g = np.bincount(cell, now.squares), np.bincount(cell, now.checked)
    had = np.zeros(len(s))
    had[cell] = variance
    ratio = (s / TARGET + DOUBT_OF_CELL / had) / (g + DOUBT_OF_CELL)
    wanted: Array = np.clip(had * ratio, 1.0, MOST_LEVEL**2)
    return wanted[cell]


def _lingering(problem: Problem, variance: Array) -> tuple[Array, Array]:
    """(m,) what was seen, and what went on before: it takes time until it is seen.

    And (m,) the mean of all that went on until then.
    """
    odometry = problem.odometry
    lately, so_far = variance.copy(), variance.copy()
    for robot in range(len(problem.priors.scale)):
        mine = np.flatnonzero(odometry.robot == robot)
        mine = mine[np.argsort(problem.n[odometry.j[mine]])]
        n, sums = problem.n[odometry.j[mine]], np.append(0.0, np.cumsum(variance[mine]))
        first = np.searchsorted(n, n - MEMORY)
        after = np.arange(len(mine)) + 1
        mean: Array = (sums[after] - sums[first]) / (after - first)
        lately[mine] = np.maximum(variance[mine], mean)
        so_far[mine] = sums[after] / after
    return lately, so_far


def _solved(equations: Equations, variance: Array, near: Point) -> tuple[Point, Misfit]:
    believed = Equations(raised(equations.problem, variance, near), like=equations)
    point = descend(believed, near.calibration, STEPS_OF_ROUND, ROUGH)
    factor = BandFactor.of(believed.weighed(point))
    if factor is None:
        return point, Misfit.unknown(len(variance))
    return point, misfit(believed, point, factor)


def raised(problem: Problem, variance: Array, near: Point) -> Problem:
    """The problem with odometry that is believed otherwise, to be solved from a point near by."""
    odometry = problem.odometry
    floor = np.maximum(variance - 1, 0.0)[:, None] * FLOOR
    covariance = odometry.covariance * variance[:, None, None] + floor[:, :, None] * np.eye(3)
    believed = replace(odometry, covariance=covariance)
    return replace(problem, initial=near.poses, odometry=believed)
