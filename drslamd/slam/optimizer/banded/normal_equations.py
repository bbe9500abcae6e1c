"""Normal equations of the team's problem, in the layout of a band with a border."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.problem import (
    BetweenFactors,
    Calibration,
    Problem,
    corrected,
    pose_errors,
    range_errors,
)
from drslamd.slam.se2 import Array, Index

GAUGE_SIGMA = 1e-5
"""The gauge pose is held to 10 um and 10 urad: far below all noise, far above rounding."""
LEAST_CURVATURE = 0.1
"""Of Cauchy's cost over that of a square with the same pull: beyond its threshold the curvature is
negative, and a system must stay positive definite."""


@dataclass
class System:
    """Lower band (w, n), border (n, b), corner (b, b) and gradient (n + b,) at some point."""

    band: Array
    border: Array
    corner: Array
    gradient: Array

    @staticmethod
    def empty(layout: BandLayout) -> System:
        n, b = layout.band, layout.border
        return System(
            np.zeros((layout.width, n)), np.zeros((n, b)), np.zeros((b, b)), np.zeros(n + b)
        )

    def add_prior(self, unknowns: Index, values: Array, stiffness: Array | float) -> None:
        """Add independent priors by the information with which they hold values at zero."""
        stiffness = np.broadcast_to(stiffness, values.shape)
        inside = unknowns < len(self.border)
        self.band[0, unknowns[inside]] += stiffness[inside]
        outside = unknowns[~inside] - len(self.border)
        self.corner[outside, outside] += stiffness[~inside]
        self.gradient[unknowns] += stiffness * values

    def add_difference(self, unknowns: Index, one: Index, values: Array, stiffness: float) -> None:
        """Hold unknowns (k,) of the border beside one other (1,); values (k,) of the differences."""
        n = len(self.border)
        many, (single,) = unknowns - n, one - n
        self.corner[many, many] += stiffness
        self.corner[many, single] -= stiffness
        self.corner[single, many] -= stiffness
        self.corner[single, single] += stiffness * len(many)
        self.gradient[unknowns] += stiffness * values
        self.gradient[one] -= stiffness * values.sum()


class _Assembly:
    """Where the blocks of one set of factors go in the system; the same in every iteration."""

    def __init__(self, layout: BandLayout, unknowns: Index) -> None:
        """
        Args:
            unknowns: (m, c) on which each factor depends.
        """
        n, b = layout.band, layout.border
        shape = (*unknowns.shape, unknowns.shape[1])
        row = np.broadcast_to(unknowns[:, :, None], shape).ravel()
        column = np.broadcast_to(unknowns[:, None, :], shape).ravel()
        self._unknowns = unknowns.ravel()
        self._in_band = np.flatnonzero((row >= column) & (row < n))
        self._in_border = np.flatnonzero((row < n) & (column >= n))
        self._in_corner = np.flatnonzero((row >= n) & (column >= n))
        self._band = ((row - column) * n + column)[self._in_band]
        self._border = (row * b + column - n)[self._in_border]
        self._corner = ((row - n) * b + column - n)[self._in_corner]

    def add(self, system: System, jacobian: Array, information: Array, pull: Array) -> None:
        """Add J' W J to the matrix and J' f to the gradient.

        Args:
            jacobian: (m, d, c); information: (m, d, d).
            pull: (m, d) f, half the derivative of the cost by the error.
        """
        transposed = np.swapaxes(jacobian, 1, 2)
        blocks = (transposed @ (information @ jacobian)).ravel()
        system.band += _sums(self._band, blocks[self._in_band], system.band)
        system.border += _sums(self._border, blocks[self._in_border], system.border)
        system.corner += _sums(self._corner, blocks[self._in_corner], system.corner)
        gradient = (transposed @ pull[..., None]).ravel()
        system.gradient += _sums(self._unknowns, gradient, system.gradient)


def _sums(at: Index, values: Array, like: Array) -> Array:
    return np.bincount(at, values, like.size).reshape(like.shape)


class Equations:
    """The normal equations of one problem, at any point."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self.layout = layout = BandLayout.of(problem)
        odometry, closures, ranges = problem.odometry, problem.closures, problem.ranges
        poses = layout.poses
        sensors = np.stack([layout.scale[odometry.robot], layout.yaw[odometry.robot]], axis=-1)
        self._odometry = _Assembly(
            layout, np.hstack([poses[odometry.i], poses[odometry.j], sensors])
        )
        self._closures = _Assembly(layout, np.hstack([poses[closures.i], poses[closures.j]]))
        shared = np.tile(layout.near_bias, (len(ranges), 1))
        self._ranges = _Assembly(
            layout,
            np.column_stack([poses[ranges.i], poses[ranges.j], layout.bias[ranges.pair], shared]),
        )

    def cost(self, poses: Array, calibration: Calibration, threshold: Array) -> float:
        """Of all factors and priors.

        Args:
            threshold: (pairs,) sigmas beyond which a range loses weight.
        """
        problem = self._problem
        odometry, closures, ranges, priors = (
            problem.odometry,
            problem.closures,
            problem.ranges,
            problem.priors,
        )
        moved = poses[problem.gauge] - problem.initial[problem.gauge]
        c = threshold[ranges.pair]
        error = range_errors(poses, ranges, calibration, problem.model)[0]
        return (
            odometry.cost(pose_errors(poses, odometry, corrected(odometry, calibration)))
            + closures.cost(pose_errors(poses, closures, closures.measured))
            + float(np.sum(c**2 * np.log1p((error / (c * ranges.sigma)) ** 2)))
            + priors.cost(calibration)
            + float(moved @ moved) * GAUGE_SIGMA**-2
        )

    def at(self, poses: Array, calibration: Calibration, threshold: Array) -> System:
        """Half the gradient of the cost, and a matrix close to half its second derivative.

        Args:
            threshold: (pairs,) sigmas beyond which a range loses weight.
        """
        system = System.empty(self.layout)
        self._add_odometry(system, poses, calibration)
        self._add_closures(system, poses)
        self._add_ranges(system, poses, calibration, threshold)
        self._add_priors(system, calibration)
        self._add_gauge(system, poses)
        return system

    def claimed(
        self, poses: Array, calibration: Calibration, threshold: Array, claims: Array
    ) -> System:
        """What is known at the solution: a system whose inverse is the covariance to be claimed.

        Weights that make a good estimate are no honest claim. Here ranges that share their errors
        count as such, and priors are as wide as they are configured.

        Args:
            claims: (pairs,) how many times the sent sigma ranges are really as wrong by.
        """
        problem, layout = self._problem, self.layout
        system = System.empty(layout)
        self._add_odometry(system, poses, calibration)
        self._add_closures(system, poses)
        self._add_ranges(system, poses, calibration, threshold, claims)
        priors = problem.priors
        system.add_prior(layout.bias, calibration.bias, priors.bias.sigma**-2)
        system.add_prior(layout.team_bias, calibration.team_bias, priors.bias.sigma**-2)
        system.add_prior(layout.scale, calibration.scale, priors.scale**-2.0)
        self._add_gaussian_priors(system, calibration)
        self._add_gauge(system, poses)
        return system

    def _add_priors(self, system: System, calibration: Calibration) -> None:
        layout, priors = self.layout, self._problem.priors
        team = float(calibration.team_bias[0])
        own = calibration.bias - team
        stiffness = priors.bias.own_stiffness(own)
        system.add_difference(layout.bias, layout.team_bias, own, stiffness)
        team_stiffness = priors.bias.team_stiffness(team)
        system.add_prior(layout.team_bias, calibration.team_bias, team_stiffness)
        scale = calibration.scale
        system.add_prior(layout.scale, scale, priors.scale_stiffness(scale))
        self._add_gaussian_priors(system, calibration)

    def _add_gaussian_priors(self, system: System, calibration: Calibration) -> None:
        layout, priors = self.layout, self._problem.priors
        system.add_prior(layout.yaw, calibration.yaw, priors.yaw**-2.0)
        system.add_prior(layout.near_bias, calibration.near_bias, priors.near_bias**-2.0)

    def _add_gauge(self, system: System, poses: Array) -> None:
        gauge = self._problem.gauge
        moved = poses[gauge] - self._problem.initial[gauge]
        system.add_prior(self.layout.poses[gauge], moved, GAUGE_SIGMA**-2)

    def _add_odometry(self, system: System, poses: Array, calibration: Calibration) -> None:
        odometry = self._problem.odometry
        error = pose_errors(poses, odometry, corrected(odometry, calibration))
        x, y = odometry.measured[:, 0], odometry.measured[:, 1]
        jacobian = np.zeros((len(odometry), 3, 8))
        jacobian[:, :, :6] = _pose_jacobians(poses, odometry)
        jacobian[:, 0, 6], jacobian[:, 1, 6] = x, y
        jacobian[:, 0, 7] = -odometry.path / 2 * y
        jacobian[:, 1, 7] = odometry.path / 2 * x
        jacobian[:, 2, 7] = odometry.path
        pull = (odometry.information @ error[..., None])[..., 0]
        self._odometry.add(system, jacobian, odometry.information, pull)

    def _add_closures(self, system: System, poses: Array) -> None:
        closures = self._problem.closures
        error = pose_errors(poses, closures, closures.measured)
        pull = (closures.information @ error[..., None])[..., 0]
        self._closures.add(system, _pose_jacobians(poses, closures), closures.information, pull)

    def _add_ranges(
        self,
        system: System,
        poses: Array,
        calibration: Calibration,
        threshold: Array,
        claims: Array | None = None,
    ) -> None:
        """Cauchy's cost c^2 log(1 + (e / c)^2), e and c in sigmas."""
        ranges, model = self._problem.ranges, self._problem.model
        error, u, arm_i, arm_j = range_errors(poses, ranges, calibration, model)
        jacobian = np.ones((len(ranges), 1, 8))
        jacobian[:, 0, 0], jacobian[:, 0, 1] = -u.real, -u.imag
        jacobian[:, 0, 2] = u.real * arm_i.imag - u.imag * arm_i.real
        jacobian[:, 0, 3], jacobian[:, 0, 4] = u.real, u.imag
        jacobian[:, 0, 5] = u.imag * arm_j.real - u.real * arm_j.imag
        jacobian[:, 0, 7] = model.near_range_shape(ranges.measured)
        c = threshold[ranges.pair]
        squared = (error / (c * ranges.sigma)) ** 2
        weight = 1 / (1 + squared) / ranges.sigma**2
        if claims is None:
            # the second derivative makes the steps of an iteration shrink fast
            bent = weight * np.maximum((1 - squared) / (1 + squared), LEAST_CURVATURE)
        else:
            bent = weight / claims[ranges.pair] ** 2
        self._ranges.add(system, jacobian, bent[:, None, None], (weight * error)[:, None])


def _pose_jacobians(poses: Array, factors: BetweenFactors) -> Array:
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
