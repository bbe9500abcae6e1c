"""Mistakes in mountings against wheels that are counted one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slam_scenes import Array, inverted, product, same_pose, wander

from drslamd.slam.odometry import mounting
from drslamd.slam.odometry.mounting import (
    AS_CONFIGURED,
    CURVES,
    LEARNED,
    MIRRORED,
    SCALES,
    SIDES,
    TRACKS,
    Fault,
    Repair,
)

HALF_M = 0.15
"""Of the track."""
RNG = np.random.default_rng(1)
LEFT, RIGHT = RNG.uniform(-0.02, 0.06, 200), RNG.uniform(-0.02, 0.06, 200)
"""What each wheel really went in each tenth of a second, m."""


def driven(left: Array, right: Array, half_m: float = HALF_M) -> Array:
    """(k + 1, 3) where a robot comes to by arcs: no robot slips, and none jumps."""
    poses = [np.array([1.0, 2.0, 0.4])]
    for d_left, d_right in zip(left, right, strict=True):
        way, turn = (d_left + d_right) / 2, (d_right - d_left) / (2 * half_m)
        chord = way * (math.sin(turn / 2) / (turn / 2) if turn else 1.0)
        half = (0.0, 0.0, turn / 2)
        heading = poses[-1][2] + turn
        poses.append(np.append(product(poses[-1], half, (chord, 0.0, 0.0))[:2], heading))
    return np.array(poses)


TRUE = driven(LEFT, RIGHT)


def path_by(repair: Repair, said: Array, half_m: float) -> Array:
    """Of one repair beside others: none makes a difference to another."""
    return np.asarray(mounting.paths((SCALES[0], repair, MIRRORED), said, half_m)[1])


def is_same(path: Array, expected: Array) -> bool:
    pairs = zip(path, expected, strict=True)
    return all(same_pose(ours, theirs, 1e-9) for ours, theirs in pairs)


def test_where_nothing_is_wrong_the_path_is_what_it_was() -> None:
    assert is_same(path_by(AS_CONFIGURED, TRUE, HALF_M), TRUE)


@pytest.mark.parametrize(
    ("said", "fault"),
    [
        (driven(-LEFT, RIGHT), Fault.LEFT_REVERSED),
        (driven(LEFT, -RIGHT), Fault.RIGHT_REVERSED),
    ],
)
def test_a_side_that_counts_backwards_is_counted_forwards_again(said: Array, fault: Fault) -> None:
    (repair,) = (side for side in SIDES if side.fault is fault)
    assert is_same(path_by(repair, said, HALF_M), TRUE)
    (other,) = (side for side in SIDES if side.fault is not fault)
    assert not same_pose(path_by(other, said, HALF_M)[-1], TRUE[-1], 0.1)


@pytest.mark.parametrize("turn", [repair.turn for repair in TRACKS])
def test_turns_are_so_many_times_longer_where_the_track_is_that_much_narrower(turn: float) -> None:
    (repair,) = (track for track in TRACKS if track.turn == turn)
    assert repair.fault is Fault.TRACK
    # configured is a track that makes turns seem shorter
    assert is_same(path_by(repair, driven(LEFT, RIGHT, HALF_M * turn), HALF_M), TRUE)


@pytest.mark.parametrize("scale", [repair.way for repair in SCALES])
def test_counts_that_are_wrong_by_a_factor_are_wrong_in_ways_and_turns(scale: float) -> None:
    (repair,) = (each for each in SCALES if each.way == scale)
    assert repair.fault is Fault.SCALE
    assert is_same(path_by(repair, driven(LEFT / scale, RIGHT / scale), HALF_M), TRUE)


def test_where_sides_are_swapped_the_path_is_that_of_a_mirror() -> None:
    assert is_same(path_by(MIRRORED, driven(RIGHT, LEFT), HALF_M), TRUE)


def test_where_both_sides_run_backwards_it_is_that_of_the_back_of_the_robot() -> None:
    """What is seen from there: a robot that stands half a turn round drives as the real one."""
    repaired = path_by(MIRRORED, driven(-LEFT, -RIGHT), HALF_M)
    back = np.array([product(pose, (0.0, 0.0, math.pi)) for pose in repaired])
    moved = [product(inverted(back[0]), pose) for pose in back]
    assert is_same(np.array(moved), np.array([product(inverted(TRUE[0]), p) for p in TRUE]))


def test_a_path_that_slides_sideways_keeps_that() -> None:
    path = wander(np.random.default_rng(2), 20, 0.3)
    assert is_same(path_by(AS_CONFIGURED, path, HALF_M), path)
    longer = path_by(SCALES[-1], path, 0.0)
    way = np.hypot(*np.diff(path[:, :2], axis=0).T)
    assert np.hypot(*np.diff(longer[:, :2], axis=0).T) == pytest.approx(
        SCALES[-1].way * way, rel=0.05
    )


def test_headings_count_on() -> None:
    """A robot that turns round and round, more than half a turn between none of its samples."""
    round_and_round = driven(-LEFT - 0.1, RIGHT + 0.1)
    path = path_by(Repair(Fault.TRACK, turn=1.5), round_and_round, HALF_M)
    turned = np.diff(round_and_round[:, 2]).sum()
    assert path[-1, 2] - path[0, 2] == pytest.approx(1.5 * turned)
    assert abs(turned) > 20


@pytest.mark.parametrize("bend", [repair.bend for repair in CURVES])
def test_a_curve_is_turning_by_the_way_forwards_and_backwards_alike(bend: float) -> None:
    """What a counter of way and turn would have said, step by step."""
    way = (LEFT + RIGHT) / 2
    turned = bend * np.abs(way) * HALF_M
    path = path_by(Repair(Fault.CURVE, bend=bend), TRUE, 0.0)
    assert is_same(path, driven(LEFT - turned, RIGHT + turned))


def test_no_half_track_is_needed_but_for_sides() -> None:
    for repair in (MIRRORED, *TRACKS, *SCALES):
        assert repair.cross == 0
        assert np.isfinite(path_by(repair, TRUE, 0.0)).all()
    assert {side.cross for side in SIDES} == {1.0, -1.0}


def test_what_is_learned_are_tracks_and_scales() -> None:
    assert set(LEARNED) == {TRACKS[0].fault, SCALES[0].fault}
    repairs = (AS_CONFIGURED, MIRRORED, *SIDES, *TRACKS, *SCALES, *CURVES)
    assert {repair.fault for repair in repairs} == set(mounting.Fault)
