"""Normal equations of the team's problem, in the layout of a band with a border."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.problem import (
    BetweenFactors,
    Calibration,
    Problem,
    RangeFactors,
    corrected,
    pose_errors,
    range_errors,
)
from drslamd.slam.se2 import Array, Index

GAUGE_SIGMA = 1e-5
"""The gauge pose is held to 10 um and 10 urad: far below all noise, far above rounding."""


@dataclass
class System:
    """Lower band (w, n), border (n, b), corner (b, b), gradient (n + b,) and cost at some point."""

    band: Array
    border: Array
    corner: Array
    gradient: Array
    cost: float

    @staticmethod
    def empty(layout: BandLayout) -> System:
        n, b = layout.band, layout.border
        return System(
            np.zeros((layout.width, n)), np.zeros((n, b)), np.zeros((b, b)), np.zeros(n + b), 0.0
        )

    def add_gaussian_prior(self, unknowns: Index, error: Array, stiffness: Array | float) -> None:
        """Add independent priors."""
        stiffness = np.broadcast_to(stiffness, error.shape)
        inside = unknowns < len(self.border)
        self.band[0, unknowns[inside]] += stiffness[inside]
        outside = unknowns[~inside] - len(self.border)
        self.corner[outside, outside] += stiffness[~inside]
        self.gradient[unknowns] += stiffness * error
        self.cost += float(np.sum(stiffness * error**2))

    def add_cauchy_prior(self, unknowns: Index, error: Array, sigma: Array) -> None:
        """Add independent priors with the tails of Cauchy's: log(1 + (e / sigma)^2) by its weight.

        Where little is measured the unknown stays near zero; where much is, the prior gives way.
        """
        scaled = (error / sigma) ** 2
        self.add_gaussian_prior(unknowns, error, 1 / (sigma**2 * (1 + scaled)))
        self.cost += float(np.sum(np.log1p(scaled) - scaled / (1 + scaled)))


class _Assembly:
    """Where the blocks of one set of factors go in the system; the same in every iteration."""

    def __init__(self, layout: BandLayout, unknowns: Index) -> None:
        """
        Args:
            unknowns: (m, c) on which each factor depends.
        """
        n, b = layout.band, layout.border
        row, column = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
        self._unknowns = unknowns.ravel()
        self._in_band = (row >= column) & (row < n)
        self._in_border = (row < n) & (column >= n)
        self._in_corner = (row >= n) & (column >= n)
        self._band = ((row - column) * n + column)[self._in_band]
        self._border = (row * b + column - n)[self._in_border]
        self._corner = ((row - n) * b + column - n)[self._in_corner]

    def add(self, system: System, error: Array, jacobian: Array, information: Array) -> None:
        """Add J' W J, J' W e and e' W e.

        Args:
            error: (m, d); jacobian: (m, d, c); information: (m, d, d).
        """
        weighted = np.swapaxes(information @ jacobian, 1, 2)
        blocks = weighted @ jacobian
        system.band += _sums(self._band, blocks[self._in_band], system.band)
        system.border += _sums(self._border, blocks[self._in_border], system.border)
        system.corner += _sums(self._corner, blocks[self._in_corner], system.corner)
        gradient = (weighted @ error[..., None]).ravel()
        system.gradient += _sums(self._unknowns, gradient, system.gradient)
        system.cost += float(np.vdot(error, information @ error[..., None]))


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
        # only ranges that odometry has carried depend on its constants
        carried = ranges.is_carried
        self._ranges = [
            (part, _Assembly(layout, _unknowns_of_ranges(layout, part)))
            for part in (ranges.chosen(~carried), ranges.chosen(carried))
            if len(part)
        ]

    def at(self, poses: Array, calibration: Calibration) -> System:
        """Sum of J' W J and J' W e over all factors and priors."""
        system = System.empty(self.layout)
        self._add_odometry(system, poses, calibration)
        self._add_closures(system, poses)
        for ranges, assembly in self._ranges:
            self._add_ranges(system, ranges, assembly, poses, calibration)
        layout, priors = self.layout, self._problem.priors
        for unknowns, values, widths in (
            (layout.bias, calibration.bias, priors.bias),
            (layout.scale, calibration.scale, priors.scale),
        ):
            if priors.has_cauchy_tails:
                system.add_cauchy_prior(unknowns, values, widths)
            else:
                system.add_gaussian_prior(unknowns, values, widths**-2.0)
        system.add_gaussian_prior(layout.yaw, calibration.yaw, priors.yaw**-2.0)
        system.add_gaussian_prior(layout.near_bias, calibration.near_bias, priors.near_bias**-2.0)
        gauge = self._problem.gauge
        moved = poses[gauge] - self._problem.initial[gauge]
        system.add_gaussian_prior(layout.poses[gauge], moved, GAUGE_SIGMA**-2)
        return system

    def _add_odometry(self, system: System, poses: Array, calibration: Calibration) -> None:
        odometry = self._problem.odometry
        error = pose_errors(poses, odometry, corrected(odometry, calibration))
        jacobian = np.zeros((len(odometry), 3, 8))
        jacobian[:, :, :6] = _pose_jacobians(poses, odometry)
        jacobian[:, :2, 6] = odometry.measured[:, :2]
        jacobian[:, :, 7] = odometry.by_yaw
        self._odometry.add(system, error, jacobian, odometry.information)

    def _add_closures(self, system: System, poses: Array) -> None:
        closures = self._problem.closures
        error = pose_errors(poses, closures, closures.measured)
        self._closures.add(system, error, _pose_jacobians(poses, closures), closures.information)

    def _add_ranges(
        self,
        system: System,
        ranges: RangeFactors,
        assembly: _Assembly,
        poses: Array,
        calibration: Calibration,
    ) -> None:
        model = self._problem.model
        error, u, arm_i, arm_j = range_errors(poses, ranges, calibration, model)
        columns = np.ones((len(ranges), 8))
        columns[:, 0], columns[:, 1] = -u.real, -u.imag
        columns[:, 2] = u.real * arm_i.imag - u.imag * arm_i.real
        columns[:, 3], columns[:, 4] = u.real, u.imag
        columns[:, 5] = u.imag * arm_j.real - u.real * arm_j.imag
        columns[:, 7] = model.near_range_shape(ranges.measured)
        if len(ranges.carried.rows):
            columns = np.hstack([columns, _by_constants(u, poses, ranges)])
        jacobian = columns[:, None]
        # Cauchy's cost c^2 log(1 + (e / c)^2) by its weight; e and c in sigmas
        c = model.cauchy_sigmas
        scaled = (error / (c * ranges.sigma)) ** 2
        weight = 1 / (1 + scaled)
        information = (weight / ranges.sigma**2)[:, None, None]
        assembly.add(system, error[:, None], jacobian, information)
        robust = float(np.sum(c**2 * np.log1p(scaled)))
        system.cost += robust - float(np.sum(weight * (error / ranges.sigma) ** 2))


def _unknowns_of_ranges(layout: BandLayout, ranges: RangeFactors) -> Index:
    """(m, 8) on which ranges depend, or (m, 12) where all of them are carried."""
    shared = np.tile(layout.near_bias, (len(ranges), 1))
    poses, bias = layout.poses, layout.bias[ranges.pair]
    columns = [poses[ranges.i], poses[ranges.j], bias[:, None], shared]
    if len(ranges.carried.rows):
        constants = np.stack([layout.yaw, layout.scale], axis=-1)
        columns.append(constants[ranges.carried.robots].reshape(-1, 4))
    return np.hstack(columns)


def _by_constants(sight: Array, poses: Array, ranges: RangeFactors) -> Array:
    """(m, 4): derivative of errors by yaw rate and scale of the robots of i and of j.

    Args:
        sight: (m,) unit lines of sight in w, x + iy.
        ranges: that are all carried.
    """
    moves, away = ranges.carried.moves, np.stack([ranges.i, ranges.j], axis=-1)
    seen = sight[:, None] * np.exp(-1j * poses[away, 2]) * [1, -1]
    by = moves[..., 0] * seen.real[..., None] + moves[..., 1] * seen.imag[..., None]
    return np.asarray(by.reshape(-1, 4))


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
