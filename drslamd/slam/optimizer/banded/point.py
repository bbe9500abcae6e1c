"""A place on the way to the solution of the team's problem, and what ranges say there."""

from __future__ import annotations

from dataclasses import dataclass

from drslamd.slam.calibration.range_scatter import inlier_scatter
from drslamd.slam.optimizer.factor_errors import RangeErrors, corrected, pose_errors, range_errors
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class Point:
    """
    Attributes:
        poses: (k, 3)
        link: (m, 3) errors of odometry; sight: of all ranges.
        threshold: (pairs,) sigmas beyond which a range loses weight: it follows how much the
            ranges of a pair scatter, outliers left out.
        steps: how many were made to get here.
        converged: is this the solution?
    """

    poses: Array
    calibration: Calibration
    link: Array
    sight: RangeErrors
    threshold: Array
    steps: int = 0
    converged: bool = False

    @staticmethod
    def of(
        problem: Problem,
        poses: Array,
        calibration: Calibration,
        steps: int = 0,
        converged: bool = False,
    ) -> Point:
        ranges, model = problem.ranges, problem.model
        sight = range_errors(poses, ranges, calibration, model)
        scatter = inlier_scatter(
            sight.error, ranges.sigma, problem.by_pair, sigmas_cut=model.cauchy_sigmas
        )
        odometry, threshold = problem.odometry, model.cauchy_sigmas * scatter
        link = pose_errors(poses, odometry, corrected(odometry, calibration))
        return Point(poses, calibration, link, sight, threshold, steps, converged)
