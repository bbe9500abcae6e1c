"""What module 3 says, looked up by robot."""

from __future__ import annotations

import math

import numpy as np

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory


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
