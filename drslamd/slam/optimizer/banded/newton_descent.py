"""Newton's steps down the cost of the team's problem."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from drslamd.slam import headway
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.turning.chart import AROUND, TurningChart
from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE, WEIGHT, WHOLE
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array

FIRST_DAMPING = 1e-6
"""Of Levenberg and Marquardt, relative to the diagonal; less after each step that helped."""
LITTLE_DAMPING = 1e-10
"""Instead, where a descent may begin at its end but for a second of driving: enough against
rounding. What is damped converges slowly along the bends of a whole way, which little holds."""
NO_DAMPING = 1e-14
"""Where a team turns: any more would hold it as much as what is measured does, and hide in short
steps how far it has to go."""
MOST_DAMPING = 1e6
"""Beyond it no step helps."""
CURVATURES = (WHOLE, LEAST_CURVATURE, WEIGHT)
"""What heavy tails have at least, from near the solution to far from it."""
FAR = 0.3
"""m and rad that a step moves neighbours in time beside each other: where it is more, second
derivatives say little of the cost ..."""
CHEAP = 1.0
"""... unless the step was to bring less than that: a sigma, wherever that leads."""
NEAR = 0.03
"""m and rad likewise: after a shorter step the matrix hardly changes, and serves for the next one
too ..."""
TURNS = 3.0
"""Times as far as beside its neighbours a pose is moved where the team turns. What holds a turn is
so little that second derivatives of all that is pulled at are as much, see `add_curvature`."""
FASTER = 0.25
"""... while each step is so much shorter than the one before it."""
TOLERANCE = 1e-6
"""m and rad: largest step after which the solution counts as reached, then a third of that away.
So robots that hold the same graph have the same answer wherever they started from."""


def descend(
    equations: Equations,
    start: Calibration,
    most: int,
    tolerance: float = TOLERANCE,
    is_near: bool = False,
) -> Point:
    """From the initial poses of a problem to its least cost, or as near as it goes.

    Args:
        start: calibration to start from.
        most: bound on steps.
        tolerance: see `TOLERANCE`.
        is_near: is this the solution of a second ago, for all we know? If a step with hardly any
            damping is long or in vain, it is begun as from anywhere.
    """
    problem, layout = equations.problem, equations.layout
    point = Point.of(problem, problem.initial.copy(), start)
    factor: BandFactor | None = None
    damping = LITTLE_DAMPING if is_near else FIRST_DAMPING
    level, size, steps, converged = 1, np.inf, 0, False
    is_far, is_turning, is_exact = not is_near, False, False
    while steps < most and not converged and damping < MOST_DAMPING:
        steps += 1
        headway.mark()
        is_kept = factor is not None
        if factor is None:
            system, gradient = equations.at(point, CURVATURES[level])
            is_exact = is_turning and level == 0
            if is_exact:
                equations.add_curvature(system, point, gradient)
            factor = BandFactor.of(system, damping)
        else:
            gradient = equations.gradient(point)
        step = None if factor is None else factor.solved(-gradient)
        if step is None or not np.isfinite(step).all():
            (damping, level), factor = _stiffer(damping, level, 0.0, is_near), None
            is_far, is_near = is_far or is_near, False
            continue
        chart = _chart(problem, point, is_far, is_exact)
        new, moved = _after(problem, layout, point, chart, step)
        before, size = size, float(np.abs(step[layout.poses]).max())
        if (is_near and moved.metres > FAR) or not (is_kept or _is_better(equations, new, point)):
            (damping, level), factor = _stiffer(damping, level, moved.metres, is_near), None
            size = before if is_near else size
            is_far, is_near = is_far or is_near, False
            continue
        is_turning = is_turning or (not is_far and size > TURNS * moved.own)
        is_cheap = -float(gradient @ step) < CHEAP
        level = 0 if moved.metres < NEAR or is_cheap else 1 if moved.metres < FAR else 2
        is_far = level == 2
        is_due = is_turning and not is_exact
        if moved.metres > NEAR or size > FASTER * before or is_due:
            damping, factor = min(damping / 10, NO_DAMPING if is_due else np.inf), None
        point, converged = new, size < tolerance and not is_due
    return replace(point, steps=steps, converged=converged)


class _Moved(NamedTuple):
    """How far a step goes, m and rad.

    Attributes:
        own: by which poses move beside their neighbours in time; metres: that, or a sensor.
    """

    own: float
    metres: float


def _chart(problem: Problem, point: Point, is_far: bool, is_exact: bool) -> TurningChart | None:
    """In which a step is made: straight on from afar, to stay in the valley where it began; that of
    `Equations.add_curvature`; or one that follows no heading alone."""
    if is_far:
        return None
    around = 0 if is_exact else AROUND * len(problem.priors.scale)
    return TurningChart(point.poses, problem.gauge, around)


def _after(
    problem: Problem, layout: BandLayout, point: Point, chart: TurningChart | None, step: Array
) -> tuple[Point, _Moved]:
    """Where a step leads from a point."""
    poses, sensors = step[layout.poses], layout.calibration(step)
    after = chart.poses(poses) if chart else point.poses + poses
    own = chart.own_size(poses) if chart else float(np.abs(poses).max())
    new = Point.of(problem, after, point.calibration.plus(sensors))
    return new, _Moved(own, max(own, _metres_of_sensors(sensors)))


def _metres_of_sensors(step: Calibration) -> float:
    """How far a step moves a bias or an antenna at most: ranges feel it as they feel a pose."""
    return float(np.abs(np.append(step.bias, step.antenna)).max(initial=0.0))


def _stiffer(damping: float, level: int, size: float, is_near: bool = False) -> tuple[float, int]:
    """After a step of such a size that did not help: another curvature, then more damping; and from
    the beginning where it was taken for near."""
    if is_near:
        return FIRST_DAMPING, 1
    most = 2 if size > FAR else 1
    return (damping, level + 1) if level < most else (10 * damping, level)


def _is_better(equations: Equations, new: Point, than: Point) -> bool:
    """Does all together cost no more than before, rounding apart?"""
    before = equations.cost(than, than.threshold)
    return equations.cost(new, than.threshold) <= before + 1e-12 * (1 + abs(before))
