"""Newton's steps down the cost of the team's problem."""

from __future__ import annotations

import numpy as np

from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Calibration

LEAST_DAMPING = 1e-6
"""Of Levenberg and Marquardt, relative to the diagonal."""
MOST_DAMPING = 1e6
"""Beyond it no step helps."""
NEAR = 0.03
"""m and rad: after a shorter step the matrix hardly changes, and serves for the next one too ..."""
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
) -> Point:
    """From the initial poses of a problem to its least cost, or as near as it goes.

    Args:
        start: calibration to start from.
        most: bound on steps.
        tolerance: see `TOLERANCE`.
    """
    problem, layout = equations.problem, equations.layout
    point = Point.of(problem, problem.initial.copy(), start)
    factor: BandFactor | None = None
    damping, size, steps, converged = LEAST_DAMPING, np.inf, 0, False
    while steps < most and not converged and damping < MOST_DAMPING:
        steps += 1
        is_kept = factor is not None
        if factor is None:
            system, gradient = equations.at(point)
            factor = BandFactor.of(system, damping)
        else:
            gradient = equations.gradient(point)
        step = None if factor is None else factor.solved(-gradient)
        if step is None or not np.isfinite(step).all():
            damping, factor = 10 * damping, None
            continue
        poses = point.poses + step[layout.poses]
        calibration = point.calibration.plus(layout.calibration(step))
        before, size = size, float(np.abs(step[layout.poses]).max())
        new = Point.of(problem, poses, calibration, steps, size < tolerance)
        if not is_kept and not _is_better(equations, new, point):
            damping, factor = 10 * damping, None
            continue
        if size > NEAR or size > FASTER * before:
            damping, factor = damping / 10, None
        point, converged = new, new.converged
    return point


def _is_better(equations: Equations, new: Point, than: Point) -> bool:
    """Does all together cost no more than before, rounding apart?"""
    before = equations.cost(than, than.threshold)
    return equations.cost(new, than.threshold) <= before + 1e-12 * (1 + abs(before))
