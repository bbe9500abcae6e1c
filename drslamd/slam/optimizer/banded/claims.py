"""What may be claimed of a solution: the covariance of poses and of what was learned."""

from __future__ import annotations

import numpy as np

from drslamd.slam import se2
from drslamd.slam.calibration.range_scatter import LEAST_SCATTER, scatter_ratios
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array, Index

UNKNOWN = 1e6
"""m^2 and rad^2: the covariance of a pose that nothing holds."""
CERTAIN = 3.0
"""Sigmas that a mounting must be off to stay an unknown."""


def covariances(
    equations: Equations, point: Point, scatter: Array, wanted: Index
) -> tuple[Array, Calibration, Array]:
    """Joint covariance (3 k, 3 k) of poses (k,), sigmas of the calibration, and how wrong biases
    may be (pairs,), m.

    A bias of the configured size is feared for poses; what was learned of it is told with the sigma
    that the team's likeness leaves, because others go on from there.

    Args:
        equations: of a problem whose odometry is believed as far as it should be.
        scatter: (pairs,) see `scatter_of`.
    """
    layout, model = equations.layout, equations.problem.model
    claims = model.correlated_ratio(1.0) * np.maximum(scatter, LEAST_SCATTER)
    factor = BandFactor.of(equations.claimed(point, claims))
    poses = layout.poses[wanted].ravel()
    joint = None if factor is None else factor.joint_covariance(poses)
    sigmas = np.full(layout.band + layout.border, np.sqrt(UNKNOWN))
    if factor is None or joint is None or not _is_known(joint):
        nothing = np.full(len(layout.bias), equations.problem.priors.bias.sigma)
        return UNKNOWN * np.eye(len(poses)), layout.calibration(sigmas), nothing
    learned = np.linalg.inv(factor.schur + equations.bias_belief(point))
    sigmas[layout.band :] = np.sqrt(np.diag(learned))
    claimed = np.diag(np.linalg.inv(factor.schur))[layout.bias - layout.band]
    return joint, layout.calibration(sigmas), bias_sigmas(equations.problem, point, claimed)


def bias_sigmas(problem: Problem, point: Point, claimed: Array) -> Array:
    """(pairs,) how wrong biases may be, m.

    Args:
        claimed: (pairs,) variances under the priors as they are configured, m^2.
    """
    prior, calibration = problem.priors.bias, point.calibration
    told = np.maximum(1 / claimed - prior.sigma**-2, 0.0)
    return prior.sigmas(calibration.bias - calibration.team_bias[0], told)


def _is_known(joint: Array) -> bool:
    """Of a system that is singular rounding may leave a factor, and no sense in its inverse."""
    squares = np.diag(joint)
    return bool((np.isfinite(squares) & (squares > 0) & (squares < UNKNOWN)).all())


def scatter_of(problem: Problem, point: Point) -> Array:
    """(pairs,) how much ranges scatter about the solution, over what is configured."""
    ranges, model = problem.ranges, problem.model
    return scatter_ratios(
        point.sight.error,
        ranges.sigma,
        ranges.pair,
        pairs=problem.pairs,
        configured=problem.range_sigma,
        most_sigmas=model.cauchy_sigmas,
    )


def disagreement(one: Point, other: Point, wanted: Index) -> Array:
    """(3 k, 3 k) what two explanations differ by, when nobody can tell which is right."""
    apart = one.poses[wanted] - other.poses[wanted]
    apart[:, 2] = se2.wrap(apart[:, 2])
    return np.outer(apart, apart)


def still_doubted(doubted: Doubted, learned: Calibration, spread: Calibration) -> Doubted:
    """The mountings that turned out not to be as configured; of the others nothing is left."""
    track = np.abs(learned.turn) > CERTAIN * spread.turn
    antenna = (np.abs(learned.antenna) > CERTAIN * spread.antenna).any(axis=1)
    return Doubted(doubted.track & track, doubted.antenna & antenna)
