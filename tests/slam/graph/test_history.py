"""Where a robot was, also at keyframes that module 3 no longer solves."""

from __future__ import annotations

import numpy as np
import pytest
from slam_scenes import product, same_pose, wander

from drslamd.conventions import Chain
from drslamd.slam.graph import history as history_module
from drslamd.slam.graph.estimate import Trajectory
from drslamd.slam.graph.history import History

A = Chain(0, 1)


def test_at_first_there_is_what_was_solved() -> None:
    history = History()
    assert history.latest is None
    solved = Trajectory(A, np.array([0, 10]), np.zeros((2, 3)))
    assert history.update(solved) is solved
    assert history.latest is solved


def test_a_keyframe_that_was_thinned_out_moves_with_the_one_before_it() -> None:
    path = wander(np.random.default_rng(3), 40)
    history = History()
    n = np.arange(0, 400, 10)
    history.update(Trajectory(A, n, path))
    turn = np.array([3.0, -1.0, 0.7])
    stay = np.r_[0, 20, np.arange(30, 40)]
    moved = np.array([product(turn, path[k]) for k in stay])
    latest = history.update(Trajectory(A, n[stay], moved))
    assert np.array_equal(latest.n, n)
    for pose, was in zip(latest.poses, path, strict=True):
        assert same_pose(pose, product(turn, was), 1e-9)


def test_another_start_has_another_history() -> None:
    history = History()
    history.update(Trajectory(A, np.array([0, 10]), np.zeros((2, 3))))
    later = Trajectory(Chain(0, 2), np.array([10]), np.ones((1, 3)))
    assert history.update(later) is later


def test_what_lies_before_all_that_is_left_moves_with_the_first_of_it() -> None:
    path = wander(np.random.default_rng(4), 4)
    history = History()
    history.update(Trajectory(A, np.arange(4), path))
    turn = np.array([1.0, 2.0, -0.4])
    moved = np.array([product(turn, path[2]), product((9.0, 9.0, 0.9), path[3])])
    latest = history.update(Trajectory(A, np.arange(2, 4), moved))
    for pose, was in zip(latest.poses[:3], path[:3], strict=True):
        assert same_pose(pose, product(turn, was), 1e-9)
    assert np.array_equal(latest.poses[3], moved[1])


def test_when_nothing_is_known_of_before_what_was_solved_is_all() -> None:
    history = History()
    history.update(Trajectory(A, np.array([0, 10]), np.zeros((2, 3))))
    later = Trajectory(A, np.array([20, 30]), np.ones((2, 3)))
    assert history.update(later) is later


@pytest.mark.parametrize(("most", "kept"), [(4, [0, 10, 20, 30]), (3, [10, 20, 30])])
def test_the_oldest_are_forgotten(
    most: int, kept: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(history_module, "MAX_KNOTS", most)
    history = History()
    history.update(Trajectory(A, np.array([0, 10, 20]), np.zeros((3, 3))))
    latest = history.update(Trajectory(A, np.array([20, 30]), np.zeros((2, 3))))
    assert latest.n.tolist() == kept
