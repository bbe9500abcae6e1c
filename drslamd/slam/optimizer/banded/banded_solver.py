"""Module 3, default: the team's graph solved exactly, because ordered by time it is a band.

The Gauss-Newton Hessian of the team has a half-bandwidth of about 3 R for R robots
(`normal_equations`), so one banded Cholesky factorisation solves it exactly in linear time. The
border is eliminated by its Schur complement. The factorisation also yields the marginal
covariances of the poses that are asked for.

The cost of a step grows with the cube of the number of robots; up to about a dozen robots in one
connected group it stays below the cost of linearising.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky_banded
from scipy.linalg.lapack import dtbtrs

from drslamd.slam import se2
from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.normal_equations import Equations, System
from drslamd.slam.optimizer.problem import Calibration, Problem, Solution
from drslamd.slam.se2 import Array

LEAST_DAMPING = 1e-6
"""Of Levenberg and Marquardt, relative to the diagonal."""
MOST_DAMPING = 1e6
"""Beyond it no step helps."""
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
    factors = _Factors.of(system)
    blocks = _marginals(factors, layout.poses[list(marginals)])
    covariances = dict(zip(marginals, blocks, strict=True))
    spread = _spread(factors, layout)
    return Solution(poses, calibration, system.cost, steps, converged, covariances, spread)


def _step(system: System, damping: float) -> Array | None:
    """Step of all unknowns; None where rounding has made the system indefinite."""
    factors = _Factors.of(system, damping)
    step = None if factors is None else factors.solved(-system.gradient)
    return step if step is not None and np.isfinite(step).all() else None


@dataclass(frozen=True)
class _Factors:
    """A system [A B; B' C] taken apart: A = L L', and what is left for the border.

    Attributes:
        lower: L in lower banded form.
        halfway: (n, b) L^-1 B: half of the way is enough, since B' A^-1 B = (L^-1 B)' (L^-1 B).
        schur: (b, b) C - B' A^-1 B, whose inverse is the covariance of the border.
    """

    lower: Array
    halfway: Array
    schur: Array

    @staticmethod
    def of(system: System, damping: float = 0.0) -> _Factors | None:
        """None where the system is not positive definite."""
        band, corner = system.band.copy(), system.corner.copy()
        band[0] *= 1 + damping
        corner[np.diag_indices(len(corner))] *= 1 + damping
        try:
            lower = cholesky_banded(band, lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            return None
        halfway, _ = dtbtrs(lower, system.border, uplo="L")
        schur = corner - halfway.T @ halfway
        # a tiny pivot of A can leave nothing of the border but rounding
        definite = np.isfinite(schur).all() and bool((np.diag(schur) > 0).all())
        return _Factors(lower, halfway, schur) if definite else None

    def solved(self, right: Array) -> Array | None:
        """(n + b,) the solution for a right-hand side (n + b,)."""
        n = len(self.halfway)
        middle = self.forward(right[:n, None])[:, 0]
        try:
            outer = np.linalg.solve(self.schur, right[n:] - self.halfway.T @ middle)
        except np.linalg.LinAlgError:
            return None
        rest = (middle - self.halfway @ outer)[:, None]
        inner, _ = dtbtrs(self.lower, rest, uplo="L", trans="T")
        return np.concatenate([inner[:, 0], outer])

    def forward(self, columns: Array) -> Array:
        """L^-1 times columns (n, c)."""
        solved, _ = dtbtrs(self.lower, columns, uplo="L")
        return np.asarray(solved)


def _marginals(factors: _Factors | None, wanted: Array) -> Array:
    """(k, 3, 3) blocks of the inverse of the whole system for the unknowns (k, 3) of k poses."""
    nothing = np.tile(UNKNOWN * np.eye(3), (len(wanted), 1, 1))
    border = None if factors is None else _inverse(factors.schur)
    if factors is None or border is None:
        return nothing
    n = len(factors.halfway)
    inside = wanted[:, 0] < n
    at = wanted[inside]
    unit = np.zeros((n, at.size))
    unit[at.ravel(), np.arange(at.size)] = 1
    own = factors.forward(unit).reshape(n, len(at), 3)
    bound = np.einsum("nb,nki->kbi", factors.halfway, own)
    out = nothing
    out[inside] = np.einsum("nki,nkj->kij", own, own)
    out[inside] += np.swapaxes(bound, 1, 2) @ border @ bound
    outside = wanted[~inside] - n
    out[~inside] = border[outside[:, :, None], outside[:, None, :]]
    return out if np.isfinite(out).all() else nothing


def _spread(factors: _Factors | None, layout: BandLayout) -> Calibration:
    """Sigmas of the sensors' constants, all else being unknown too."""
    variances = np.full(layout.band + layout.border, UNKNOWN)
    border = None if factors is None else _inverse(factors.schur)
    if border is not None:
        variances[layout.band :] = np.maximum(np.diag(border), 0.0)
    return layout.calibration(np.sqrt(variances))


def _inverse(matrix: Array) -> Array | None:
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return None
    return inverse if np.isfinite(inverse).all() else None
