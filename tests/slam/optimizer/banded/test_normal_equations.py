"""The normal equations against dense residuals and finite differences."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from dense_problems import (
    bias_places,
    claimed_information,
    dense,
    heavy_curvature,
    information_of,
    jacobian,
    mounting_curvature,
    packed,
    places,
    point_at,
    range_residuals,
    range_weights,
    residual_vector,
    second,
    unpacked,
)
from slam_problems import mismounted, no_ranges, pose_edges, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded.banded_solver import solve
from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE, WEIGHT, WHOLE
from drslamd.slam.optimizer.mounting_prior import ANTENNA, TRACK
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

THRESHOLD = np.array([2.5, 1.5, 0.9])


def somewhere(problem: Problem, seed: int, sizes: float = 1.0) -> tuple[Array, Calibration]:
    """A point where nothing is zero."""
    rng = np.random.default_rng(seed)
    robots = len(problem.priors.scale)
    sensors = ((problem.pairs, 0.1), (robots, 0.03), (robots, 0.01), (1, 0.1), (1, 0.05))
    bias, scale, yaw, near, team = (rng.normal(0, sizes * sigma, n) for n, sigma in sensors)
    track, antenna = problem.doubted.track, problem.doubted.antenna
    # so little that the curvature of their priors is positive
    turn, beside = rng.uniform(-0.008, 0.008, robots), rng.uniform(-0.01, 0.01, (robots, 2))
    mountings = turn * track, beside * antenna[:, None]
    calibration = Calibration(bias, scale, yaw, near, team, *mountings)
    return problem.initial + rng.normal(0, sizes * 0.05, problem.initial.shape), calibration


def far_edges() -> Problem:
    """One pose that is joined to many others, and a gauge that reaches far."""
    problem, _ = team_problem(3, robots=2, count=14, closures=0)
    far = [(0, k) for k in range(18, 28, 2)] + [(9, 27)]
    edges = pose_edges(np.random.default_rng(4), problem.initial, far, (0.05, 0.05, 0.03))
    return replace(problem, closures=edges)


def small(robots: int) -> Problem:
    """The track of the first and the antennas of all but the second are in doubt."""
    problem = mismounted(
        *team_problem(1, robots=robots, count=6, is_thinned=True), turned_sigma=0.2
    )
    number = np.arange(robots)
    return replace(problem, doubted=Doubted(track=number == 0, antenna=number != 1))


@pytest.mark.parametrize("robots", [1, 2, 3])
def test_cost_and_gradient_are_those_of_the_dense_residuals(robots: int) -> None:
    problem = small(robots)
    poses, calibration = somewhere(problem, 2)
    x, threshold = packed(poses, calibration, problem.doubted), THRESHOLD[: problem.pairs]
    equations = Equations(problem)
    residuals = residual_vector(problem, x, threshold)
    point = point_at(problem, poses, calibration, threshold)
    cost = equations.cost(point, threshold)
    assert cost == pytest.approx(float(residuals @ residuals), rel=1e-9)
    gradient = jacobian(lambda v: residual_vector(problem, v, threshold), x).T @ residuals
    order = places(equations.layout)
    found = equations.gradient(point)[order]
    assert np.allclose(found, gradient, rtol=1e-5, atol=1e-4)
    _, again = equations.at(point)
    assert np.array_equal(again[order], found)


def test_where_sight_is_blocked_the_gradient_is_that_of_the_cost_too() -> None:
    problem = replace(small(3), blocked=np.ones(3, dtype=bool))
    poses, calibration = somewhere(problem, 2)
    equations, threshold = Equations(problem), THRESHOLD[:3]
    gradient = equations.gradient(point_at(problem, poses, calibration, threshold))
    assert equations.cost(point_at(problem, poses, calibration, threshold), threshold) < (
        Equations(small(3)).cost(point_at(problem, poses, calibration, threshold), threshold)
    )
    for at in ((1, 0), (5, 1), (17, 2)):
        step, costs = np.zeros_like(poses), []
        step[at] = 1e-6
        for moved in (poses - step, poses + step):
            point = point_at(problem, moved, calibration, threshold)
            costs.append(equations.cost(point, threshold))
        slope = (costs[1] - costs[0]) / 4e-6
        assert gradient[equations.layout.poses[at]] == pytest.approx(slope, rel=1e-4, abs=1e-3)


def widened(problem: Problem) -> tuple[Problem, Problem, Array]:
    """A problem with widths, the same by wider sigmas, and the widths."""
    wide = np.array([1.0, 1.35, 2.0])[: problem.pairs]
    sigma = problem.ranges.sigma * wide[problem.ranges.pair]
    by_sigma = replace(problem, ranges=replace(problem.ranges, sigma=sigma))
    return replace(problem, width=wide), by_sigma, wide


def test_a_range_of_some_width_weighs_as_with_so_wide_a_sigma_but_is_an_outlier_as_ever() -> None:
    by_width, by_sigma, wide = widened(small(3))
    poses, calibration = somewhere(by_width, 2)
    point = point_at(by_width, poses, calibration, THRESHOLD)
    other = point_at(by_sigma, poses, calibration, THRESHOLD / wide)
    one, two = Equations(by_width), Equations(by_sigma)
    assert one.cost(point, THRESHOLD) == pytest.approx(two.cost(other, THRESHOLD / wide), rel=1e-9)
    assert np.allclose(one.gradient(point), two.gradient(other), rtol=1e-9, atol=1e-9)
    for found, expected in (
        (one.at(point)[0], two.at(other)[0]),
        (one.weighed(point), two.weighed(other)),
    ):
        assert np.allclose(dense(found, one.layout), dense(expected, two.layout), rtol=1e-9)
    sent = replace(by_width, width=None)
    plain = point_at(sent, poses, calibration, THRESHOLD)
    claimed = one.claimed(point, THRESHOLD), Equations(sent).claimed(plain, THRESHOLD)
    here, there = (dense(system, one.layout) for system in claimed)
    assert np.array_equal(here, there)


@pytest.mark.parametrize("gauge", [0, 11])
def test_the_gauge_is_held_where_it_was(gauge: int) -> None:
    problem = replace(small(2), gauge=gauge)
    equations = Equations(problem)
    nothing = Calibration.zero(problem.pairs, 2)
    moved = problem.initial.copy()
    moved[gauge, 0] += 1e-3
    points = [point_at(problem, p, nothing, THRESHOLD[:1]) for p in (problem.initial, moved)]
    pulls = [equations.gradient(point) for point in points]
    at = equations.layout.poses[gauge, 0]
    # one millimetre at a sigma of 10 um; all else that holds the pose is a million times softer
    assert pulls[1][at] - pulls[0][at] == pytest.approx(1e-3 / 1e-5**2, rel=1e-3)


@pytest.mark.parametrize("least", [WHOLE, LEAST_CURVATURE])
@pytest.mark.parametrize("robots", [1, 2, 3])
def test_the_matrix_bends_as_the_cost_of_each_error_does(robots: int, least: float) -> None:
    """By Gauss and Newton, with the curvature of Cauchy's cost and of the priors' own."""
    problem = small(robots)
    poses, calibration = somewhere(problem, 2, 0.3)
    assert (problem.priors.scale_curvature(calibration.scale) > 0.1 / 0.03**2).all()
    x, threshold = packed(poses, calibration, problem.doubted), THRESHOLD[: problem.pairs]
    bends = []
    for e, c in zip(range_residuals(problem, x), threshold[problem.ranges.pair], strict=True):
        bend = second(partial(cauchy_cost, c), e) / 2
        bends.append(max(bend, least / (1 + (e / c) ** 2)))
    if robots > 1:
        assert bool(min(bends) < 0) is (least == WHOLE)
    expected = information_of(problem, x, np.array(bends)) + heavy_curvature(problem, x)
    expected += mounting_curvature(problem, x)
    equations = Equations(problem)
    point = point_at(problem, poses, calibration, threshold)
    system, _ = equations.at(point, least)
    assert close(dense(system, equations.layout), expected, 1e-4)
    if least == LEAST_CURVATURE:
        usual, _ = equations.at(point)
        assert np.array_equal(usual.band, system.band)


def cauchy_cost(c: float, e: float) -> float:
    return c**2 * math.log1p((e / c) ** 2)


def test_by_weights_the_matrix_is_nowhere_less_than_what_the_cost_can_bend() -> None:
    """Each heavy tail as the square that pulls as it does."""
    problem = small(3)
    poses, calibration = somewhere(problem, 2)
    x, prior = packed(poses, calibration, problem.doubted), problem.priors.bias
    expected = information_of(problem, x, range_weights(problem, x, THRESHOLD))
    mountings = ((doubted_turns(problem), TRACK), (doubted_antennas(problem), ANTENNA))
    for numbers, believed in mountings:
        for at in numbers:
            weight = (1 + len(at)) / 2 / (believed.width**2 + float(x[at] @ x[at]))
            expected[at, at] += weight + believed.most**-2
    first, team = 3 * len(poses), float(calibration.team_bias[0])
    own = calibration.bias - team
    held = (3 + 3) / (3 * prior.spread**2 + float(own @ own)) + prior.sigma**-2
    apart = np.zeros((3, len(x)))
    common = bias_places(problem)[-1]
    apart[:, first : first + 3], apart[:, common] = np.eye(3), -1
    expected += held * apart.T @ apart
    expected[common, common] += 1 / (prior.team**2 + team**2) + prior.sigma**-2
    scales = first + 3 + np.arange(3)
    expected[scales, scales] += 1 / (0.03**2 + calibration.scale**2)
    yaws = scales + 3
    expected[yaws, yaws] += 1 / (0.01**2 + calibration.yaw**2)
    equations = Equations(problem)
    system, _ = equations.at(point_at(problem, poses, calibration, THRESHOLD), WEIGHT)
    assert close(dense(system, equations.layout), expected, 1e-5)


def doubted_turns(problem: Problem) -> list[list[int]]:
    """Where they are in the order of `packed`, one by one."""
    first = int(bias_places(problem)[-1]) + 1
    return [[first + k] for k in range(int(problem.doubted.track.sum()))]


def doubted_antennas(problem: Problem) -> list[list[int]]:
    first = int(bias_places(problem)[-1]) + 1 + int(problem.doubted.track.sum())
    count = int(problem.doubted.antenna.sum())
    return [[first + 2 * k, first + 2 * k + 1] for k in range(count)]


def close(found: Array, expected: Array, tolerance: float) -> bool:
    """Every element beside what its diagonals are."""
    scale = np.sqrt(np.diag(expected))
    return bool(np.abs((found - expected) / np.outer(scale, scale)).max() < tolerance)


def test_at_the_solution_the_matrix_is_nearly_the_derivative_of_the_gradient() -> None:
    problem, _ = team_problem(5, robots=3, count=8, range_error=0.02, link_error=0.3)
    solution = solve(problem, tolerance=1e-9)
    equations = Equations(problem)
    threshold = np.full(3, 2.5)
    order = places(equations.layout)

    def gradient(v: Array) -> Array:
        poses, calibration = unpacked(problem, v)
        return equations.gradient(point_at(problem, poses, calibration, threshold))[order]

    hessian = jacobian(gradient, packed(solution.poses, solution.calibration))
    system, _ = equations.at(point_at(problem, solution.poses, solution.calibration, threshold))
    assert close(dense(system, equations.layout), hessian, 0.03)


def test_equations_of_another_belief_share_where_all_stands_and_are_the_same_as_new_ones() -> None:
    problem = small(3)
    links = problem.odometry
    other = replace(problem, odometry=replace(links, covariance=4 * links.covariance))
    first = Equations(problem)
    shared, fresh = Equations(other, like=first), Equations(other)
    assert shared.layout is first.layout
    point = point_at(problem, *somewhere(problem, 2), THRESHOLD)
    assert shared.cost(point, THRESHOLD) == fresh.cost(point, THRESHOLD)
    (one, pull), (two, same_pull) = (equations.at(point) for equations in (shared, fresh))
    assert np.array_equal(one.band, two.band)
    assert np.array_equal(one.border, two.border)
    assert np.array_equal(one.corner, two.corner)
    assert np.array_equal(pull, same_pull)
    assert shared.cost(point, THRESHOLD) < first.cost(point, THRESHOLD)


# what may be claimed, and what weighs


def far_or_small(kind: str) -> Problem:
    return far_edges() if kind == "border" else small(3)


@pytest.mark.parametrize("kind", ["band", "border"])
def test_what_is_claimed_are_dense_ranges_made_wider_and_priors_as_configured(kind: str) -> None:
    problem = far_or_small(kind)
    poses, calibration = somewhere(problem, 5)
    threshold, claims = THRESHOLD[: problem.pairs], np.array([2.0, 1.3, 0.7])[: problem.pairs]
    equations = Equations(problem)
    system = equations.claimed(point_at(problem, poses, calibration, threshold), claims)
    expected = claimed_information(
        problem, packed(poses, calibration, problem.doubted), threshold, claims
    )
    assert close(dense(system, equations.layout), expected, 1e-5)


def test_biases_are_claimed_to_be_as_much_alike_as_they_were_seen_to_be() -> None:
    problem = small(3)
    poses, calibration = somewhere(problem, 5)
    threshold, claims = THRESHOLD[:3], np.ones(3)
    bias = replace(problem.priors.bias, own_sigma=0.05)
    seen = replace(problem, priors=replace(problem.priors, bias=bias))
    found = []
    for each in (problem, seen):
        x = packed(poses, calibration, each.doubted)
        equations = Equations(each)
        system = equations.claimed(point_at(each, poses, calibration, threshold), claims)
        found.append(dense(system, equations.layout))
        assert close(found[-1], claimed_information(each, x, threshold, claims), 1e-5)
    assert not close(found[0], found[1], 1e-5)


def test_what_the_factors_weigh_is_the_same_with_the_priors_of_the_estimate() -> None:
    problem = small(3)
    poses, calibration = somewhere(problem, 5, 0.3)
    x = packed(poses, calibration, problem.doubted)
    equations = Equations(problem)
    system = equations.weighed(point_at(problem, poses, calibration, THRESHOLD))
    bare = information_of(problem, x, range_weights(problem, x, THRESHOLD))
    expected = bare + heavy_curvature(problem, x) + mounting_curvature(problem, x)
    assert close(dense(system, equations.layout), expected, 1e-4)


# where things stand


def test_poses_at_the_border_change_nothing() -> None:
    problem = far_edges()
    layout = BandLayout.of(problem)
    assert layout.band == 3 * 26
    assert layout.width == 3 * 3
    poses, calibration = somewhere(problem, 5, 0.5)
    equations = Equations(problem)
    threshold = np.array([20.0])
    x = packed(poses, calibration, problem.doubted)
    residuals = residual_vector(problem, x, threshold)
    gradient = jacobian(lambda v: residual_vector(problem, v, threshold), x).T @ residuals
    found = equations.gradient(point_at(problem, poses, calibration, threshold))[places(layout)]
    assert np.allclose(found, gradient, rtol=1e-5, atol=1e-3)


def test_without_ranges_and_closures_there_are_equations_too() -> None:
    problem, _ = team_problem(7, robots=2, count=5, closures=0)
    problem = replace(problem, ranges=no_ranges(), pairs=0)
    poses, calibration = somewhere(problem, 8)
    x, none = packed(poses, calibration, problem.doubted), np.zeros(0)
    residuals = residual_vector(problem, x, none)
    equations = Equations(problem)
    point = point_at(problem, poses, calibration, none)
    assert equations.cost(point, none) == pytest.approx(float(residuals @ residuals))
    system, _ = equations.at(point)
    assert system.corner.shape == (6, 6)
