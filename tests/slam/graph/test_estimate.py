"""What module 3 says, looked up by robot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, inverted, product, same_pose

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph.estimate import LEAST_SCALE, Learned, TeamEstimate, Trajectory
from drslamd.slam.odometry.correction import Correction


def estimate_of(robots: list[int], claimed: int) -> TeamEstimate:
    """Of the first so many robots something is claimed."""
    trajectories = {
        robot: Trajectory(Chain(robot, 1), np.array([0]), np.zeros((1, 3))) for robot in robots
    }
    size = 3 * claimed
    joint = np.arange(size * size, dtype=float).reshape(size, size)
    return TeamEstimate(Segment(robots[0], 1, 0), trajectories, joint)


def test_each_robot_has_its_block_in_the_order_of_the_trajectories() -> None:
    estimate = estimate_of([4, 9, 2], 3)
    for number, robot in enumerate((4, 9, 2)):
        found = estimate.covariance(robot)
        assert found is not None
        first = 30 * number
        assert found.tolist() == [[first + 9 * row + k for k in range(3)] for row in range(3)]


@pytest.mark.parametrize(
    ("learned", "left"),
    [({}, 0.1), ({4: 0.03}, math.hypot(0.03, LEAST_SCALE)), ({4: 0.2}, 0.1), ({9: 0.03}, 0.1)],
)
def test_a_scale_that_was_learned_is_wrong_no_longer(
    learned: dict[int, float], left: float
) -> None:
    scale = {robot: Learned(0.05, sigma) for robot, sigma in learned.items()}
    team, noise = replace(estimate_of([4, 9], 2), scale=scale), replace(NOISE, scale=0.1)
    found = team.noise_left(4, noise)
    assert found.scale == pytest.approx(left)
    assert found == replace(noise, scale=found.scale)


def test_of_robots_beyond_those_that_are_claimed_and_of_strangers_nothing_is_known() -> None:
    estimate = estimate_of([4, 9, 2], 1)
    assert estimate.covariance(4) is not None
    assert estimate.covariance(9) is None
    assert estimate.covariance(2) is None
    assert estimate.covariance(7) is None
    assert TeamEstimate(Segment(4, 1, 0), {}).covariance(4) is None


def test_what_nobody_has_learned_is_as_uncertain_as_can_be() -> None:
    assert Learned() == (0.0, math.inf)
    assert TeamEstimate(Segment(4, 1, 0), {}).team_bias_m == Learned()


# pairs

POSES = {4: np.array([1.0, 2.0, 0.5]), 9: np.array([-3.0, 4.0, -2.5]), 2: np.array([0.5, 0, 3.0])}


def a_team() -> TeamEstimate:
    """Three robots that know a lot of each other; of the last pose of each, not of the first."""
    root = np.random.default_rng(1).normal(0, 0.05, (9, 9))
    trajectories = {
        robot: Trajectory(Chain(robot, 1), np.array([0, 1]), np.stack([9 * np.ones(3), pose]))
        for robot, pose in POSES.items()
    }
    return TeamEstimate(Segment(4, 1, 0), trajectories, root @ root.T)


@pytest.mark.parametrize(("a", "b"), [(4, 9), (9, 4), (2, 9), (4, 2)])
def test_two_robots_are_where_both_poses_say_and_as_sure_as_both_together_say(
    a: int, b: int
) -> None:
    """Derivatives by differences, of poses multiplied as matrices."""
    team, robots, h = a_team(), list(POSES), 1e-6
    found = team.relative(a, b)
    assert found is not None
    a_T_b, covariance = found
    assert same_pose(a_T_b, product(inverted(POSES[a]), POSES[b]), 1e-9)
    columns = []
    for robot in robots:
        for part in range(3):
            ends = []
            for step in (h, -h):
                poses = {name: pose.copy() for name, pose in POSES.items()}
                poses[robot][part] += step
                ends.append(product(inverted(poses[a]), poses[b]))
            columns.append((ends[0] - ends[1]) / (2 * h))
    j = np.stack(columns, axis=1)
    assert np.allclose(covariance, j @ team.joint @ j.T, rtol=1e-5, atol=1e-9)
    # as if both knew nothing of each other it would be something else
    own = np.kron(np.eye(3), np.ones((3, 3))) * team.joint
    assert not np.allclose(covariance, j @ own @ j.T, rtol=0.05)


def test_the_angle_between_two_robots_is_wrapped() -> None:
    found = a_team().relative(9, 2)
    assert found is not None
    assert found[0][2] == pytest.approx(5.5 - 2 * math.pi)


def test_robots_that_err_together_are_sure_of_each_other() -> None:
    """Both poses are off by the same, however much: seen from the one the other is where it was."""
    team = a_team()
    w_T_a, w_T_b = POSES[4], POSES[9]
    # a twist of the whole team moves each robot by its place
    moves = [np.array([[1, 0, -p[1]], [0, 1, p[0]], [0, 0, 1.0]]) for p in (w_T_a, w_T_b)]
    both = np.vstack(moves)
    joint = np.zeros((9, 9))
    joint[:6, :6] = both @ both.T
    found = replace(team, joint=joint).relative(4, 9)
    assert found is not None
    assert np.abs(found[1]).max() < 1e-12


def test_of_pairs_with_a_robot_of_which_nothing_is_claimed_nothing_is_known() -> None:
    team = a_team()
    few = replace(team, joint=team.joint[:6, :6])
    assert few.relative(4, 9) is not None
    assert few.relative(4, 2) is None
    assert few.relative(2, 4) is None
    assert team.relative(4, 7) is None


# wheels


def test_what_was_learned_of_the_wheels_corrects_odometry() -> None:
    team = replace(
        a_team(),
        scale={4: Learned(0.1, 0.01), 9: Learned(-0.2, 0.01)},
        yaw={4: Learned(0.02, 0.001)},
        turn={4: Learned(0.3, 0.05)},
    )
    assert team.correction(4) == Correction(scale=0.1, yaw=0.02, turn=0.3)
    assert team.correction(9) == Correction(scale=-0.2)
    assert team.correction(7) == Correction()


@pytest.mark.parametrize(
    ("boldness", "narrower", "times"),
    [({}, {}, 1.0), ({}, {(2, 7): 0.4}, 0.4), ({(2, 7): 3.0}, {(2, 7): 0.4}, 3.0)],
)
def test_a_pair_that_was_moved_too_far_is_no_narrower_whatever_its_sensors_say(
    boldness: dict[tuple[int, int], float], narrower: dict[tuple[int, ...], float], times: float
) -> None:
    team = replace(a_team(), boldness=boldness, narrower=narrower)
    assert team.narrow(2, 7) == team.narrow(7, 2) == times
    assert team.narrow(2, 3) == 1.0


def test_a_pose_is_told_as_sure_as_it_was_seen_to_be() -> None:
    team = a_team()
    known = team.covariance(2)
    assert known is not None
    assert replace(team, narrower={(2,): 0.4, (2, 7): 0.1}).told(2) == pytest.approx(0.4 * known)
    assert team.told(2) == pytest.approx(known)
    assert team.told(99) is None


def test_who_is_out_of_sight_is_named_from_either_side() -> None:
    estimate = replace(a_team(), blocked=frozenset({(0, 2), (2, 7)}))
    assert estimate.out_of_sight(2) == {0, 7}
    assert estimate.out_of_sight(0) == {2}
    assert estimate.out_of_sight(1) == frozenset()
