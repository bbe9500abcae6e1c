"""Normal equations of the team's problem, in the layout of a band with a border."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.layout import NOWHERE, BandLayout
from drslamd.slam.optimizer.banded.linearised import Linearised
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE
from drslamd.slam.optimizer.mounting_prior import ANTENNA, TRACK
from drslamd.slam.optimizer.problem import Problem, pose_errors
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array, Index

GAUGE_SIGMA = 1e-5
"""The gauge pose is held to 10 um and 10 urad: far below all noise, far above rounding."""


SPARSE = 32
"""Where a matrix has so many times more entries than are added to it, they are added one by one."""


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

    def add_blocks(self, unknowns: Index, stiffness: Array) -> None:
        """Hold m groups of unknowns (m, d) of the border with information (m, d, d)."""
        at = unknowns - len(self.border)
        self.corner[at[:, :, None], at[:, None, :]] += stiffness

    def add_difference(self, unknowns: Index, one: Index, stiffness: Array) -> None:
        """Hold unknowns (k,) of the border beside one other (1,) with information (k, k)."""
        n = len(self.border)
        many, single = unknowns - n, one - n
        self.corner[np.ix_(many, many)] += stiffness
        self.corner[many, single] -= stiffness.sum(axis=0)
        self.corner[single, many] -= stiffness.sum(axis=0)
        self.corner[single, single] += stiffness.sum()


class _Assembly:
    """Where the blocks of one set of factors go in the system; the same in every iteration.

    Blocks are symmetric, so each two columns of a Jacobian are multiplied once.
    """

    def __init__(self, layout: BandLayout, unknowns: Index) -> None:
        """
        Args:
            unknowns: (m, c) on which each factor depends.
        """
        self._layout = layout
        # most often no mounting is an unknown
        self._columns = np.flatnonzero((unknowns != NOWHERE).any(axis=0))
        self._unknowns = unknowns[:, self._columns]
        self._twos = np.tril_indices(len(self._columns))

    @cached_property
    def _places(self) -> tuple[tuple[Index, Index], ...]:
        """Of the products (t, m) of columns: which are in band, border and corner, and where."""
        n, b = self._layout.band, self._layout.border
        each = np.ascontiguousarray(self._unknowns.T)
        one, other = (each[of] for of in self._twos)
        row, column = np.maximum(one, other).ravel(), np.minimum(one, other).ravel()
        is_known, is_high, is_low = column != NOWHERE, row >= n, column >= n
        in_band = np.flatnonzero(is_known & ~is_high)
        in_border = np.flatnonzero(is_known & is_high & ~is_low)
        in_corner, apart = np.flatnonzero(is_low), np.flatnonzero(is_low & (row != column))
        below = (row[in_corner] - n) * b + column[in_corner] - n
        above = (column[apart] - n) * b + row[apart] - n
        return (
            (in_band, (row[in_band] - column[in_band]) * n + column[in_band]),
            (in_border, column[in_border] * b + row[in_border] - n),
            (np.concatenate([in_corner, apart]), np.concatenate([below, above])),
        )

    @cached_property
    def _entries(self) -> tuple[Index, Index]:
        """The same of their right-hand sides."""
        unknowns = self._unknowns.ravel()
        known = np.flatnonzero(unknowns != NOWHERE)
        return known, unknowns[known]

    def add_matrix(self, system: System, factors: Linearised) -> None:
        """Add J' W J."""
        products = self._products(factors).ravel()
        parts = (system.band, system.border, system.corner)
        for part, (which, at) in zip(parts, self._places, strict=True):
            if len(at) < part.size // SPARSE:
                np.add.at(part.reshape(-1), at, products[which])
            else:
                part += _sums(at, products[which], part)

    def _products(self, factors: Linearised) -> Array:
        """(t, m) entries of J' W J."""
        jacobian = np.ascontiguousarray(factors.jacobian[:, :, self._columns].transpose(2, 1, 0))
        weighed = np.einsum("cem,mde->cdm", jacobian, factors.information)
        one, other = self._twos
        return np.asarray(np.einsum("tdm,tdm->tm", jacobian[one], weighed[other]))

    def add_gradient(self, gradient: Array, factors: Linearised) -> None:
        """Add J' f."""
        known, at = self._entries
        each = (factors.pull[:, None, :] @ factors.jacobian[:, :, self._columns]).ravel()
        gradient += _sums(at, each[known], gradient)


def _sums(at: Index, values: Array, like: Array) -> Array:
    return np.bincount(at, values, like.size).reshape(like.shape)


@dataclass(frozen=True)
class _Where:
    """The assemblies of one problem."""

    odometry: _Assembly
    closures: _Assembly
    ranges: _Assembly
    carried: _Assembly

    @staticmethod
    def of(problem: Problem, layout: BandLayout) -> _Where:
        ranges = problem.ranges
        ends = layout.poses[np.stack([problem.closures.i, problem.closures.j], axis=-1)]
        return _Where(
            _Assembly(layout, layout.odometry_unknowns(problem.odometry)),
            _Assembly(layout, ends.reshape(-1, 6)),
            _Assembly(layout, layout.range_unknowns(ranges.chosen(~ranges.is_carried))),
            _Assembly(layout, layout.carried_unknowns(ranges)),
        )

    def of_ranges(
        self, problem: Problem, point: Point, ranges: Linearised
    ) -> Iterator[tuple[_Assembly, Linearised]]:
        """Ranges as they were measured, and those that odometry has carried.

        Args:
            ranges: all of them, as if none was carried.
        """
        if not len(problem.ranges.carried.rows):
            yield self.ranges, ranges
            return
        yield self.ranges, ranges.chosen(~problem.ranges.is_carried)
        yield self.carried, linearised.carried_part(problem, point, ranges)


class Equations:
    """The normal equations of one problem, at any point."""

    def __init__(
        self, problem: Problem, like: Equations | None = None, layout: BandLayout | None = None
    ) -> None:
        """
        Args:
            like: of a problem with the same factors and unknowns, whatever it believes of them.
            layout: where it is not one of the whole problem.
        """
        self.problem = problem
        self.layout: BandLayout = layout or (like.layout if like else BandLayout.of(problem))
        self._like = like

    @cached_property
    def _where(self) -> _Where:
        return self._like._where if self._like else _Where.of(self.problem, self.layout)

    def cost(self, point: Point, threshold: Array) -> float:
        """Of all factors and priors.

        Args:
            threshold: (pairs,) sigmas beyond which a range loses weight.
        """
        problem = self.problem
        odometry, closures, ranges = problem.odometry, problem.closures, problem.ranges
        poses, calibration = point.poses, point.calibration
        moved = poses[problem.gauge] - problem.initial[problem.gauge]
        c = threshold[ranges.pair]
        return (
            odometry.cost(point.link)
            + closures.cost(pose_errors(poses, closures, closures.measured))
            + float(np.sum(c**2 * np.log1p((point.sight.error / (c * ranges.sigma)) ** 2)))
            + problem.priors.cost(calibration)
            + float(moved @ moved) * GAUGE_SIGMA**-2
        )

    def gradient(self, point: Point) -> Array:
        """(n + b,) half the derivative of the cost."""
        gradient = np.zeros(self.layout.band + self.layout.border)
        for where, factors in self._factors(point, LEAST_CURVATURE):
            where.add_gradient(gradient, factors)
        self.add_pull_of_priors(gradient, point)
        return gradient

    def at(self, point: Point, least: float = LEAST_CURVATURE) -> tuple[System, Array]:
        """A matrix close to half the second derivative of the cost, and the gradient.

        Args:
            least: see `bias_prior.LEAST_CURVATURE`.
        """
        layout = self.layout
        system, gradient = System.empty(layout), np.zeros(layout.band + layout.border)
        for where, factors in self._factors(point, least):
            where.add_matrix(system, factors)
            where.add_gradient(gradient, factors)
        self.add_heavy_priors(system, point.calibration, least)
        self.add_gaussian_priors(system)
        self.add_pull_of_priors(gradient, point)
        return system, gradient

    def claimed(self, point: Point, claims: Array) -> System:
        """What is known at the solution: a system whose inverse is the covariance to be claimed.

        Weights that make a good estimate are no honest claim. Here ranges that share their errors
        count as such, and priors are as wide as they are configured.

        Args:
            claims: see `linearised.weighed_ranges`.
        """
        system = self.factors_weighed(point, claims)
        self.add_gaussian_priors(system)
        self.add_claimed_priors(system, point.calibration)
        return system

    def add_claimed_priors(self, system: System, calibration: Calibration) -> None:
        """Those that are wider, or of another shape, than what makes a good estimate."""
        layout, priors = self.layout, self.problem.priors
        system.add_prior(layout.bias, priors.bias.sigma**-2)
        system.add_prior(layout.team_bias, priors.bias.sigma**-2)
        system.add_prior(layout.scale, priors.scale**-2.0)
        system.add_prior(layout.yaw, priors.yaw_claim(calibration.yaw))
        self._add_mounting_priors(system, calibration, LEAST_CURVATURE)

    def bias_belief(self, point: Point) -> Array:
        """(b, b) what the border gains where biases are as believed instead of as claimed."""
        layout, prior = self.layout, self.problem.priors.bias
        gain = System.empty(layout)
        self._add_bias_prior(gain, point.calibration, LEAST_CURVATURE)
        gain.add_prior(layout.bias, -(prior.sigma**-2))
        gain.add_prior(layout.team_bias, -(prior.sigma**-2))
        return gain.corner

    def weighed(self, point: Point) -> System:
        """What the factors say by their weights: what is left of an outlier's counts still."""
        claims = np.ones(self.problem.pairs)
        system = self.factors_weighed(point, claims)
        self.add_gaussian_priors(system)
        self.add_heavy_priors(system, point.calibration, LEAST_CURVATURE)
        return system

    def factors_weighed(self, point: Point, claims: Array) -> System:
        """What the factors alone say by weights and claims."""
        problem = self.problem
        system = System.empty(self.layout)
        self._where.odometry.add_matrix(system, linearised.odometry_at(problem, point))
        if len(problem.closures):
            self._where.closures.add_matrix(system, linearised.closures_at(problem, point.poses))
        ranges = linearised.weighed_ranges(problem, point, claims)
        for where, factors in self._where.of_ranges(problem, point, ranges):
            where.add_matrix(system, factors)
        return system

    def _factors(self, point: Point, least: float) -> Iterator[tuple[_Assembly, Linearised]]:
        problem = self.problem
        yield self._where.odometry, linearised.odometry_at(problem, point)
        if len(problem.closures):
            yield self._where.closures, linearised.closures_at(problem, point.poses)
        ranges = linearised.ranges_at(problem, point, least)
        yield from self._where.of_ranges(problem, point, ranges)

    def add_heavy_priors(self, system: System, calibration: Calibration, least: float) -> None:
        """Those with heavy tails, of the constants of sensors."""
        layout, priors = self.layout, self.problem.priors
        self._add_bias_prior(system, calibration, least)
        system.add_prior(layout.scale, priors.scale_curvature(calibration.scale, least))
        system.add_prior(layout.yaw, priors.yaw_curvature(calibration.yaw, least))
        self._add_mounting_priors(system, calibration, least)

    def _add_bias_prior(self, system: System, calibration: Calibration, least: float) -> None:
        layout, prior = self.layout, self.problem.priors.bias
        team = float(calibration.team_bias[0])
        own = prior.own_curvature(calibration.bias - team, least)
        system.add_difference(layout.bias, layout.team_bias, own)
        system.add_prior(layout.team_bias, prior.team_curvature(team, least))

    def _add_mounting_priors(self, system: System, calibration: Calibration, least: float) -> None:
        layout, doubted = self.layout, self.problem.doubted
        for prior, numbers, values in (
            (TRACK, layout.turn[doubted.track, None], calibration.turn[doubted.track, None]),
            (ANTENNA, layout.antenna[doubted.antenna], calibration.antenna[doubted.antenna]),
        ):
            system.add_blocks(numbers, prior.curvature(values, least))

    def add_gaussian_priors(self, system: System) -> None:
        """Those of the gauge and of the near-range bias, which never change."""
        layout, priors = self.layout, self.problem.priors
        system.add_prior(layout.near_bias, priors.near_bias**-2.0)
        system.add_prior(layout.poses[self.problem.gauge], GAUGE_SIGMA**-2)

    def add_pull_of_priors(self, gradient: Array, point: Point) -> None:
        """Half the derivative of what all priors cost."""
        layout, problem, calibration = self.layout, self.problem, point.calibration
        priors, gauge = problem.priors, problem.gauge
        team = float(calibration.team_bias[0])
        pull = priors.bias.own_pull(calibration.bias - team)
        gradient[layout.bias] += pull
        gradient[layout.team_bias] += priors.bias.team_pull(team) - pull.sum()
        gradient[layout.scale] += priors.scale_pull(calibration.scale)
        doubted = problem.doubted
        turn, antenna = (
            TRACK.pull(calibration.turn[:, None])[:, 0],
            ANTENNA.pull(calibration.antenna),
        )
        gradient[layout.turn[doubted.track]] += turn[doubted.track]
        gradient[layout.antenna[doubted.antenna]] += antenna[doubted.antenna]
        gradient[layout.yaw] += priors.yaw_pull(calibration.yaw)
        gradient[layout.near_bias] += calibration.near_bias / priors.near_bias**2
        moved = point.poses[gauge] - problem.initial[gauge]
        gradient[layout.poses[gauge]] += moved / GAUGE_SIGMA**2
