"""Later solutions against what was claimed before."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drslamd.conventions import GRID_HZ, Chain, Segment
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.revisions import ALLOWED, REMEMBERED, Revisions, squared_move

SIGMA = 0.1
FRAME = Segment(0, 1, 0)


def solution(n: list[int], x: float = 0.0, frame: Segment = FRAME) -> TeamEstimate:
    """Robot 0 at its keyframes, all at the same place."""
    poses = np.tile([x, 0.0, 0.0], (len(n), 1))
    path = Trajectory(Chain(0, 1), np.array(n, dtype=float), poses)
    return TeamEstimate(frame, {0: path}, joint=SIGMA**2 * np.eye(3))


def boldness(*solutions: TeamEstimate) -> float:
    revisions = Revisions()
    for estimate in solutions:
        revisions.on_solution(estimate, 0)
    return revisions.boldness


@pytest.mark.parametrize(
    ("sigmas", "expected"),
    [(0.0, 1.0), (3.8, 1.0), (3.9, 3.9**2 / 3 / ALLOWED), (30.0, 900 / 3 / ALLOWED)],
)
def test_what_is_moved_further_than_was_claimed_was_claimed_too_boldly(
    sigmas: float, expected: float
) -> None:
    found = boldness(solution([0, 10]), solution([0, 10, 20], sigmas * SIGMA))
    assert found == pytest.approx(expected)


def test_only_the_same_keyframe_in_the_same_frame_is_compared() -> None:
    moved = solution([0, 20], 3.0)
    assert boldness(solution([0, 10]), moved) == 1.0
    assert boldness(solution([0, 10]), solution([0, 10, 20], 3.0, Segment(7, 1, 0))) == 1.0
    assert boldness(solution([0, 10]), solution([0, 10, 20], 3.0)) > 1.0


@pytest.mark.parametrize(("later", "is_kept"), [(REMEMBERED, True), (REMEMBERED + 1, False)])
def test_a_move_counts_for_as_long_as_it_says_something_of_now(later: int, is_kept: bool) -> None:
    still = solution([10, 20 + later], 3.0)
    found = boldness(solution([0, 10]), solution([0, 10, 20], 3.0), still)
    assert (found > 1.0) is is_kept


def test_a_robot_without_a_place_claims_nothing() -> None:
    revisions = Revisions()
    revisions.on_solution(solution([0, 10]), 5)
    assert revisions.boldness == 1.0


def test_who_stands_where_the_frame_begins_is_certain_and_not_the_end_of_the_daemon() -> None:
    parked = TeamEstimate(FRAME, solution([0]).trajectories, joint=np.zeros((3, 3)))
    assert boldness(parked, parked) == 1.0
    # odometry has steps of 0.1 mm, so less than that is no move
    assert boldness(parked, solution([0], 1e-4)) == 1.0
    assert boldness(parked, solution([0], 1e-2)) > 1.0


def test_angles_are_compared_around_the_circle() -> None:
    covariance = np.diag([1.0, 1.0, 0.01])
    found = squared_move(
        np.array([0.0, 0.0, math.pi - 0.1]), covariance, np.array([0.0, 0.0, 0.1 - math.pi])
    )
    assert found == pytest.approx(0.2**2 / 0.01 / 3)


def test_claims_are_a_second_apart_and_few() -> None:
    assert REMEMBERED == 20 * GRID_HZ
