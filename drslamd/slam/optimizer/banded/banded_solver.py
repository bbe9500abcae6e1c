"""Module 3, default: the team's graph solved exactly, because ordered by time it is a band.

The Gauss-Newton Hessian of the team has a half-bandwidth of about 3 R for R robots (`layout`), so
one banded Cholesky factorisation solves it exactly in linear time. The border is eliminated by its
Schur complement.

The cost of a step grows with the cube of the number of robots; up to about a dozen robots in one
connected group it stays below the cost of linearising.
"""

from __future__ import annotations

import numpy as np

from drslamd.slam import se2
from drslamd.slam.optimizer.banded import claims
from drslamd.slam.optimizer.banded.explanation import explain
from drslamd.slam.optimizer.banded.misfit import contradicted
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.odometry_levels import raised
from drslamd.slam.optimizer.banded.solution import Solution
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array

SETTLED = 1e-7
"""m and rad: the last step of a solution that is the same, to a tenth of it, from wherever it was
begun."""


def solve(
    problem: Problem,
    start: Calibration | None = None,
    marginals: tuple[int, ...] = (),
    most: int = 30,
    tolerance: float = TOLERANCE,
) -> Solution:
    """The solution as configured; where odometry cannot have been so, with what it deserves.

    Whatever the factors say, there is a solution; when they make no sense, or leave poses loose, it
    is the best that was met and does not count as converged.

    Args:
        problem: one connected group.
        start: calibration to start from (zero when left out).
        marginals: poses whose joint covariance is wanted.
        most: bound on steps.
        tolerance: see `newton_descent.TOLERANCE`.
    """
    equations = Equations(problem)
    start = start or Calibration.zero(problem.pairs, len(problem.priors.scale))
    nominal = descend(equations, start, most, tolerance)
    explained = explain(equations, nominal, most, tolerance)
    equations, point = explained.equations, explained.point
    problem = equations.problem
    poses: Array = point.poses.copy()
    poses[:, 2] = se2.wrap(poses[:, 2])
    scatter = claims.scatter_of(problem, point)
    feared = Equations(raised(problem, explained.feared, point), like=equations)
    wanted = np.array(marginals, dtype=int)
    joint, spread = claims.covariances(feared, point, scatter, wanted)
    if explained.other is not None:
        joint += claims.disagreement(point, explained.other, wanted)
    return Solution(
        poses,
        point.calibration,
        cost=equations.cost(point, point.threshold),
        iterations=nominal.steps,
        converged=nominal.converged,
        scatter=scatter,
        joint=joint,
        spread=spread,
        odometry_level=explained.level,
        feared_level=np.sqrt(explained.feared),
        late_level=np.sqrt(explained.lately),
        is_explained=explained.other is None,
        contradicted=contradicted(problem, point),
        doubted=claims.still_doubted(problem.doubted, point.calibration, spread),
    )
