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
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.explanation import Explanation, explain
from drslamd.slam.optimizer.banded.lapses.known_lapses import still_freed
from drslamd.slam.optimizer.banded.lapses.stretches import under
from drslamd.slam.optimizer.banded.misfit import contradicted, many_wrong
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.odometry_levels import FIRST_LEVEL, raised
from drslamd.slam.optimizer.banded.pairs import narrowing
from drslamd.slam.optimizer.banded.sight.hidden import blocked
from drslamd.slam.optimizer.banded.solution import Solution
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array, Index

SETTLED = 1e-7
"""m and rad: the last step of a solution that is the same, to a tenth of it, from wherever it was
begun."""


def solve(
    problem: Problem,
    start: Calibration | None = None,
    marginals: tuple[int, ...] = (),
    most: int = 30,
    tolerance: float = TOLERANCE,
    known: Array | None = None,
) -> Solution:
    """The solution as configured; where odometry cannot have been so, with what it deserves.

    Whatever the factors say, there is a solution; when they make no sense, or leave poses loose, it
    is the best that was met and does not count as converged.

    Args:
        problem: one connected group.
        start: calibration to start from (zero when left out).
        marginals: poses whose joint covariance is wanted.
        most: bound on steps; tolerance: see `newton_descent.TOLERANCE`.
        known: `Solution.shares` that hold still.
    """
    equations, before = Equations(problem), len(problem.freed)
    start = start or Calibration.zero(problem.pairs, len(problem.priors.scale))
    # who was solved before is most often where he was, but for a second of driving
    nominal = descend(equations, start, most, tolerance, is_near=problem.fitted is not None)
    explained = explain(equations, nominal, most, tolerance)
    equations, point, problem = explained.equations, explained.point, explained.equations.problem
    scatter = claims.scatter_of(problem, point)
    feared = Equations(raised(problem, explained.feared, point), like=equations)
    wanted, freed = np.array(marginals, dtype=int), still_freed(problem, point)
    joint, spread, biases = claims.covariances(feared, point, scatter, wanted)
    is_same = len(freed) == len(problem.freed) == before
    doubted = tuple(one for one in freed if not one.is_settled)
    late = FIRST_LEVEL * under(problem, doubted, after_s=np.inf)
    # nobody goes on from a solution with other stretches freed as from one that is as modelled
    news = FIRST_LEVEL * under(problem, doubted if is_same else problem.freed)
    level = np.maximum(explained.level, news)
    if explained.other is not None:
        joint += claims.disagreement(point, explained.other, wanted)
    return Solution(
        np.column_stack([point.poses[:, :2], se2.wrap(point.poses[:, 2])]),
        point.calibration,
        cost=equations.cost(point, point.threshold),
        iterations=nominal.steps,
        converged=nominal.converged or problem.blocked is not None,
        scatter=scatter,
        joint=joint,
        shares=_shares(explained, joint, biases, wanted, known),
        spread=spread,
        bias_sigmas=biases,
        odometry_level=level,
        feared_level=np.maximum(np.sqrt(explained.feared), news),
        late_level=np.maximum(np.sqrt(explained.lately), late),
        is_explained=explained.other is None,
        is_as_modelled=_is_as_modelled(explained, level),
        contradicted=contradicted(problem, point),
        blocked=blocked(problem, point),
        doubted=claims.still_doubted(problem.doubted, point.calibration, spread),
        freed=freed,
    )


def _shares(
    explained: Explanation,
    joint: Array,
    biases: Array,
    wanted: Index,
    known: Array | None = None,
) -> Array:
    """See `Solution.shares`: where all is as modelled.

    Args:
        biases: (pairs,) how wrong they may be, m.
    """
    equations, point, ratio = explained.equations, explained.point, explained.ratio
    if ratio is None or not narrowing.may_narrow(equations.problem, len(wanted)):
        return np.ones((0, 0))
    if known is not None:
        return known
    factor = BandFactor.of(equations.weighed(point))
    seen = factor and narrowing.seen_noise(equations, point, factor, ratio, biases)
    if not seen:
        return np.ones((0, 0))
    problem = seen.of_biases(equations.problem)
    feared = raised(problem, seen.feared[problem.odometry.robot], point)
    narrow = claims.covariances(Equations(feared, like=equations), point, seen.scatter, wanted)[0]
    return narrowing.shares(point.poses[wanted], joint, narrow)


def _is_as_modelled(explained: Explanation, level: Array) -> bool:
    """
    Args:
        level: (m,) sigmas of odometry over what is configured.
    """
    problem = explained.equations.problem
    if explained.other is not None or problem.blocked is not None or (level > 1).any():
        return False
    return not many_wrong(problem, explained.point)
