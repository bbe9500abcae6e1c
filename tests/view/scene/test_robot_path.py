"""Where a robot was: published poses, odometry between and before them, frames that change."""

from __future__ import annotations

import math

import numpy as np
import pytest
from onlooked_team import Actor

from drslamd.conventions import Chain
from drslamd.gossip.message_types import PoseState
from drslamd.view.scene import robot_path
from drslamd.view.scene.robot_path import (
    BY_ODOMETRY,
    KEPT,
    POSE,
    STATE,
    RobotPath,
    T,
    arc,
    headings_known,
)

OTHER = Chain(7, 3)


def driven(actor: Actor, seconds: range, keyframes: bool = True) -> RobotPath:
    """A path of poses and keyframes, one a second."""
    path = RobotPath()
    for t in seconds:
        if keyframes:
            path.add_keyframe(actor.keyframe(t))
        path.add(actor.pose(t), t, 0.0)
    return path


def own(actor: Actor, t: float) -> float:
    return t + actor.ahead_s


def apart(a: np.ndarray, b: np.ndarray) -> float:
    turned = math.remainder(float(a[2] - b[2]), 2 * math.pi)
    return max(math.dist(a[:2], b[:2]), abs(turned))


def test_a_path_is_what_was_published_one_pose_a_second() -> None:
    actor, path = Actor(0), RobotPath()
    for k in range(101):
        path.add(actor.pose(0.1 * k), 0.1 * k, 0.0)
    assert 10 <= len(path.rows) <= 12
    for row in path.rows:
        assert apart(row[POSE], actor.truth(row[T])) < 1e-6
    assert path.rows[-1, T] == pytest.approx(10.0)
    assert path.rows[-1, 6:].tolist() == [0.04, 0.01, 0.01, 0.001]


@pytest.mark.parametrize(
    ("state", "sigma_rad", "is_known"),
    [
        (PoseState.LOCALISED, 0.03, True),
        (PoseState.STALE, 0.03, True),
        (PoseState.STALE, 1.79, True),
        (PoseState.STALE, 1.80, False),
        (PoseState.POSITION, 1.81, False),
        (PoseState.POSITION, 0.03, False),
    ],
)
def test_a_heading_is_known_unless_it_stands_or_is_as_uncertain_as_any(
    state: PoseState, sigma_rad: float, is_known: bool
) -> None:
    """Of headings all around the circle sigma is pi / sqrt 3, 1.814 rad; 99 % of it is as much."""
    covariance = (0.04, 0.0, 0.0, 0.04, 0.0, sigma_rad**2)
    path = RobotPath()
    path.add(Actor(0, state=state, covariance=covariance).pose(0.0), 0.0, 0.0)
    assert headings_known(path.rows).tolist() == [is_known]


def test_the_age_of_a_pose_counts() -> None:
    path = RobotPath()
    path.add(Actor(0).pose(0.0), 5.0, 0.75)
    assert path.rows[0, T] == 4.25


def test_a_pose_that_was_overtaken_is_left_out() -> None:
    actor, path = Actor(0), RobotPath()
    for t in (0.0, 2.0, 1.0):
        path.add(actor.pose(t), t, 0.0)
    assert path.rows[:, T].tolist() == [0.0, 2.0]


def test_an_hour_is_kept_and_no_more() -> None:
    actor, path = Actor(0), RobotPath()
    for t in range(5_000):
        path.add(actor.pose(t), t, 0.0)
    assert 3_300 <= len(path.rows) <= KEPT
    assert path.rows[-1, T] == 4_999


@pytest.mark.parametrize("t", [3.0, 3.3, 7.85])
def test_a_place_between_two_poses_lies_on_the_arc_that_was_driven(t: float) -> None:
    actor = Actor(0)
    place = driven(actor, range(10)).place(own(actor, t))
    assert place is not None
    assert apart(place, actor.truth(t)) < 2e-3


@pytest.mark.parametrize(("later", "is_known"), [(4.0, True), (11.9, True), (12.1, False)])
def test_a_place_after_the_last_pose_is_carried_on_by_odometry_for_a_while(
    later: float, is_known: bool
) -> None:
    actor = Actor(0)
    path = driven(actor, range(10))
    for t in range(10, 25):
        path.add_keyframe(actor.keyframe(t))
    place = path.place(own(actor, 9 + later))
    assert (place is not None) is is_known
    if place is not None:
        assert apart(place, actor.truth(9 + later)) < 5e-3


def test_there_is_no_place_before_the_first_pose_nor_in_a_hole_nor_from_stale_poses() -> None:
    actor, path = Actor(0), RobotPath()
    assert path.place(own(actor, 0)) is None
    for t in (0, 1, 5, 6):
        path.add(actor.pose(t), t, 0.0)
    assert path.place(own(actor, -0.1)) is None
    assert path.place(own(actor, 3)) is None
    assert path.place(own(actor, 5.5)) is not None
    stale = Actor(0, state=PoseState.STALE)
    assert driven(stale, range(4)).place(own(stale, 2)) is None


def test_the_way_to_the_first_pose_comes_from_odometry_and_is_marked() -> None:
    actor, path = Actor(0), RobotPath()
    for t in range(20):
        path.add_keyframe(actor.keyframe(t))
    path.add(actor.pose(19.4), 19.4, 0.0)
    path.add_keyframe(actor.keyframe(20))
    assert path.is_new
    assert path.rows[:-1, STATE].tolist() == [BY_ODOMETRY] * 20
    assert path.rows[-1, STATE] == PoseState.LOCALISED
    for row in path.rows:
        assert apart(row[POSE], actor.truth(row[T])) < 5e-3


def test_a_robot_drives_on_as_before_until_another_keyframe_is_due() -> None:
    actor, path = Actor(0), RobotPath()
    for t in (0.0, 1.0):
        path.add_keyframe(actor.keyframe(t))
    last, on, later = (path._odometry(own(actor, t)) for t in (1.0, 2.5, 2.6))
    assert last is not None
    assert on is not None
    assert later is not None
    # on a circle of 2 m, 0.25 rad/s
    assert math.dist(on[1][:2], last[1][:2]) == pytest.approx(
        4 * math.sin(1.5 * 0.25 / 2), rel=0.01
    )
    assert apart(later[1], last[1]) < 1e-9


def test_odometry_of_an_earlier_segment_says_nothing_of_this_one() -> None:
    actor, path = Actor(0), RobotPath()
    for t in range(10):
        path.add_keyframe(actor.keyframe(t, segment=t // 6))
    path.add(actor.pose(9), 9, 0.0)
    assert path.rows[:, T].tolist() == [6, 7, 8, 9]


def moved(actor: Actor) -> Actor:
    """The same robot in a frame that is turned by a quarter and moved by (10, 0)."""

    class Moved(Actor):
        def truth(self, t: float) -> np.ndarray:
            x, y, theta = super().truth(t)
            return np.array([10 - y, x, math.remainder(theta + math.pi / 2, 2 * math.pi)])

    return Moved(0, frame=OTHER, turning=actor.turning)


def test_a_change_of_frame_takes_the_whole_path_along() -> None:
    actor = Actor(0)
    path = driven(actor, range(10))
    path.is_new = False
    path.add_keyframe(actor.keyframe(10))
    elsewhere = moved(actor)
    path.add(elsewhere.pose(10), 10, 0.0)
    assert path.is_new
    assert path.frame == OTHER
    for row in path.rows:
        assert apart(row[POSE], elsewhere.truth(row[T])) < 5e-3
    # xx and yy change places, xy its sign
    assert path.rows[3, 6:] == pytest.approx([0.01, -0.01, 0.04, 0.001])


@pytest.mark.parametrize(("pause", "rows"), [(5.9, 11), (6.1, 1)])
def test_a_frame_that_changes_after_a_long_silence_begins_a_new_path(
    pause: float, rows: int
) -> None:
    actor = Actor(0)
    path = driven(actor, range(10), keyframes=False)
    path.add(moved(actor).pose(9 + pause), 9 + pause, 0.0)
    assert len(path.rows) == rows


def test_after_another_start_the_old_path_stays_but_its_clock_is_void() -> None:
    actor = Actor(0)
    path = driven(actor, range(10))
    path.begin_again()
    assert len(path.rows) == 10
    assert path.place(own(actor, 5)) is None
    again = Actor(0, ahead_s=3.0)
    for t in range(10, 13):
        path.add(again.pose(t), t, 0.0)
    place = path.place(own(again, 11.5))
    assert place is not None
    assert apart(place, again.truth(11.5)) < 2e-3


def test_a_robot_that_stands_between_two_keyframes_stands_until_a_second_before_the_later() -> None:
    path = RobotPath()
    actor = Actor(0)
    for t in (0.0, 10.0):
        path.add_keyframe(actor.keyframe(t))
    before = path._odometry(own(actor, 8.9))
    there = path._odometry(own(actor, 0.0))
    later = path._odometry(own(actor, 10.0))
    assert before is not None
    assert there is not None
    assert later is not None
    assert apart(before[1], there[1]) < 1e-9
    assert apart(before[1], later[1]) > 0.5


def test_an_arc_is_the_part_of_a_circle() -> None:
    quarter = np.array([1.0, 1.0, math.pi / 2])
    half = arc(np.zeros(3), quarter, 0.5)
    assert half == pytest.approx([math.sin(math.pi / 4), 1 - math.cos(math.pi / 4), math.pi / 4])
    assert arc(np.zeros(3), quarter, 1.0) == pytest.approx(quarter)
    assert arc(np.zeros(3), np.array([2.0, 0.0, 0.0]), 0.25) == pytest.approx([0.5, 0, 0])


def test_the_time_of_a_sample_is_a_tenth_of_its_number() -> None:
    assert robot_path.time_of(123) == 12.3
