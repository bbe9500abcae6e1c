"""How sure the solution is, from a kept factor of the system that may be claimed (`claims`)."""

from __future__ import annotations

import numpy as np

from drslamd.slam import se2
from drslamd.slam.lapack.routines import cholesky_solved, inverse_triangular
from drslamd.slam.optimizer.banded.claims import UNKNOWN, bias_sigmas
from drslamd.slam.optimizer.banded.layout import NOWHERE
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept.kept_factor import Current
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array, Index


def kept_covariance(claimed: Current, point: Point, wanted: Index) -> Array | None:
    """(3 k, 3 k) joint covariance of poses (k,) that are not eliminated; None where it is for
    `claims.covariances` to say.

    Args:
        claimed: of a problem whose odometry is believed as far as it should be.
        point: the solution; the whole team may be turned there beside how it was in `claimed`.
    """
    layout, lower = claimed.layout, claimed.lower
    at = layout.poses[wanted].ravel()
    if (at == NOWHERE).any():
        return None
    unit = np.zeros((len(lower), len(at)))
    unit[at, np.arange(len(at))] = 1
    joint = cholesky_solved(lower, unit)[at]
    squares = np.diag(joint)
    if not (np.isfinite(squares) & (squares > 0) & (squares < UNKNOWN)).all():
        return None
    axes = np.kron(np.eye(len(wanted)), se2.axes(turn_since(claimed, point, wanted)))
    joint = axes @ joint @ axes.T
    return np.asarray((joint + joint.T) / 2)


def turn_since(made: Current, point: Point, newest: Index) -> float:
    """By how much a team is turned beside where a matrix was made, at poses (k,)."""
    turns = se2.wrap((point.poses - made.poses)[newest, 2])
    return float(turns.mean()) if len(newest) else 0.0


def kept_spread(
    problem: Problem, point: Point, claimed: Current
) -> tuple[Calibration, Array] | None:
    """Sigmas of what was learned, and how wrong biases may be (pairs,), m, see
    `claims.covariances`; None as above."""
    layout, lower = claimed.layout, claimed.lower
    first = len(lower) - len(claimed.places.flat.constants)
    own = lower[first:, first:]
    belief = Equations(problem, layout=layout).bias_belief(point)[first:, first:]
    try:
        learned = inverse_triangular(np.linalg.cholesky(own @ own.T + belief))
    except np.linalg.LinAlgError:
        return None
    sigmas = np.full(len(lower), np.sqrt(UNKNOWN))
    sigmas[first:] = np.sqrt((learned**2).sum(axis=0))
    wide = (inverse_triangular(own) ** 2).sum(axis=0)[layout.bias - layout.band - first]
    return layout.calibration(sigmas), bias_sigmas(problem, point, wide)
