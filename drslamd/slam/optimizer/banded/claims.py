"""What may be claimed of a solution: the covariance of poses and of what was learned."""

from __future__ import annotations

import numpy as np

from drslamd.slam import se2
from drslamd.slam.calibration.range_scatter import LEAST_SCATTER, scatter_ratios
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.newton_descent import Point
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.problem import Calibration, Problem, range_errors
from drslamd.slam.se2 import Array, Index

UNKNOWN = 1e6
"""m^2 and rad^2: the covariance of a pose that nothing holds."""


def covariances(
    equations: Equations, point: Point, scatter: Array, wanted: Index
) -> tuple[Array, Calibration]:
    """Joint covariance (3 k, 3 k) of poses (k,), and sigmas of the calibration.

    Args:
        equations: of a problem whose odometry is believed as far as it should be.
        scatter: (pairs,) see `scatter_of`.
    """
    layout, model = equations.layout, equations.problem.model
    claims = model.correlated_ratio(1.0) * np.maximum(scatter, LEAST_SCATTER)
    system = equations.claimed(point.poses, point.calibration, point.threshold, claims)
    unknowns = layout.poses[wanted].ravel()
    sensors = np.arange(3 * len(point.poses), layout.band + layout.border)
    both = np.concatenate([unknowns, sensors])
    factor = BandFactor.of(system)
    joint = None if factor is None else factor.joint_covariance(both)
    if joint is None:
        joint = UNKNOWN * np.eye(len(both))
    k = len(unknowns)
    sigmas = np.zeros(layout.band + layout.border)
    sigmas[sensors] = np.sqrt(np.diag(joint)[k:])
    return joint[:k, :k], layout.calibration(sigmas)


def scatter_of(problem: Problem, point: Point) -> Array:
    """(pairs,) how much ranges scatter about the solution, over what is configured."""
    ranges, model = problem.ranges, problem.model
    errors = range_errors(point.poses, ranges, point.calibration, model)[0]
    return scatter_ratios(
        errors,
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
