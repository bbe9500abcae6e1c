"""A problem at a point and how far it is believed: what systems of a kept factor are made of."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drslamd.slam.optimizer.banded.assembly import LeanSystem, System
from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE
from drslamd.slam.optimizer.factor_errors import RangeErrors, corrected, pose_errors, range_errors
from drslamd.slam.optimizer.kept.head import Flags
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class Believed:
    """A problem at a point, and how much is believed of it: what a system is made of.

    Attributes:
        claims: (pairs,) for `Equations.claimed`; None for `Equations.weighed`.
    """

    problem: Problem
    point: Point
    claims: Array | None = None

    def of_factors(self, which: Flags, layout: BandLayout, poses: Array) -> System:
        """What some factors add where the poses are these (k, 3).

        Args:
            which: (all,) of odometry, closures and ranges, in this order.
        """
        equations, point, claims = self._chosen(which, layout)
        some, calibration = equations.problem, self.point.calibration
        sight = range_errors(poses, some.ranges, calibration, some.model)
        link = pose_errors(poses, some.odometry, corrected(some.odometry, calibration))
        return equations.factors_weighed(
            replace(point, poses=poses, link=link, sight=sight), claims
        )

    def of_head(self, which: Flags, layout: BandLayout, is_curved: bool) -> LeanSystem:
        """The same of the many of a head, with the priors that never change.

        Args:
            is_curved: the whole second derivative instead?
        """
        equations, point, claims = self._chosen(which, layout)
        if is_curved:
            system = equations.factors_curved_leanly(point)
        else:
            system = equations.factors_weighed_leanly(point, claims)
        equations.add_gaussian_priors(system)
        return system

    def _chosen(self, which: Flags, layout: BandLayout) -> tuple[Equations, Point, Array]:
        """Equations of some factors, the point for them, and claims."""
        problem = self.problem
        cuts = np.cumsum([len(problem.odometry), len(problem.closures)])
        odometry, closures, ranges = np.split(which, cuts)
        some = replace(
            problem,
            odometry=problem.odometry.chosen(odometry),
            closures=problem.closures.chosen(closures),
            ranges=problem.ranges.chosen(ranges),
        )
        sight = RangeErrors(*(column[ranges] for column in self.point.sight))
        point = replace(self.point, link=self.point.link[odometry], sight=sight)
        claims = problem.widths if self.claims is None else self.claims
        return Equations(some, layout=layout), point, claims

    def add_priors(self, system: System, layout: BandLayout) -> None:
        """Those that depend on where the constants are."""
        equations = Equations(self.problem, layout=layout)
        calibration = self.point.calibration
        if self.claims is None:
            equations.add_heavy_priors(system, calibration, LEAST_CURVATURE)
        else:
            equations.add_claimed_priors(system, calibration)
