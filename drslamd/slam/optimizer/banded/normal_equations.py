"""Normal equations of the team's problem, in the layout of a band with a border."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.assembly import Assembly, Bordered, LeanSystem, System
from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.linearised import Linearised
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.turning import curvature
from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE, WHOLE
from drslamd.slam.optimizer.factor_errors import pose_errors
from drslamd.slam.optimizer.mounting_prior import ANTENNA, TRACK
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array, Index

GAUGE_SIGMA = 1e-5
"""The gauge pose is held to 10 um and 10 urad: far below all noise, far above rounding."""


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
    def _assembly(self) -> Assembly:
        """Of the same sets as `_sets`."""
        return self._like._assembly if self._like else Assembly(self.layout, self._unknowns())

    def _unknowns(self) -> list[Index]:
        """On which the factors of each set depend."""
        problem, layout = self.problem, self.layout
        sets = [layout.odometry_unknowns(problem.odometry)]
        if len(problem.closures):
            ends = layout.poses[np.stack([problem.closures.i, problem.closures.j], axis=-1)]
            sets.append(ends.reshape(-1, 6))
        ranges = problem.ranges
        if not len(ranges.carried.rows):
            return [*sets, layout.range_unknowns(ranges)]
        plain = layout.range_unknowns(ranges.chosen(~ranges.is_carried))
        return [*sets, plain, layout.carried_unknowns(ranges)]

    @cached_property
    def _turning(self) -> Assembly:
        """Of ways from each pose to the next in time."""
        if self._like:
            return self._like._turning
        return Assembly(self.layout, [self.layout.ways()])

    @property
    def _has_antennas(self) -> bool:
        """Is any of them an unknown?"""
        return bool(self.problem.doubted.antenna.any())

    def _sets(self, point: Point, ranges: Linearised) -> list[Linearised]:
        """All factors.

        Args:
            ranges: all of them, as if odometry had carried none.
        """
        problem = self.problem
        sets = [linearised.odometry_at(problem, point)]
        if len(problem.closures):
            sets.append(linearised.closures_at(problem, point.poses))
        if not len(problem.ranges.carried.rows):
            return [*sets, ranges]
        plain = ranges.chosen(~problem.ranges.is_carried)
        return [*sets, plain, linearised.carried_part(problem, point, ranges)]

    def cost(self, point: Point, threshold: Array) -> float:
        """Of all factors and priors.

        Args:
            threshold: (pairs,) sigmas beyond which a range loses weight.
        """
        problem = self.problem
        odometry, closures, ranges = problem.odometry, problem.closures, problem.ranges
        poses, calibration = point.poses, point.calibration
        moved = poses[problem.gauge] - problem.initial[problem.gauge]
        cut = problem.cuts(threshold, point.sight.error) * ranges.sigma
        return (
            odometry.cost(point.link)
            + closures.cost(pose_errors(poses, closures, closures.measured))
            + float(problem.weight @ (cut**2 * np.log1p((point.sight.error / cut) ** 2)))
            + problem.priors.cost(calibration)
            + float(moved @ moved) * GAUGE_SIGMA**-2
        )

    def gradient(self, point: Point) -> Array:
        """(n + b,) half the derivative of the cost."""
        ranges = linearised.ranges_at(self.problem, point, antennas=self._has_antennas)
        gradient = self._assembly.gradient(self._sets(point, ranges))
        self.add_pull_of_priors(gradient, point)
        return gradient

    def at(self, point: Point, least: float = LEAST_CURVATURE) -> tuple[System, Array]:
        """A matrix close to half the second derivative of the cost, and the gradient.

        Args:
            least: see `bias_prior.LEAST_CURVATURE`.
        """
        ranges = linearised.ranges_at(self.problem, point, least, self._has_antennas)
        sets = self._sets(point, ranges)
        system, gradient = self._assembly.matrix(sets), self._assembly.gradient(sets)
        self.add_heavy_priors(system, point.calibration, least)
        self.add_gaussian_priors(system)
        self.add_pull_of_priors(gradient, point)
        return system, gradient

    def add_curvature(self, system: System, point: Point, gradient: Array) -> None:
        """Add to what `at` says what makes it the second derivative, if heavy tails are `WHOLE`, in
        the coordinates of a `TurningChart` with nobody around."""
        parts = curvature.of_factors(self.problem, point, self._has_antennas)
        system.add(self._assembly.matrix(parts))
        pulls = gradient[self.layout.poses]
        turning = curvature.of_turning(point.poses, pulls, self.problem.gauge)
        system.add(self._turning.matrix([turning]))

    def factors_curved_leanly(self, point: Point) -> LeanSystem:
        """Half the second derivative of what the factors alone cost, in the same coordinates."""
        ranges = linearised.ranges_at(self.problem, point, WHOLE, self._has_antennas)
        sets = self._sets(point, ranges)
        bends = curvature.of_factors(self.problem, point, self._has_antennas)
        whole = [curvature.both(*each) for each in zip(sets, bends, strict=True)]
        pulls = np.append(self._assembly.gradient(sets), 0.0)[self.layout.poses]
        turning = curvature.of_turning(point.poses, pulls, self.problem.gauge)
        assembly = Assembly(self.layout, [*self._unknowns(), self.layout.ways()])
        return assembly.lean_matrix([*whole, turning])

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
        alike = priors.bias.own_sigma**-2 * np.eye(len(layout.bias))
        system.add_difference(layout.bias, layout.team_bias, alike)
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
        system = self.factors_weighed(point, self.problem.widths)
        self.add_gaussian_priors(system)
        self.add_heavy_priors(system, point.calibration, LEAST_CURVATURE)
        return system

    def factors_weighed(self, point: Point, claims: Array) -> System:
        """What the factors alone say by weights and claims."""
        return self._assembly.matrix(self._weighed_sets(point, claims))

    def factors_weighed_leanly(self, point: Point, claims: Array) -> LeanSystem:
        """The same, of a border of which few entries are not zero."""
        return self._assembly.lean_matrix(self._weighed_sets(point, claims))

    def _weighed_sets(self, point: Point, claims: Array) -> list[Linearised]:
        ranges = linearised.weighed_ranges(self.problem, point, claims, self._has_antennas)
        return self._sets(point, ranges)

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
        if not doubted.any():
            return
        for prior, numbers, values in (
            (TRACK, layout.turn[doubted.track, None], calibration.turn[doubted.track, None]),
            (ANTENNA, layout.antenna[doubted.antenna], calibration.antenna[doubted.antenna]),
        ):
            system.add_blocks(numbers, prior.curvature(values, least))

    def add_gaussian_priors(self, system: Bordered) -> None:
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
        if doubted.any():
            turn = TRACK.pull(calibration.turn[:, None])[:, 0]
            gradient[layout.turn[doubted.track]] += turn[doubted.track]
            antenna = ANTENNA.pull(calibration.antenna)
            gradient[layout.antenna[doubted.antenna]] += antenna[doubted.antenna]
        gradient[layout.yaw] += priors.yaw_pull(calibration.yaw)
        gradient[layout.near_bias] += calibration.near_bias / priors.near_bias**2
        moved = point.poses[gauge] - problem.initial[gauge]
        gradient[layout.poses[gauge]] += moved / GAUGE_SIGMA**2
