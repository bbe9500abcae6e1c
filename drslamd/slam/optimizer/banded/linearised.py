"""The factors of the team's problem at some point: how errors depend on the unknowns, and pull."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE
from drslamd.slam.optimizer.problem import (
    BetweenFactors,
    Problem,
    pose_errors,
)
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
        odometry_jacobian(problem, point.poses), factors.information, _pulled(factors, point.link)
    )


def odometry_jacobian(problem: Problem, poses: Array) -> Array:
    """(m, 3, 9): derivative of the errors by both poses, scale, yaw rate and turn."""
    factors = problem.odometry
    jacobian = np.zeros((len(factors), 3, 9))
    jacobian[:, :, :6] = pose_jacobian(poses, factors)
    jacobian[:, :2, 6] = factors.measured[:, :2]
    jacobian[:, :, 7], jacobian[:, :, 8] = factors.by_yaw, -factors.by_turn
    return jacobian


def closures_at(problem: Problem, poses: Array) -> Linearised:
    """By both poses."""
    factors = problem.closures
    error = pose_errors(poses, factors, factors.measured)
    return Linearised(pose_jacobian(poses, factors), factors.information, _pulled(factors, error))


def ranges_at(problem: Problem, point: Point, least: float = LEAST_CURVATURE) -> Linearised:
    """By both poses, bias, near-range bias and both antennas; cost is c^2 log(1 + (e / c)^2).

    Args:
        least: see `LEAST_CURVATURE`.
    """
    factors = problem.ranges
    error, jacobian = point.sight.error, _range_jacobian(problem, point)
    squared = (error / (point.threshold[factors.pair] * factors.sigma)) ** 2
    weight = 1 / (1 + squared) / factors.sigma**2
    # the second derivative makes the steps of an iteration shrink fast
    bent = weight * np.maximum((1 - squared) / (1 + squared), least)
    return Linearised(jacobian, bent[:, None, None], (weight * error)[:, None])


def weighed_ranges(problem: Problem, point: Point, claims: Array) -> Linearised:
    """The same without the curvature, and with as much information as ranges really have.

    Args:
        claims: (pairs,) how many times the sent sigma ranges are as wrong by.
    """
    factors = problem.ranges
    error, jacobian = point.sight.error, _range_jacobian(problem, point)
    squared = (error / (point.threshold[factors.pair] * factors.sigma)) ** 2
    weight = 1 / (1 + squared) / (claims[factors.pair] * factors.sigma) ** 2
    return Linearised(jacobian, weight[:, None, None], (weight * error)[:, None])


def _range_jacobian(problem: Problem, point: Point) -> Array:
    """(m, 1, 12) derivatives of errors."""
    factors, model = problem.ranges, problem.model
    _, u, arm_i, arm_j = point.sight
    jacobian = np.ones((len(factors), 1, 12))
    jacobian[:, 0, 0], jacobian[:, 0, 1] = -u.real, -u.imag
    jacobian[:, 0, 2] = u.real * arm_i.imag - u.imag * arm_i.real
    jacobian[:, 0, 3], jacobian[:, 0, 4] = u.real, u.imag
    jacobian[:, 0, 5] = u.imag * arm_j.real - u.real * arm_j.imag
    jacobian[:, 0, 7] = model.near_range_shape(factors.measured)
    heading = point.poses[np.stack([factors.i, factors.j], axis=-1), 2] + factors.turned
    seen = u[:, None] * np.exp(-1j * heading) * [-1, 1]
    jacobian[:, 0, 8::2], jacobian[:, 0, 9::2] = seen.real, seen.imag
    return jacobian


def carried_part(problem: Problem, point: Point, ranges: Linearised) -> Linearised:
    """Ranges that odometry has carried depend on its yaw rate and scale at both ends as well.

    Args:
        ranges: all of them, as if none was carried.
    """
    factors = problem.ranges.carried
    plain = ranges.chosen(problem.ranges.is_carried)
    ends = np.stack([problem.ranges.i, problem.ranges.j], axis=-1)[factors.rows]
    sight = point.sight.direction[factors.rows, None]
    seen = sight * np.exp(-1j * point.poses[ends, 2]) * [1, -1]
    by = factors.moves[..., 0] * seen.real[..., None] + factors.moves[..., 1] * seen.imag[..., None]
    jacobian = np.concatenate([plain.jacobian, by.reshape(-1, 1, 4)], axis=2)
    return plain._replace(jacobian=jacobian)


def pose_jacobian(poses: Array, factors: BetweenFactors) -> Array:
    """(m, 3, 6): derivative of `pose_errors` by both poses of each factor."""
    theta = poses[factors.i, 2]
    cos, sin = np.cos(theta), np.sin(theta)
    d = poses[factors.j, :2] - poses[factors.i, :2]
    j = np.zeros((len(factors), 3, 6))
    j[:, 0, 0] = j[:, 1, 1] = -cos
    j[:, 0, 1], j[:, 1, 0] = -sin, sin
    j[:, 0, 2] = -sin * d[:, 0] + cos * d[:, 1]
    j[:, 1, 2] = -cos * d[:, 0] - sin * d[:, 1]
    j[:, :2, 3:5] = -j[:, :2, :2]
    j[:, 2, 2], j[:, 2, 5] = -1, 1
    return j


def _pulled(factors: BetweenFactors, errors: Array) -> Array:
    """(m, 3) W e."""
    return np.asarray((factors.information @ errors[..., None])[..., 0])
