"""Errors of factors, each worked out by hand or with matrices."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_problems import pose_edges, straight_by_turn, team_problem
from slam_scenes import inverted, matrix, product, wander

from drslamd.slam.optimizer.factor_errors import corrected, pose_errors, range_errors
from drslamd.slam.optimizer.problem import BetweenFactors, OdometryFactors
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.range_model import LINKTRACK, RangeModel


def test_an_error_of_a_relative_pose_is_predicted_minus_measured_seen_from_the_first() -> None:
    poses = wander(np.random.default_rng(0), 3, 2.0)
    edges = pose_edges(np.random.default_rng(1), poses, [(0, 1), (2, 0)], (0.1, 0.1, 0.1))
    errors = pose_errors(poses, edges, edges.measured)
    for error, i, j, measured in zip(errors, edges.i, edges.j, edges.measured, strict=True):
        seen = product(inverted(poses[i]), poses[j])
        assert error[:2] == pytest.approx(seen[:2] - measured[:2])
        assert error[2] == pytest.approx(math.remainder(seen[2] - measured[2], 2 * math.pi))


@pytest.mark.parametrize(("seen", "measured", "error"), [(3.1, -3.1, 6.2), (-3.1, 3.1, -6.2)])
@pytest.mark.row("O12")
def test_an_error_of_a_heading_is_the_short_way_around(
    seen: float, measured: float, error: float
) -> None:
    edges = BetweenFactors(
        np.array([0]), np.array([1]), np.array([[0.0, 0.0, measured]]), np.eye(3)[None]
    )
    poses = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, seen]])
    wrapped = error - math.copysign(2 * math.pi, error)
    assert pose_errors(poses, edges, edges.measured)[0, 2] == pytest.approx(wrapped)


def test_scale_shortens_a_link_and_yaw_rate_bends_it_over_half_of_the_way() -> None:
    """What wheels that are 10 % and 0.02 rad/m wrong count, put right again."""
    way, turn, scale, yaw = 2.0, 0.3, 0.1, 0.02
    chord = matrix((0, 0, 0.4)) @ [way, 0, 1]
    odometry = OdometryFactors(
        np.array([0, 0]),
        np.array([1, 1]),
        np.array([[*chord[:2], turn], [*chord[:2], turn]]),
        np.tile(np.eye(3), (2, 1, 1)),
        robot=np.array([0, 1]),
        by_yaw=np.tile([-way / 2 * chord[1], way / 2 * chord[0], way], (2, 1)),
        by_turn=np.zeros((2, 3)),
    )
    known = replace(Calibration.zero(0, 2), scale=np.array([0.0, scale]), yaw=np.array([0.0, yaw]))
    right = corrected(odometry, known)
    assert right[0] == pytest.approx([*chord[:2], turn])
    # turned back by half of what the yaw rate added, to first order in it and in scale
    expected = matrix((0, 0, -yaw * way / 2)) @ [*(1 - scale) * chord[:2], 1]
    assert right[1, :2] == pytest.approx(expected[:2], abs=2 * scale * yaw)
    assert right[1, 2] == pytest.approx(turn - yaw * way)


def test_turns_that_are_longer_turn_a_link_on_by_half_of_what_they_lack() -> None:
    """A turn of 0.3 rad that was one of 0.36, along an arc whose chord then stands 0.03 rad more
    to the left; in the other direction the same."""
    chords = np.array([[2.0, 0.3, 0.3], [2.0, -0.3, -0.3], [2.0, 0.3, 0.3]])
    one = np.zeros(3, dtype=int)
    odometry = OdometryFactors(
        one,
        one,
        chords,
        np.tile(np.eye(3), (3, 1, 1)),
        robot=np.array([1, 1, 0]),
        by_yaw=np.zeros((3, 3)),
        by_turn=straight_by_turn(chords),
    )
    right = corrected(odometry, replace(Calibration.zero(0, 2), turn=np.array([0.0, 0.2])))
    for link, sign in zip(right[:2], (1, -1), strict=True):
        expected = product((0.0, 0.0, sign * 0.03), (2.0, sign * 0.3, sign * 0.33))
        # to first order
        assert link == pytest.approx(expected, abs=1e-3)
        assert link[2] == pytest.approx(sign * 0.36)
    assert right[2] == pytest.approx(chords[2])


def test_turns_and_ways_that_both_count_half_are_put_right_together() -> None:
    """An arc of 2 m and 0.3 rad, all of which was counted half, chord and turn."""
    whole = np.array([2 * math.cos(0.15), 2 * math.sin(0.15), 0.3])
    counted = np.array([[math.cos(0.075), math.sin(0.075), 0.15]])
    one = np.zeros(1, dtype=int)
    odometry = OdometryFactors(
        one, one, counted, np.eye(3)[None], one, np.zeros((1, 3)), straight_by_turn(counted)
    )
    known = replace(Calibration.zero(0, 1), scale=np.array([-1.0]), turn=np.array([1.0]))
    # to first order in a turn of 0.075 rad
    assert corrected(odometry, known)[0] == pytest.approx(whole, abs=2 * 0.075**2)


def test_an_antenna_beside_its_place_moves_with_the_robot_as_it_stood() -> None:
    """Against poses multiplied as matrices; robots stood turned against their keyframes, and what
    odometry carried is where its constants let it be."""
    problem, _ = team_problem(2, robots=3, count=4, is_thinned=True)
    poses, rng = problem.initial, np.random.default_rng(3)
    ranges = replace(problem.ranges, turned=rng.normal(0, 0.5, problem.ranges.turned.shape))
    antenna = np.array([[0.2, -0.1], [0.0, 0.3], [-0.2, -0.2]])
    yaw, scale = np.array([0.01, -0.03, 0.02]), np.array([0.1, 0.05, -0.2])
    known = replace(Calibration.zero(3, 3), antenna=antenna, yaw=yaw, scale=scale)
    found = range_errors(poses, ranges, known, LINKTRACK)
    moves = np.zeros((len(ranges), 2, 2, 2))
    moves[ranges.carried.rows] = ranges.carried.moves
    assert len(ranges.carried.rows) == 4
    for m, robots in enumerate(ranges.robots):
        ends = []
        for end, (k, q) in enumerate(((ranges.i, ranges.q_i), (ranges.j, ranges.q_j))):
            by_yaw, by_scale = moves[m, end]
            there = q[m] - yaw[robots[end]] * by_yaw - scale[robots[end]] * by_scale
            turn = (*there, ranges.turned[m, end])
            ends.append(product(poses[k[m]], turn, (*antenna[robots[end]], 0.0))[:2])
        apart = float(np.hypot(*(ends[1] - ends[0])))
        assert found.error[m] == pytest.approx(apart - ranges.measured[m])
        arms = ends[0] - poses[ranges.i[m], :2], ends[1] - poses[ranges.j[m], :2]
        assert (found.arm_i[m], found.arm_j[m]) == pytest.approx(tuple(complex(*a) for a in arms))


@pytest.mark.parametrize("model", [LINKTRACK, RangeModel(near_reach_m=6.0)])
def test_an_error_of_a_range_is_predicted_minus_measured_with_its_biases(
    model: RangeModel,
) -> None:
    problem, _ = team_problem(2, robots=3, count=4)
    poses, r = problem.initial, problem.ranges
    bias = np.array([0.2, -0.1, 0.3])
    # what biases have in common is part of them, and does not count twice
    known = replace(
        Calibration.zero(3, 3), bias=bias, near_bias=np.array([-0.25]), team_bias=np.array([0.7])
    )
    error, sight, arm_i, arm_j, shape, slope = range_errors(poses, r, known, model)
    for m in range(len(r)):
        i, j = (product(poses[k], (*q, 0.0)) for k, q in ((r.i[m], r.q_i[m]), (r.j[m], r.q_j[m])))
        apart = (j - i)[:2]
        distance = math.hypot(*apart)
        near = -0.25 * math.exp(-distance / model.near_reach_m)
        assert error[m] == pytest.approx(distance + bias[r.pair[m]] + near - r.measured[m])
        assert shape[m] == pytest.approx(math.exp(-distance / model.near_reach_m))
        farther = -0.25 * math.exp(-(distance + 1e-6) / model.near_reach_m)
        assert slope[m] == pytest.approx(1 + (farther - near) / 1e-6)
        assert sight[m] == pytest.approx(complex(*apart) / math.hypot(*apart))
        assert arm_i[m] == pytest.approx(complex(*(i - poses[r.i[m]])[:2]))
        assert arm_j[m] == pytest.approx(complex(*(j - poses[r.j[m]])[:2]))
