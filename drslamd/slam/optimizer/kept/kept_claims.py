"""How sure the solution is, from a kept factor of the system that may be claimed (`claims`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam import se2
from drslamd.slam.lapack.routines import inverse_triangular
from drslamd.slam.optimizer.banded.claims import UNKNOWN, bias_sigmas
from drslamd.slam.optimizer.banded.layout import NOWHERE
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept.border import Border
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
    at = claimed.layout.poses[wanted].ravel()
    if (at == NOWHERE).any():
        return None
    joint = claimed.covariance(at)
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


@dataclass(frozen=True)
class KeptSpread:
    """How sure all is that was learned, as long as the border is kept of which that is told.

    Attributes:
        border: it.
        learned: (c,) sigmas of the constants, in the order of the border.
        wide: (c,) their variances under the priors as they are configured.
    """

    border: Border
    learned: Array
    wide: Array

    @staticmethod
    def of(problem: Problem, point: Point, claimed: Current) -> KeptSpread | None:
        """None as above."""
        layout, count = claimed.layout, len(claimed.places.flat.constants)
        own, first = claimed.border.lower[-count:, -count:], len(claimed.numbers) - count
        belief = Equations(problem, layout=layout).bias_belief(point)[first:, first:]
        try:
            learned = inverse_triangular(np.linalg.cholesky(own @ own.T + belief))
        except np.linalg.LinAlgError:
            return None
        wide = (inverse_triangular(own) ** 2).sum(axis=0)
        return KeptSpread(claimed.border, np.sqrt((learned**2).sum(axis=0)), wide)

    def told(self, problem: Problem, point: Point, claimed: Current) -> tuple[Calibration, Array]:
        """Sigmas of what was learned, and how wrong biases may be (pairs,), m, see
        `claims.covariances`.

        Args:
            claimed: with this border.
        """
        layout, first = claimed.layout, len(claimed.numbers) - len(self.learned)
        sigmas = np.full(len(claimed.numbers), np.sqrt(UNKNOWN))
        sigmas[first:] = self.learned
        biases = bias_sigmas(problem, point, self.wide[layout.bias - layout.band - first])
        return layout.calibration(sigmas), biases
