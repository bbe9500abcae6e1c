"""A point carries its errors, and where ranges lose weight by how much they scatter there."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from dense_problems import link_residuals, packed, range_residuals, thresholds
from slam_problems import mismounted, no_ranges, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration


def somewhere() -> tuple[Problem, Array, Calibration]:
    """Three robots whose mountings are all in doubt, away from the solution."""
    problem = mismounted(*team_problem(1, robots=3, count=9, is_thinned=True), turned_sigma=0.2)
    problem = replace(problem, doubted=Doubted(np.ones(3, dtype=bool), np.ones(3, dtype=bool)))
    rng = np.random.default_rng(2)
    known = Calibration(
        bias=rng.normal(0, 0.1, 3),
        scale=rng.normal(0, 0.03, 3),
        yaw=rng.normal(0, 0.01, 3),
        near_bias=rng.normal(0, 0.1, 1),
        team_bias=rng.normal(0, 0.1, 1),
        turn=rng.normal(0, 0.1, 3),
        antenna=rng.normal(0, 0.1, (3, 2)),
    )
    return problem, problem.initial + rng.normal(0, 0.02, problem.initial.shape), known


def test_a_point_knows_the_errors_of_its_links_and_ranges() -> None:
    problem, poses, known = somewhere()
    point = Point.of(problem, poses, known)
    x = packed(poses, known, problem.doubted)
    assert point.sight.error / problem.ranges.sigma == pytest.approx(range_residuals(problem, x))
    whitened = np.linalg.solve(
        np.linalg.cholesky(problem.odometry.covariance), point.link[..., None]
    )
    count = 3 * len(problem.odometry)
    assert whitened.ravel() == pytest.approx(np.array(link_residuals(problem, x)[:count]))
    assert point.poses is poses
    assert point.calibration is known
    assert (point.steps, point.converged) == (0, False)


def test_errors_of_links_are_turned_the_short_way() -> None:
    problem, poses, known = somewhere()
    around = poses.copy()
    around[::3, 2] += 2 * math.pi
    assert np.allclose(Point.of(problem, around, known).link, Point.of(problem, poses, known).link)


@pytest.mark.parametrize("error", [0.005, 0.03])
def test_ranges_lose_weight_by_how_much_those_of_their_pair_scatter(error: float) -> None:
    """By the equation that inliers solve, of each pair for itself."""
    problem, _ = team_problem(3, robots=3, count=60, range_error=0.0)
    noise = np.random.default_rng(4).normal(0, error, len(problem.ranges))
    noise *= np.array([1.0, 0.5, 0.2])[problem.ranges.pair]
    nothing = Calibration.zero(3, 3)
    off = Point.of(problem, problem.initial, nothing).sight.error
    ranges = replace(problem.ranges, measured=problem.ranges.measured + off - noise)
    problem = replace(problem, ranges=ranges)
    point = Point.of(problem, problem.initial, nothing)
    expected = thresholds(problem, packed(problem.initial, nothing))
    assert point.threshold == pytest.approx(expected, rel=0.02)
    assert point.threshold[0] > point.threshold[2]


def test_without_ranges_thresholds_are_as_configured() -> None:
    problem, _ = team_problem(1, robots=3, count=4)
    problem = replace(problem, ranges=no_ranges())
    point = Point.of(problem, problem.initial, Calibration.zero(3, 3))
    assert point.threshold.tolist() == [2.5, 2.5, 2.5]
    assert point.sight.error.shape == (0,)
