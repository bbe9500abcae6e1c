"""The 10 Hz track, bent to go through the solved keyframes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import ArrayLike
from slam_scenes import Array, product, same_pose, wander

from drslamd.conventions import Chain
from drslamd.slam.graph.estimate import Trajectory
from drslamd.slam.graph.trajectory import deform_track
from drslamd.slam.odometry.track import RESOLUTION, Track

CHAIN = Chain(0, 1)


def track_of(path: Array, n: Array) -> Track:
    track = Track(1000)
    for k, pose in zip(n, path, strict=True):
        track.append(int(k), np.round(pose / RESOLUTION))
    return track


def solved(n: list[int], poses: Sequence[ArrayLike] | Array) -> Trajectory:
    return Trajectory(CHAIN, np.array(n), np.array(poses))


PATH = wander(np.random.default_rng(0), 60)
TRACK = track_of(PATH, np.arange(100, 160))


def test_a_track_that_was_only_moved_is_moved() -> None:
    shift = np.array([5.0, -3.0, 2.5])
    knots = [100, 117, 140, 159]
    n, poses = deform_track(TRACK, solved(knots, [product(shift, PATH[k - 100]) for k in knots]))
    assert n.tolist() == list(range(100, 160))
    for ours, pose in zip(poses, PATH, strict=True):
        assert same_pose(ours, product(shift, pose), 1e-3)
        assert -math.pi < ours[2] <= math.pi


def test_it_goes_through_the_keyframes_however_they_were_bent() -> None:
    rng = np.random.default_rng(1)
    knots = [105, 117, 118, 140, 155]
    wanted = [PATH[k - 100] + rng.normal(0, 0.2, 3) for k in knots]
    n, poses = deform_track(TRACK, solved(knots, wanted))
    for k, pose in zip(knots, wanted, strict=True):
        assert same_pose(poses[n == k][0], pose, 1e-9)


def test_between_two_keyframes_each_counts_by_how_near_it_is() -> None:
    straight = np.stack([np.arange(11) * 0.1, np.zeros(11), np.zeros(11)], axis=-1)
    track = track_of(straight, np.arange(11))
    ends = np.array([[0.0, 0, 0], [1.0, 0.5, 0]])
    _, poses = deform_track(track, solved([0, 10], ends))
    assert np.allclose(poses[:, 1], 0.05 * np.arange(11))
    assert np.allclose(poses[:, 0], 0.1 * np.arange(11))


def test_angles_are_blended_the_short_way_around() -> None:
    still = np.zeros((11, 3))
    _, poses = deform_track(
        track_of(still, np.arange(11)), solved([0, 10], [[0, 0, 3.1], [0, 0, -3.1]])
    )
    assert np.abs(poses[:, 2]).min() > 3.1 - 1e-9
    middle = poses[5, 2]
    assert abs(middle) == pytest.approx(math.pi, abs=1e-9)


def test_before_the_first_and_after_the_last_it_follows_odometry() -> None:
    knots = [110, 140]
    wanted = [PATH[10] + [1.0, 0, 0], PATH[40] + [1.0, 0, 0]]
    n, poses = deform_track(TRACK, solved(knots, wanted))
    assert np.allclose(poses[n == 100][0][:2], PATH[0][:2] + [1.0, 0], atol=1e-3)
    assert np.allclose(poses[n == 159][0][:2], PATH[59][:2] + [1.0, 0], atol=1e-3)


def test_holes_are_left_out_and_each_segment_has_its_own_keyframes() -> None:
    numbers = np.concatenate([np.arange(0, 20), np.arange(30, 50), np.arange(60, 80)])
    track = track_of(PATH, numbers)
    here, there = np.array([10.0, 0, 0]), np.array([-10.0, 0, 1.0])
    n, poses = deform_track(
        track,
        solved(
            [5, 10, 65], [product(here, PATH[5]), product(here, PATH[10]), product(there, PATH[45])]
        ),
    )
    # the middle segment has no solved keyframe: nothing is guessed of it
    assert n.tolist() == list(range(20)) + list(range(60, 80))
    for ours, number in zip(poses, n, strict=True):
        k = int(np.flatnonzero(numbers == number)[0])
        assert same_pose(ours, product(here if number < 20 else there, PATH[k]), 1e-3)


@pytest.mark.parametrize("knots", [[], [99], [160], [50, 1000]])
def test_without_a_keyframe_on_the_track_there_is_nothing(knots: list[int]) -> None:
    n, poses = deform_track(TRACK, solved(knots, np.zeros((len(knots), 3))))
    assert (len(n), poses.shape) == (0, (0, 3))


def test_an_empty_track_is_bent_to_nothing() -> None:
    n, poses = deform_track(Track(10), solved([5], [[0, 0, 0]]))
    assert (len(n), poses.shape) == (0, (0, 3))
