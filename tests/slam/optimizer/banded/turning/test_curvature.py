"""Second derivatives of the team's cost, against finite differences of its gradient."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dense_problems import matrix_of
from slam_problems import mismounted, no_ranges, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded.assembly import System
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.turning.chart import TurningChart
from drslamd.slam.optimizer.bias_prior import WHOLE
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

STEP = 1e-6


def antennas_in_doubt() -> Problem:
    """Ranges that odometry has carried, from antennas that are no longer where they were."""
    team = team_problem(1, robots=3, count=6, is_thinned=True)
    problem = mismounted(*team, turned_sigma=0.2)
    number = np.arange(3)
    return replace(problem, doubted=Doubted(track=number < 0, antenna=number != 1))


PROBLEMS = {
    "ranges and closures": team_problem(2, robots=3, count=6, closures=3)[0],
    "carried ranges": team_problem(1, robots=2, count=7, is_thinned=True)[0],
    "antennas in doubt": antennas_in_doubt(),
    "no ranges": replace(team_problem(2, robots=2, count=5)[0], ranges=no_ranges()),
    "blocked sight": replace(team_problem(2, robots=2, count=5)[0], blocked=np.ones(1, dtype=bool)),
    "a gauge in the middle": replace(team_problem(4, robots=2, count=6)[0], gauge=5),
}


def beside(problem: Problem) -> tuple[Array, Calibration]:
    """A point where everything but the gauge is pulled at: that is held so tightly that nothing
    else would be seen."""
    rng = np.random.default_rng(5)
    robots = len(problem.priors.scale)
    start = Calibration.zero(problem.pairs, robots)
    constants = {"bias": problem.pairs, "scale": robots, "yaw": robots, "near_bias": 1}
    moved = {name: rng.normal(0, 0.01, n) for name, n in constants.items()}
    # (a small one would curve too little to be missed)
    moved["near_bias"] -= 0.3
    antenna = rng.uniform(-0.01, 0.01, (robots, 2)) * problem.doubted.antenna[:, None]
    poses = problem.initial + rng.normal(0, 0.1, problem.initial.shape)
    poses[problem.gauge] = problem.initial[problem.gauge]
    return poses, replace(start, antenna=antenna, **moved)


def by_differences(equations: Equations, point: Point) -> Array:
    """(n, n) in the coordinates of a chart with nobody around."""
    problem, layout = equations.problem, equations.layout
    chart = TurningChart(point.poses, problem.gauge)

    def gradient(step: Array) -> Array:
        there = point.calibration.plus(layout.calibration(step))
        after = Point.of(problem, chart.poses(step[layout.poses]), there)
        found = equations.gradient(replace(after, threshold=point.threshold))
        found[layout.poses] = chart.pulled(found[layout.poses], step[layout.poses])
        return found

    units = STEP * np.eye(layout.band + layout.border)
    return np.stack([(gradient(e) - gradient(-e)) / (2 * STEP) for e in units])


@pytest.mark.parametrize("name", list(PROBLEMS))
def test_what_factors_alone_curve_is_the_second_derivative_but_for_priors(name: str) -> None:
    equations = Equations(PROBLEMS[name])
    point = Point.of(equations.problem, *beside(equations.problem))
    expected, gradient = equations.at(point, WHOLE)
    equations.add_curvature(expected, point, gradient)
    found = equations.factors_curved_leanly(point)
    n = equations.layout.band
    whole = System(found.columns(0, n), found.border.rows(0, n), found.corner)
    equations.add_heavy_priors(whole, point.calibration, WHOLE)
    equations.add_gaussian_priors(whole)
    scale = np.abs(matrix_of(expected)).max()
    assert np.allclose(matrix_of(whole), matrix_of(expected), rtol=1e-9, atol=1e-12 * scale)


@pytest.mark.parametrize("name", list(PROBLEMS))
def test_with_the_curvature_a_system_is_the_second_derivative(name: str) -> None:
    equations = Equations(PROBLEMS[name])
    point = Point.of(equations.problem, *beside(equations.problem))
    system, gradient = equations.at(point, WHOLE)
    without = matrix_of(system)
    equations.add_curvature(system, point, gradient)
    expected = by_differences(equations, point)
    sizes = np.sqrt(np.abs(np.diag(expected)))
    off = np.abs(matrix_of(system) - expected) / np.outer(sizes, sizes)
    assert off.max() < 1e-5
    assert (np.abs(without - expected) / np.outer(sizes, sizes)).max() > 1e-3
