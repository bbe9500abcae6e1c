"""Module 3, default: the team's graph solved exactly, because ordered by time it is a band.

The Gauss-Newton Hessian of the team has a half-bandwidth of about 3 R for R robots
(`normal_equations`), so one banded Cholesky factorisation solves it exactly in linear time. The
border is eliminated by its Schur complement. The factorisation also yields the marginal
covariances of the poses that are asked for.

The cost of a step grows with the cube of the number of robots; up to about a dozen robots in one
connected group it stays below the cost of linearising.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from drslamd.slam import se2
from drslamd.slam.normal_equations import Equations, Layout, System
from drslamd.slam.problem import Calibration, Problem, Solution
from drslamd.slam.se2 import Array

LEAST_DAMPING, MOST_DAMPING = 1e-6, 1e6
"""Of Levenberg and Marquardt, relative to the diagonal; beyond the largest no step helps."""
UNKNOWN = 1e6
"""m^2 and rad^2: the covariance of a pose that nothing holds."""


def solve(
    problem: Problem,
    start: Calibration | None = None,
    marginals: tuple[int, ...] = (),
    most: int = 30,
    tolerance: float = 5e-4,
) -> Solution:
    """Levenberg-Marquardt to convergence.

    Whatever the edges say, there is a solution; when they make no sense, or leave poses loose, it
    is the best that was met and does not count as converged.

    Args:
        problem: one connected group.
        start: calibration to start from (zero when left out).
        marginals: poses whose covariance is wanted.
        most: bound on iterations.
        tolerance: largest step, m and rad, after which the solution counts as reached; the
            default is far below every noise, and the next solve goes on from there.
    """
    equations = Equations(problem)
    layout = equations.layout
    poses = problem.initial.copy()
    calibration = start or Calibration.zero(problem.priors)
    system = equations.at(poses, calibration)
    damping, steps, converged = LEAST_DAMPING, 0, False
    while steps < most and not converged and damping < MOST_DAMPING:
        steps += 1
        step = _step(system, damping)
        if step is None:
            damping *= 10
            continue
        pose_step = step[layout.poses]
        trial, trial_calibration = poses + pose_step, calibration.plus(layout.calibration(step))
        new = equations.at(trial, trial_calibration)
        if not new.cost <= system.cost * (1 + 1e-12):
            damping *= 10
            continue
        converged = bool(
            np.abs(pose_step).max() < tolerance or system.cost - new.cost < 1e-9 * (1 + new.cost)
        )
        poses, calibration, system, damping = trial, trial_calibration, new, damping / 10
    poses[:, 2] = se2.wrap(poses[:, 2])
    if not marginals:
        return Solution(poses, calibration, system.cost, steps, converged)
    blocks = _marginals(system, layout.poses[list(marginals)])
    covariances = dict(zip(marginals, blocks, strict=True))
    spread = _spread(system, layout)
    return Solution(poses, calibration, system.cost, steps, converged, covariances, spread)


def _step(system: System, damping: float) -> Array | None:
    """Step of all unknowns; None where rounding has made the system indefinite."""
    band, corner = system.band.copy(), system.corner.copy()
    band[0] *= 1 + damping
    corner[np.diag_indices(len(corner))] *= 1 + damping
    step = _solved(band, system.border, corner, -system.gradient[:, None])
    return None if step is None else step[:, 0]


def _solved(band: Array, border: Array, corner: Array, right: Array) -> Array | None:
    """Solution (n + b, c) for right-hand sides (n + b, c)."""
    n = len(border)
    try:
        factor = (cholesky_banded(band, lower=True, check_finite=False), True)
        columns = np.column_stack([right[:n], border])
        solved = cho_solve_banded(factor, columns, check_finite=False)
        by_right, by_border = np.split(solved, [right.shape[1]], axis=1)
        schur = corner - border.T @ by_border
        outer = np.linalg.solve(schur, right[n:] - border.T @ by_right)
    except np.linalg.LinAlgError:
        return None
    return np.concatenate([by_right - by_border @ outer, outer])


def _marginals(system: System, wanted: Array) -> Array:
    """(k, 3, 3) blocks of the inverse of the whole system for unknowns (k, 3)."""
    unit = np.zeros((len(system.gradient), wanted.size))
    unit[wanted.ravel(), np.arange(wanted.size)] = 1
    inverse = _solved(system.band, system.border, system.corner, unit)
    if inverse is None or not np.isfinite(inverse[wanted]).all():
        return np.tile(UNKNOWN * np.eye(3), (len(wanted), 1, 1))
    blocks = inverse[wanted].reshape(len(wanted), 3, -1, 3)
    return np.stack([blocks[k, :, k] for k in range(len(wanted))])


def _spread(system: System, layout: Layout) -> Calibration:
    """Sigmas of the sensors' constants, all else being unknown too."""
    sensors = np.concatenate([layout.bias, layout.scale, layout.yaw])
    unit = np.zeros((len(system.gradient), len(sensors)))
    unit[sensors, np.arange(len(sensors))] = 1
    inverse = _solved(system.band, system.border, system.corner, unit)
    variances = np.full(len(system.gradient), UNKNOWN)
    if inverse is not None and np.isfinite(inverse[sensors]).all():
        variances[sensors] = np.maximum(inverse[sensors, np.arange(len(sensors))], 0.0)
    return layout.calibration(np.sqrt(variances))
