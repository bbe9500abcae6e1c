"""Factors at a point: derivatives by differences, weights and pulls by their formulas."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from dense_problems import point_at
from slam_problems import mismounted, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.factor_errors import corrected, pose_errors, range_errors
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.range_model import LINKTRACK

PROBLEM = mismounted(*team_problem(1, robots=3, count=5, is_thinned=True), turned_sigma=0.2)
POSES = PROBLEM.initial + np.random.default_rng(2).normal(0, 0.1, PROBLEM.initial.shape)
KNOWN = Calibration(
    bias=np.array([0.1, -0.2, 0.05]),
    scale=np.array([0.03, -0.02, 0.1]),
    yaw=np.array([0.01, -0.02, 0.005]),
    near_bias=np.array([-0.2]),
    team_bias=np.array([0.03]),
    turn=np.array([0.2, -0.1, 0.05]),
    antenna=np.array([[0.1, -0.2], [0.3, 0.05], [-0.1, 0.2]]),
)
THRESHOLD = np.array([2.5, 1.0, 0.8])
HERE = point_at(PROBLEM, POSES, KNOWN, THRESHOLD)


def moved(k: int, part: int, h: float) -> Array:
    """The poses with one number changed."""
    out: Array = POSES.copy()
    out[k, part] += h
    return out


def by_poses(errors: Callable[[Array], Array], m: int, ends: tuple[int, int]) -> Array:
    """(d, 6) derivative of the errors of factor m by the poses at its ends."""
    h = 1e-6
    columns = [
        (errors(moved(k, part, h))[m] - errors(moved(k, part, -h))[m]) / (2 * h)
        for k in ends
        for part in range(3)
    ]
    return np.stack(columns, axis=-1)


def by_sensor(
    errors: Callable[[Calibration], Array], m: int, name: str, at: int | tuple[int, int]
) -> Array:
    """(d,) derivative of the errors of factor m by one constant."""
    h = 1e-6
    ends = []
    for step in (h, -h):
        values = getattr(KNOWN, name).copy()
        values[at] += step
        ends.append(errors(replace(KNOWN, **{name: values}))[m])
    return np.asarray((ends[0] - ends[1]) / (2 * h))


def of_links(problem: Problem, poses: Array, known: Calibration) -> Array:
    return pose_errors(poses, problem.odometry, corrected(problem.odometry, known))


def of_ranges(problem: Problem, poses: Array, known: Calibration) -> Array:
    return range_errors(poses, problem.ranges, known, problem.model)[0]


def test_links_are_differentiated_by_both_poses_scale_yaw_rate_and_turn() -> None:
    links = PROBLEM.odometry
    found = linearised.odometry_at(PROBLEM, HERE)
    assert np.array_equal(found.jacobian, linearised.odometry_jacobian(PROBLEM, HERE))
    for m in range(len(links)):
        poses = by_poses(lambda p: of_links(PROBLEM, p, KNOWN), m, (links.i[m], links.j[m]))
        assert np.allclose(found.jacobian[m, :, :6], poses, atol=1e-7)
        for column, name in ((6, "scale"), (7, "yaw"), (8, "turn")):
            each = by_sensor(lambda c: of_links(PROBLEM, POSES, c), m, name, links.robot[m])
            assert np.allclose(found.jacobian[m, :, column], each, atol=1e-7)


def test_closures_are_differentiated_by_both_poses() -> None:
    edges = PROBLEM.closures
    found = linearised.closures_at(PROBLEM, POSES)
    for m in range(len(edges)):
        each = by_poses(
            lambda p: pose_errors(p, edges, edges.measured), m, (edges.i[m], edges.j[m])
        )
        assert np.allclose(found.jacobian[m], each, atol=1e-7)


def test_links_and_closures_pull_by_their_information() -> None:
    links, edges = PROBLEM.odometry, PROBLEM.closures
    of_edges = pose_errors(POSES, edges, edges.measured)
    for found, errors, factors in (
        (linearised.odometry_at(PROBLEM, HERE), of_links(PROBLEM, POSES, KNOWN), links),
        (linearised.closures_at(PROBLEM, POSES), of_edges, edges),
    ):
        for m in range(len(factors)):
            expected = np.linalg.solve(factors.covariance[m], errors[m])
            assert found.pull[m] == pytest.approx(expected, rel=1e-5)
            assert found.information[m] @ factors.covariance[m] == pytest.approx(
                np.eye(3), abs=1e-6
            )


def test_ranges_are_differentiated_by_both_poses_biases_and_antennas() -> None:
    ranges = PROBLEM.ranges
    found = linearised.ranges_at(PROBLEM, HERE)
    assert found.jacobian.shape == (15, 1, 12)
    for m in range(len(ranges)):
        poses = by_poses(lambda p: of_ranges(PROBLEM, p, KNOWN), m, (ranges.i[m], ranges.j[m]))
        assert np.allclose(found.jacobian[m, 0, :6], poses, atol=1e-7)
        for column, name, at in ((6, "bias", ranges.pair[m]), (7, "near_bias", 0)):
            each = by_sensor(lambda c: of_ranges(PROBLEM, POSES, c), m, name, at)
            assert found.jacobian[m, 0, column] == pytest.approx(each, abs=1e-7)
        for column in range(8, 12):
            at = (ranges.robots[m, (column - 8) // 2], column % 2)
            each = by_sensor(lambda c: of_ranges(PROBLEM, POSES, c), m, "antenna", at)
            assert found.jacobian[m, 0, column] == pytest.approx(each, abs=1e-7)


def test_ranges_that_were_carried_are_differentiated_by_the_wheels_of_both_robots_as_well() -> None:
    ranges = PROBLEM.ranges
    plain = linearised.ranges_at(PROBLEM, HERE)
    found = linearised.carried_part(PROBLEM, HERE, plain)
    rows = ranges.carried.rows
    assert rows.tolist() == [1, 4, 7, 10, 13]
    assert found.jacobian.shape == (5, 1, 16)
    assert np.array_equal(found.jacobian[:, :, :12], plain.jacobian[rows])
    assert np.array_equal(found.information, plain.information[rows])
    assert np.array_equal(found.pull, plain.pull[rows])
    for at, m in enumerate(rows):
        for column, (name, end) in enumerate((("yaw", 0), ("scale", 0), ("yaw", 1), ("scale", 1))):
            robot = ranges.robots[m, end]
            each = by_sensor(lambda c: of_ranges(PROBLEM, POSES, c), m, name, robot)
            assert found.jacobian[at, 0, 12 + column] == pytest.approx(each, abs=1e-7)
            assert abs(each) > 1e-3


def test_the_near_range_bias_is_that_of_the_model_of_the_problem() -> None:
    other = replace(PROBLEM, model=replace(LINKTRACK, near_reach_m=1.0))
    found = linearised.ranges_at(other, point_at(other, POSES, KNOWN, np.full(3, 2.0)))
    plain = replace(KNOWN, bias=np.zeros(3), near_bias=np.zeros(1))
    distances = of_ranges(PROBLEM, POSES, plain) + PROBLEM.ranges.measured
    assert found.jacobian[:, 0, 7] == pytest.approx(np.exp(-distances))
    assert np.ptp(distances) > 1


@pytest.mark.parametrize("near_bias", [0.0, -0.2])
def test_noise_of_ranges_does_not_pull_at_the_near_range_bias(near_bias: float) -> None:
    """Ranges that are too long and as many that are as much too short say nothing of it."""
    known = replace(KNOWN, near_bias=np.array([near_bias]))
    right = PROBLEM.ranges.measured + of_ranges(PROBLEM, POSES, known)
    pull = np.zeros(len(right))
    for off in (0.2, -0.2):
        ranges = replace(PROBLEM.ranges, measured=right + off)
        problem = replace(PROBLEM, ranges=ranges)
        found = linearised.ranges_at(problem, point_at(problem, POSES, known, np.full(3, 2.0)))
        assert (np.abs(found.pull[:, 0] * found.jacobian[:, 0, 7]) > 1e-3).all()
        pull += found.pull[:, 0] * found.jacobian[:, 0, 7]
    assert pull == pytest.approx(0.0, abs=1e-9)


def a_range(sigmas: float, is_blocked: bool = False) -> linearised.Linearised:
    """One that is so many sigmas off, of a pair that loses weight at 2 sigmas."""
    ranges = PROBLEM.ranges.chosen(np.arange(len(PROBLEM.ranges)) == 4)
    # what is measured would be part of the near-range bias too
    known = replace(KNOWN, near_bias=np.zeros(1))
    error = of_ranges(replace(PROBLEM, ranges=ranges), POSES, known)
    ranges = replace(ranges, measured=ranges.measured + error - sigmas * ranges.sigma)
    blocked = np.arange(3) == ranges.pair[0] if is_blocked else None
    problem = replace(PROBLEM, ranges=ranges, blocked=blocked)
    return linearised.ranges_at(problem, point_at(problem, POSES, known, np.full(3, 2.0)))


@pytest.mark.parametrize("sigmas", [0.0, 0.5, -1.7, 2.5, -9.0])
def test_a_range_pulls_as_the_cost_of_cauchy_says(sigmas: float) -> None:
    """Half the derivative of c^2 log(1 + (e / (c sigma))^2) by e, sigma 0.05 m and c 2."""
    e, h = 0.05 * sigmas, 1e-7

    def cost(v: float) -> float:
        return float(4 * np.log1p((v / 0.1) ** 2))

    expected = (cost(e + h) - cost(e - h)) / (4 * h)
    assert a_range(sigmas).pull[0, 0] == pytest.approx(expected, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(("sigmas", "cut"), [(1.7, 2.0), (0.3, 2.0), (-0.3, 0.4), (-9.0, 0.4)])
def test_where_sight_is_blocked_ranges_that_are_too_long_lose_their_weight_sooner(
    sigmas: float, cut: float
) -> None:
    """Predicted minus measured: one that is too long is off to the negative side."""
    weight = 400 / (1 + (sigmas / cut) ** 2)
    found = a_range(sigmas, is_blocked=True)
    assert found.pull[0, 0] == pytest.approx(weight * 0.05 * sigmas, rel=1e-6)


@pytest.mark.parametrize("sigmas", [0.0, 0.5, -1.7, 1.80, 1.82, -9.0])
def test_a_range_bends_as_its_cost_does_down_to_a_tenth_of_its_weight(sigmas: float) -> None:
    """The second derivative meets a tenth of the weight at 0.9045 c, 1.809 sigmas."""
    share = (sigmas / 2) ** 2
    weight = 400 / (1 + share)
    bend = weight * (1 - share) / (1 + share)
    expected = bend if abs(sigmas) < 1.809 else weight / 10
    assert a_range(sigmas).information[0, 0, 0] == pytest.approx(expected, rel=1e-6)


def test_what_may_be_claimed_of_ranges_is_their_weight_over_what_they_are_as_wrong_by() -> None:
    claims = np.array([1.0, 2.0, 0.5])
    found = linearised.weighed_ranges(PROBLEM, HERE, claims)
    plain = linearised.ranges_at(PROBLEM, HERE)
    assert np.array_equal(found.jacobian, plain.jacobian)
    errors = of_ranges(PROBLEM, POSES, KNOWN)
    pair, sigma = PROBLEM.ranges.pair, PROBLEM.ranges.sigma
    for m in range(len(errors)):
        c = THRESHOLD[pair[m]] * sigma[m]
        expected = 1 / (1 + (errors[m] / c) ** 2) / (claims[pair[m]] * sigma[m]) ** 2
        assert found.information[m, 0, 0] == pytest.approx(expected)


def test_of_no_factors_nothing_is_said() -> None:
    none = np.zeros(len(PROBLEM.ranges), dtype=bool)
    problem = replace(PROBLEM, ranges=PROBLEM.ranges.chosen(none))
    point = point_at(problem, POSES, KNOWN, THRESHOLD)
    assert linearised.ranges_at(problem, point).jacobian.shape == (0, 1, 12)
