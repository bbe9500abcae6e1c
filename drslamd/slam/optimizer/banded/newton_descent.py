"""Newton's steps down the cost of the team's problem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drslamd.slam import headway
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE, WEIGHT, WHOLE
from drslamd.slam.optimizer.sensor_priors import Calibration

FIRST_DAMPING = 1e-6
"""Of Levenberg and Marquardt, relative to the diagonal; less after each step that helped."""
LITTLE_DAMPING = 1e-10
"""Instead, where a descent may begin at its end but for a second of driving: enough against
rounding. What is damped converges slowly along the bends of a whole way, which little holds."""
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
    while steps < most and not converged and damping < MOST_DAMPING:
        steps += 1
        headway.mark()
        is_kept = factor is not None
        if factor is None:
            system, gradient = equations.at(point, CURVATURES[level])
            factor = BandFactor.of(system, damping)
        else:
            gradient = equations.gradient(point)
        step = None if factor is None else factor.solved(-gradient)
        if step is None or not np.isfinite(step).all():
            (damping, level), factor = _stiffer(damping, level, 0.0, is_near), None
            is_near = False
            continue
        poses = point.poses + step[layout.poses]
        moved = layout.calibration(step)
        before, size = size, float(np.abs(step[layout.poses]).max())
        new = Point.of(problem, poses, point.calibration.plus(moved))
        metres = max(size, _metres_of_sensors(moved))
        is_far = is_near and metres > FAR
        if is_far or not (is_kept or _is_better(equations, new, point)):
            (damping, level), factor = _stiffer(damping, level, metres, is_near), None
            size, is_near = (before if is_near else size), False
            continue
        level = 0 if metres < NEAR else 1 if metres < FAR else 2
        if metres > NEAR or size > FASTER * before:
            damping, factor = damping / 10, None
        point, converged = new, size < tolerance
    return replace(point, steps=steps, converged=converged)


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
