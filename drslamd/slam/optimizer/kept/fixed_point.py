"""Steps down the exact gradient by a matrix that is only near the right one.

Each step x -> x + F(x) with F = -M^-1 g brings an error down by how far M is off. Anderson's mixing
of the last steps makes that faster: the combination of them whose next step would be the shortest,
measured by M (Walker and Ni, SIAM J. Numer. Anal. 49, 2011). Since M F = -g, products by M cost
nothing: (F_i, F_j)_M = -F_i' g_j.

The end is where the gradient is zero, whatever M is. x are steps of a `TurningChart` from where M
was made, in which M stays right however the team has been turned as a whole since.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drslamd.slam import headway
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.turning.chart import AROUND, TurningChart
from drslamd.slam.optimizer.kept.exact_gradient import exact_gradient
from drslamd.slam.optimizer.kept.kept_factor import Current
from drslamd.slam.se2 import Array

DEPTH = 3
"""Earlier steps that are mixed."""
MOST = 12
"""Steps; a matrix that needs more is no longer near."""
FARTHEST = 0.5
"""m and rad: whoever has to go farther begins with a matrix of where he is."""


def approach(
    equations: Equations, start: Point, matrix: Current, tolerance: float, most: int = MOST
) -> Point | None:
    """The solution near a point; None where it is not reached.

    Args:
        equations: in the layout of `BandLayout.flat`.
        tolerance: m and rad of the last step, see `newton_descent.TOLERANCE`.
    """
    problem, layout = equations.problem, equations.layout
    chart = TurningChart(matrix.poses, problem.gauge, AROUND * len(problem.priors.scale))
    point, at = start, layout.vector(chart.step(start.poses), start.calibration)
    places: list[Array] = []
    steps: list[Array] = []
    gradients: list[Array] = []
    for count in range(most):
        headway.mark()
        gradient = exact_gradient(equations, point)
        gradient[layout.poses] = chart.pulled(gradient[layout.poses], at[layout.poses])
        step = matrix.solved(-gradient)
        size = float(np.abs(step[layout.poses]).max())
        if not (np.isfinite(size) and chart.own_size(step[layout.poses]) < FARTHEST):
            return None
        places, steps, gradients = (
            [*kept[-DEPTH:], new]
            for kept, new in ((places, at), (steps, step), (gradients, gradient))
        )
        at = at + step if size < tolerance else _mixed(places, steps, gradients)
        poses, calibration = chart.poses(at[layout.poses]), layout.calibration(at)
        point = Point.of(problem, poses, calibration, steps=count + 1)
        if size < tolerance:
            is_lower = equations.cost(point, start.threshold) <= equations.cost(
                start, start.threshold
            ) * (1 + 1e-9)
            return replace(point, converged=True) if is_lower else None
    return None


def _mixed(places: list[Array], steps: list[Array], gradients: list[Array]) -> Array:
    """Where to go on from."""
    next_place = places[-1] + steps[-1]
    if len(steps) < 2:
        return next_place
    moved = np.diff(np.stack(steps), axis=0)
    pulled = np.diff(np.stack(gradients), axis=0)
    gram = -moved @ pulled.T
    gram = (gram + gram.T) / 2
    wanted = -moved @ gradients[-1]
    share = np.linalg.lstsq(gram, wanted, rcond=1e-10)[0]
    went = np.diff(np.stack(places), axis=0)
    return np.asarray(next_place - share @ (went + moved))
