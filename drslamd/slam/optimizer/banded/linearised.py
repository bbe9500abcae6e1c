"""The factors of the team's problem at some point: how errors depend on the unknowns, and pull."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE
from drslamd.slam.optimizer.factor_errors import by_scale, by_turn, pose_errors
from drslamd.slam.optimizer.problem import BetweenFactors, Problem
from drslamd.slam.se2 import Array


class Linearised(NamedTuple):
    """m factors with errors of d components that depend on c unknowns.

    Attributes:
        jacobian: (m, d, c); information: (m, d, d).
        pull: (m, d) half the derivative of the cost by the error.
    """

    jacobian: Array
    information: Array
    pull: Array

    def chosen(self, which: NDArray[np.bool_]) -> Linearised:
        return Linearised(*(column[which] for column in self))


def odometry_at(problem: Problem, point: Point) -> Linearised:
    """By both poses, scale, yaw rate and turn."""
    factors = problem.odometry
    return Linearised(
        odometry_jacobian(problem, point), factors.information, factors.weighed(point.link)
    )


def odometry_jacobian(problem: Problem, point: Point) -> Array:
    """(m, 3, 9): derivative of the errors by both poses, scale, yaw rate and turn."""
    factors, calibration = problem.odometry, point.calibration
    jacobian = np.zeros((9, 3, len(factors)))
    _add_poses(jacobian, point.poses, factors)
    jacobian[6, :2] = by_scale(factors, calibration).T
    jacobian[7], jacobian[8] = factors.by_yaw.T, -by_turn(factors, calibration).T
    return np.asarray(jacobian.transpose(2, 1, 0))


def closures_at(problem: Problem, poses: Array) -> Linearised:
    """By both poses."""
    factors = problem.closures
    error = pose_errors(poses, factors, factors.measured)
    return Linearised(pose_jacobian(poses, factors), factors.information, factors.weighed(error))


def ranges_at(
    problem: Problem, point: Point, least: float = LEAST_CURVATURE, antennas: bool = True
) -> Linearised:
    """By both poses, bias, near-range bias and both antennas; cost is c^2 log(1 + (e / c)^2).

    Args:
        least: see `LEAST_CURVATURE`.
        antennas: are their columns asked for? Else they are zero.
    """
    factors = problem.ranges
    error, jacobian = point.sight.error, _range_jacobian(problem, point, antennas)
    squared = (error / (problem.cuts(point.threshold, error) * factors.sigma)) ** 2
    weight = problem.weight / (1 + squared)
    # the second derivative makes the steps of an iteration shrink fast
    bent = weight * np.maximum((1 - squared) / (1 + squared), least)
    return Linearised(jacobian, bent[:, None, None], (weight * error)[:, None])


def weighed_ranges(
    problem: Problem, point: Point, claims: Array, antennas: bool = True
) -> Linearised:
    """The same without the curvature, and with as much information as ranges really have.

    Args:
        claims: (pairs,) how many times the sent sigma ranges are as wrong by.
    """
    factors = problem.ranges
    error, jacobian = point.sight.error, _range_jacobian(problem, point, antennas)
    squared = (error / (problem.cuts(point.threshold, error) * factors.sigma)) ** 2
    weight = 1 / (1 + squared) / (claims[factors.pair] * factors.sigma) ** 2
    return Linearised(jacobian, weight[:, None, None], (weight * error)[:, None])


def _range_jacobian(problem: Problem, point: Point, antennas: bool) -> Array:
    """(m, 1, 12) derivatives of errors."""
    factors, sight = problem.ranges, point.sight
    u, arm_i, arm_j = sight.along, sight.arm_i, sight.arm_j
    jacobian = np.ones((12, 1, len(factors)))
    jacobian[0, 0], jacobian[1, 0] = -u.real, -u.imag
    jacobian[2, 0] = u.real * arm_i.imag - u.imag * arm_i.real
    jacobian[3, 0], jacobian[4, 0] = u.real, u.imag
    jacobian[5, 0] = u.imag * arm_j.real - u.real * arm_j.imag
    jacobian[7, 0] = sight.shape
    if not antennas:
        jacobian[8:] = 0.0
        return np.asarray(jacobian.transpose(2, 1, 0))
    for column, end, pose in ((8, 0, factors.i), (10, 1, factors.j)):
        seen = u * np.exp(-1j * (point.poses[pose, 2] + factors.turned[:, end]))
        seen = seen if end else -seen
        jacobian[column, 0], jacobian[column + 1, 0] = seen.real, seen.imag
    return np.asarray(jacobian.transpose(2, 1, 0))


def carried_part(problem: Problem, point: Point, ranges: Linearised) -> Linearised:
    """Ranges that odometry has carried depend on its yaw rate and scale at both ends as well.

    Args:
        ranges: all of them, as if none was carried.
    """
    factors = problem.ranges.carried
    plain = ranges.chosen(problem.ranges.is_carried)
    ends = np.stack([problem.ranges.i, problem.ranges.j], axis=-1)[factors.rows]
    sight = point.sight.along[factors.rows, None]
    seen = sight * np.exp(-1j * point.poses[ends, 2]) * [1, -1]
    by = factors.moves[..., 0] * seen.real[..., None] + factors.moves[..., 1] * seen.imag[..., None]
    jacobian = np.concatenate([plain.jacobian, by.reshape(-1, 1, 4)], axis=2)
    return plain._replace(jacobian=jacobian)


def pose_jacobian(poses: Array, factors: BetweenFactors) -> Array:
    """(m, 3, 6): derivative of `pose_errors` by both poses of each factor."""
    jacobian = np.zeros((6, 3, len(factors)))
    _add_poses(jacobian, poses, factors)
    return np.asarray(jacobian.transpose(2, 1, 0))


def _add_poses(out: Array, poses: Array, factors: BetweenFactors) -> None:
    """The same in the first of columns that are zero, (c, 3, m)."""
    i, j = poses[factors.i].T, poses[factors.j].T
    cos, sin, x, y = np.cos(i[2]), np.sin(i[2]), j[0] - i[0], j[1] - i[1]
    out[0, 0] = out[1, 1] = -cos
    out[1, 0], out[0, 1] = -sin, sin
    out[2, 0], out[2, 1] = cos * y - sin * x, -cos * x - sin * y
    out[3:5, :2] = -out[:2, :2]
    out[2, 2], out[5, 2] = -1, 1
