"""Normal equations of the team's problem, in the layout of a band with a border."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.linearised import Linearised
from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE
from drslamd.slam.optimizer.problem import (
    Calibration,
    Problem,
    corrected,
    pose_errors,
    range_errors,
)
from drslamd.slam.se2 import Array, Index

GAUGE_SIGMA = 1e-5
"""The gauge pose is held to 10 um and 10 urad: far below all noise, far above rounding."""


@dataclass
class System:
    """A symmetric matrix: lower band (w, n), border (n, b) and corner (b, b)."""

    band: Array
    border: Array
    corner: Array

    @staticmethod
    def empty(layout: BandLayout) -> System:
        n, b = layout.band, layout.border
        return System(np.zeros((layout.width, n)), np.zeros((n, b)), np.zeros((b, b)))

    def add_prior(self, unknowns: Index, stiffness: Array | float) -> None:
        """Add independent priors by the information with which they hold unknowns (k,)."""
        stiffness = np.broadcast_to(stiffness, unknowns.shape)
        inside = unknowns < len(self.border)
        self.band[0, unknowns[inside]] += stiffness[inside]
        outside = unknowns[~inside] - len(self.border)
        self.corner[outside, outside] += stiffness[~inside]

    def add_difference(self, unknowns: Index, one: Index, stiffness: Array) -> None:
        """Hold unknowns (k,) of the border beside one other (1,) with information (k, k)."""
        n = len(self.border)
        many, single = unknowns - n, one - n
        self.corner[np.ix_(many, many)] += stiffness
        self.corner[many, single] -= stiffness.sum(axis=0)
        self.corner[single, many] -= stiffness.sum(axis=0)
        self.corner[single, single] += stiffness.sum()


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

    def add_matrix(self, system: System, factors: Linearised) -> None:
        """Add J' W J."""
        transposed = np.swapaxes(factors.jacobian, 1, 2)
        blocks = (transposed @ (factors.information @ factors.jacobian)).ravel()
        system.band += _sums(self._band, blocks[self._in_band], system.band)
        system.border += _sums(self._border, blocks[self._in_border], system.border)
        system.corner += _sums(self._corner, blocks[self._in_corner], system.corner)

    def add_gradient(self, gradient: Array, factors: Linearised) -> None:
        """Add J' f."""
        each = (factors.pull[:, None, :] @ factors.jacobian).ravel()
        gradient += _sums(self._unknowns, each, gradient)


def _sums(at: Index, values: Array, like: Array) -> Array:
    return np.bincount(at, values, like.size).reshape(like.shape)


class Equations:
    """The normal equations of one problem, at any point."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.layout = layout = BandLayout.of(problem)
        odometry, closures, ranges = problem.odometry, problem.closures, problem.ranges
        poses = layout.poses
        self._odometry = _Assembly(layout, layout.odometry_unknowns(odometry))
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
        problem = self.problem
        odometry, closures, ranges = problem.odometry, problem.closures, problem.ranges
        moved = poses[problem.gauge] - problem.initial[problem.gauge]
        c = threshold[ranges.pair]
        error = range_errors(poses, ranges, calibration, problem.model)[0]
        return (
            odometry.cost(pose_errors(poses, odometry, corrected(odometry, calibration)))
            + closures.cost(pose_errors(poses, closures, closures.measured))
            + float(np.sum(c**2 * np.log1p((error / (c * ranges.sigma)) ** 2)))
            + problem.priors.cost(calibration)
            + float(moved @ moved) * GAUGE_SIGMA**-2
        )

    def gradient(self, poses: Array, calibration: Calibration, threshold: Array) -> Array:
        """(n + b,) half the derivative of the cost."""
        gradient = np.zeros(self.layout.band + self.layout.border)
        for where, factors in self._factors(poses, calibration, threshold, LEAST_CURVATURE):
            where.add_gradient(gradient, factors)
        self._add_pull_of_priors(gradient, poses, calibration)
        return gradient

    def at(
        self,
        poses: Array,
        calibration: Calibration,
        threshold: Array,
        least: float = LEAST_CURVATURE,
    ) -> tuple[System, Array]:
        """A matrix close to half the second derivative of the cost, and the gradient.

        Args:
            least: see `bias_prior.LEAST_CURVATURE`.
        """
        layout = self.layout
        system, gradient = System.empty(layout), np.zeros(layout.band + layout.border)
        for where, factors in self._factors(poses, calibration, threshold, least):
            where.add_matrix(system, factors)
            where.add_gradient(gradient, factors)
        self._add_heavy_priors(system, calibration, least)
        self._add_gaussian_priors(system)
        self._add_pull_of_priors(gradient, poses, calibration)
        return system, gradient

    def claimed(
        self, poses: Array, calibration: Calibration, threshold: Array, claims: Array
    ) -> System:
        """What is known at the solution: a system whose inverse is the covariance to be claimed.

        Weights that make a good estimate are no honest claim. Here ranges that share their errors
        count as such, and priors are as wide as they are configured.

        Args:
            claims: see `linearised.weighed_ranges`.
        """
        layout, priors = self.layout, self.problem.priors
        system = self._weighed(poses, calibration, threshold, claims)
        system.add_prior(layout.bias, priors.bias.sigma**-2)
        system.add_prior(layout.team_bias, priors.bias.sigma**-2)
        system.add_prior(layout.scale, priors.scale**-2.0)
        return system

    def weighed(self, poses: Array, calibration: Calibration, threshold: Array) -> System:
        """What the factors say by their weights: what is left of an outlier's counts still."""
        claims = np.ones(self.problem.pairs)
        system = self._weighed(poses, calibration, threshold, claims)
        self._add_heavy_priors(system, calibration, LEAST_CURVATURE)
        return system

    def _weighed(
        self, poses: Array, calibration: Calibration, threshold: Array, claims: Array
    ) -> System:
        problem = self.problem
        system = System.empty(self.layout)
        self._odometry.add_matrix(system, linearised.odometry_at(problem, poses, calibration))
        if len(problem.closures):
            self._closures.add_matrix(system, linearised.closures_at(problem, poses))
        ranges = linearised.weighed_ranges(problem, poses, calibration, threshold, claims)
        self._ranges.add_matrix(system, ranges)
        self._add_gaussian_priors(system)
        return system

    def _factors(
        self, poses: Array, calibration: Calibration, threshold: Array, least: float
    ) -> Iterator[tuple[_Assembly, Linearised]]:
        problem = self.problem
        yield self._odometry, linearised.odometry_at(problem, poses, calibration)
        if len(problem.closures):
            yield self._closures, linearised.closures_at(problem, poses)
        yield self._ranges, linearised.ranges_at(problem, poses, calibration, threshold, least)

    def _add_heavy_priors(self, system: System, calibration: Calibration, least: float) -> None:
        layout, priors = self.layout, self.problem.priors
        team = float(calibration.team_bias[0])
        own = priors.bias.own_curvature(calibration.bias - team, least)
        system.add_difference(layout.bias, layout.team_bias, own)
        system.add_prior(layout.team_bias, priors.bias.team_curvature(team, least))
        system.add_prior(layout.scale, priors.scale_curvature(calibration.scale, least))

    def _add_gaussian_priors(self, system: System) -> None:
        layout, priors = self.layout, self.problem.priors
        system.add_prior(layout.yaw, priors.yaw**-2.0)
        system.add_prior(layout.near_bias, priors.near_bias**-2.0)
        system.add_prior(layout.poses[self.problem.gauge], GAUGE_SIGMA**-2)

    def _add_pull_of_priors(self, gradient: Array, poses: Array, calibration: Calibration) -> None:
        layout, problem = self.layout, self.problem
        priors, gauge = problem.priors, problem.gauge
        team = float(calibration.team_bias[0])
        pull = priors.bias.own_pull(calibration.bias - team)
        gradient[layout.bias] += pull
        gradient[layout.team_bias] += priors.bias.team_pull(team) - pull.sum()
        gradient[layout.scale] += priors.scale_pull(calibration.scale)
        gradient[layout.yaw] += calibration.yaw / priors.yaw**2
        gradient[layout.near_bias] += calibration.near_bias / priors.near_bias**2
        moved = poses[gauge] - problem.initial[gauge]
        gradient[layout.poses[gauge]] += moved / GAUGE_SIGMA**2
