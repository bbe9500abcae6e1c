"""Where a robot was, also at keyframes that module 3 no longer solves."""

from __future__ import annotations

import numpy as np
from slam_scenes import product, same_pose, wander

from drslamd.conventions import Chain
from drslamd.slam.graph.estimate import Trajectory
from drslamd.slam.graph.history import History

A = Chain(0, 1)


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
    later = Trajectory(Chain(0, 2), np.array([5]), np.ones((1, 3)))
    assert history.update(later) is later
