"""Later solutions against what was claimed before."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drslamd.conventions import GRID_HZ, Chain, Segment
from drslamd.slam.graph.estimate import MUCH_WORSE, Learned, TeamEstimate, Trajectory
from drslamd.slam.revisions import (
    ALLOWED,
    ALLOWED_OF_PAIRS,
    MOST_ROBOTS,
    REMEMBERED,
    Revisions,
    squared_moves,
)

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
    claimed, later = [[0.0, 0.0, math.pi - 0.1]], [[0.0, 0.0, 0.1 - math.pi]]
    (found,) = squared_moves(np.array(claimed), covariance[None], np.array(later))
    assert found == pytest.approx(0.2**2 / 0.01 / 3)


def test_claims_are_a_second_apart_and_few() -> None:
    assert REMEMBERED == 20 * GRID_HZ


def antenna(estimate: TeamEstimate, robot: int) -> TeamEstimate:
    """With the antenna of a robot learned beside its place."""
    learned = (Learned(0.3, 0.05), Learned(0.0, 0.05))
    return replace(estimate, antenna_m={**estimate.antenna_m, robot: learned})


def test_what_was_claimed_before_a_mounting_was_learned_says_nothing_of_now() -> None:
    before, moved = solution([0, 10]), solution([0, 10, 20], 3.0)
    assert boldness(before, antenna(moved, 0)) == 1.0
    assert boldness(before, replace(moved, turn={0: Learned(0.3, 0.05)})) == 1.0
    # and a second one says nothing of the first
    assert boldness(antenna(before, 1), antenna(antenna(moved, 0), 1)) == 1.0


def test_what_is_claimed_under_the_same_mountings_is_compared() -> None:
    before, moved = solution([0, 10]), solution([0, 10, 20], 3.0)
    assert boldness(antenna(before, 0), antenna(moved, 0)) > 1.0
    # one that is no longer believed was no better model
    assert boldness(antenna(before, 0), moved) > 1.0
    # nor one that still does not explain what was measured
    unfit = replace(antenna(moved, 0), is_explained=False)
    assert boldness(before, unfit) > 1.0


@pytest.mark.parametrize(
    ("before", "now", "counts"),
    [(1.0, MUCH_WORSE, False), (1.0, 2.9, True), (2.9, MUCH_WORSE, False), (3.1, 9.0, True)],
)
def test_nor_does_what_was_claimed_before_odometry_was_known_to_be_much_worse(
    before: float, now: float, counts: bool
) -> None:
    claimed = replace(solution([0, 10]), odometry_level={0: before})
    moved = replace(solution([0, 10, 20], 3.0), odometry_level={3: now})
    assert (boldness(claimed, moved) > 1.0) is counts
    # of whose odometry there is doubt all counts
    assert boldness(claimed, replace(moved, late_level={3: MUCH_WORSE})) > 1.0


def worse(estimate: TeamEstimate, level: float) -> TeamEstimate:
    """With odometry that is feared to be so many times worse."""
    return replace(estimate, odometry_level={0: level})


def test_what_was_claimed_under_another_model_counts_again_when_this_one_is_given_up() -> None:
    before, moved = solution([0, 10]), solution([0, 10, 20], 3.0)
    explained, again = worse(moved, MUCH_WORSE), solution([0, 10, 20, 30], 3.0)
    assert boldness(before, moved) == pytest.approx(30.0**2 / 3 / ALLOWED)
    assert boldness(before, moved, explained) == 1.0
    assert boldness(before, moved, explained, again) == pytest.approx(30.0**2 / 3 / ALLOWED)
    # one that explains nothing does not take the place of one that did
    assert boldness(before, explained, replace(again, is_explained=False)) == 1.0


def test_what_is_moved_under_the_model_that_is_believed_now_counts_beside_older_claims() -> None:
    before, claimed = solution([0, 10]), worse(solution([0, 10, 20]), MUCH_WORSE)
    moved = worse(solution([0, 10, 20, 30], 3.0), MUCH_WORSE)
    assert boldness(before, moved) == 1.0
    assert boldness(before, claimed, moved) > 1.0


# pairs


def team(places: list[tuple[float, float]], n: list[int], turned: float = 0.0) -> TeamEstimate:
    """Robots that stand in their own frames' directions; all is turned about the origin."""
    cos, sin = math.cos(turned), math.sin(turned)
    paths = {}
    for robot, (x, y) in enumerate(places):
        pose = [cos * x - sin * y, sin * x + cos * y, turned]
        numbers = np.array(n, dtype=float) + 1000 * robot
        paths[robot] = Trajectory(Chain(robot, 1), numbers, np.tile(pose, (len(n), 1)))
    return TeamEstimate(FRAME, paths, joint=SIGMA**2 * np.eye(3 * len(places)))


STANDING = [(0.0, 0.0), (3.0, 0.0), (0.0, 4.0)]


def of_pairs(*solutions: TeamEstimate) -> dict[tuple[int, int], float]:
    revisions = Revisions()
    for estimate in solutions:
        revisions.on_solution(estimate, 0)
    return revisions.of_pairs


def test_a_pair_that_is_moved_further_than_was_claimed_was_claimed_too_boldly() -> None:
    """Along the line from one to the other both sigmas count."""
    moved = [(0.0, 0.0), (3.0, 0.0), (0.0, 4.0 + 0.5)]
    found = of_pairs(team(STANDING, [0, 10]), team(moved, [0, 10, 20]))
    expected = 0.5**2 / (2 * SIGMA**2) / 3 / ALLOWED_OF_PAIRS
    assert found.keys() == {(0, 2), (1, 2)}
    assert found[0, 2] == pytest.approx(expected, rel=1e-3)
    # the claim is the sum of both ends, so the estimate says it in that many times
    wider = replace(team(STANDING, [0]), boldness=found)
    for pair in ((0, 2), (2, 0)):
        plain, bold = team(STANDING, [0]).relative(*pair), wider.relative(*pair)
        assert plain is not None
        assert bold is not None
        assert bold[1] == pytest.approx(found[0, 2] * plain[1])


def test_a_team_that_is_turned_as_a_whole_moves_no_pair() -> None:
    later = team(STANDING, [0, 10, 20], turned=0.7)
    assert of_pairs(team(STANDING, [0, 10]), later) == {}
    other = replace(later, frame=Segment(2, 1, 0))
    assert of_pairs(team(STANDING, [0, 10]), other) == {}
    # and a pair does not hang on the frame
    moved = replace(team([*STANDING[:2], (0.0, 6.0)], [0, 10, 20]), frame=Segment(2, 1, 0))
    assert of_pairs(team(STANDING, [0, 10]), moved).keys() == {(0, 2), (1, 2)}


def test_pairs_of_the_first_robots_of_a_large_team_are_watched() -> None:
    places = [(float(k), 0.0) for k in range(MOST_ROBOTS + 2)]
    moved = [(2.0 * x, y) for x, y in places]
    found = of_pairs(team(places, [0, 10]), team(moved, [0, 10, 20]))
    assert {robot for pair in found for robot in pair} == set(range(MOST_ROBOTS))


@pytest.mark.parametrize(
    ("sigmas", "left"),
    [(0.0, 0.4), (1.7, 0.4), (1.8, 1.8**2 / 7.5), (2.7, 2.7**2 / 7.5), (2.8, None)],
)
def test_no_pair_is_told_as_surer_than_later_solutions_move_it(
    sigmas: float, left: float | None
) -> None:
    revisions = Revisions()
    moved = [*STANDING[:2], (0.0, 4.0 + sigmas * SIGMA * math.sqrt(2))]
    revisions.on_solution(team(STANDING, [0, 10]), 0)
    revisions.on_solution(team(moved, [0, 10, 20]), 0)
    found = revisions.no_narrower({(0, 2): 0.4, (0, 1): 0.4})
    assert found[0, 1] == 0.4
    assert found.get((0, 2)) == (left and pytest.approx(left, rel=1e-3))


@pytest.mark.parametrize(
    ("sigmas", "left"),
    [(0.0, 0.4), (2.4, 0.4), (2.5, 2.5**2 / 15), (3.8, 3.8**2 / 15), (3.9, None)],
)
def test_nor_is_our_own_pose(sigmas: float, left: float | None) -> None:
    """Five per degree of freedom are allowed, of three."""
    revisions = Revisions()
    moved = [*STANDING[:2], (0.0, 4.0 + sigmas * SIGMA)]
    revisions.on_solution(team(STANDING, [0, 10]), 2)
    revisions.on_solution(team(moved, [0, 10, 20]), 2)
    found = revisions.no_narrower({(2,): 0.4})
    assert found.get((2,)) == (left and pytest.approx(left, rel=1e-3))


def test_who_would_be_no_narrower_is_made_so_by_nobody() -> None:
    assert Revisions().no_narrower({}) == {}
