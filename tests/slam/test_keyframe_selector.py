"""Which samples of our odometry become keyframes."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.keyframe_selector import AT_ONCE, KEYFRAME_M, KEYFRAME_RAD, KeyframeSelector
from drslamd.slam.odometry.track import Track

STEP = 1e-4
"""m or rad of one step of a track."""
MOST_M, MOST_RAD = round(KEYFRAME_M / STEP), round(KEYFRAME_RAD / STEP)


class Driven:
    """A robot whose first keyframe is sample 100, where it stood at (5, -7, 3) steps."""

    def __init__(self) -> None:
        self.track, self.selector = Track(1_000), KeyframeSelector()
        self.to(100, 5, -7, 3)
        self.first = self.selector.next(self.track)

    def to(self, n: int, *steps: int) -> None:
        self.track.append(n, np.array(steps, dtype=float))

    def next(self, is_doubted: bool = False) -> Keyframe | None:
        return self.selector.next(self.track, is_doubted)


def test_of_no_odometry_there_is_no_keyframe() -> None:
    assert KeyframeSelector().next(Track(10)) is None


def test_the_first_sample_is_a_keyframe_in_whole_steps() -> None:
    assert Driven().first == Keyframe(100, 0, 5, -7, 3)


@pytest.mark.parametrize("hole", [0, 5])
def test_a_segment_begins_at_its_first_sample_however_late_one_looks(hole: int) -> None:
    """Who drives off at once would begin the frame of the team somewhere on its way."""
    track, selector = Track(1_000), KeyframeSelector()
    for n in range(8):
        track.append(50 + n, np.array([n * MOST_M, 0, 0], dtype=float))
    assert selector.next(track) == Keyframe(50, 0, 0, 0, 0)
    assert selector.next(track) == Keyframe(57, 0, 7 * MOST_M, 0, 0)
    for n in range(4):
        track.append(57 + hole + n + 1, np.array([(8 + n) * MOST_M, 0, 0], dtype=float))
    found = selector.next(track)
    assert found == (
        Keyframe(58 + hole, 1, 8 * MOST_M, 0, 0) if hole else Keyframe(61, 0, 11 * MOST_M, 0, 0)
    )


@pytest.mark.parametrize(
    ("steps", "is_one"),
    [
        ((MOST_M - 1, 0, 0), False),
        ((MOST_M + 1, 0, 0), True),
        ((0, -MOST_M + 1, 0), False),
        ((0, -MOST_M - 1, 0), True),
        # 3, 4 and 5 have a right angle between them
        ((3 * MOST_M // 5 - 2, 4 * MOST_M // 5 - 2, 0), False),
        ((3 * MOST_M // 5 + 2, 4 * MOST_M // 5 + 2, 0), True),
        ((0, 0, MOST_RAD - 1), False),
        ((0, 0, MOST_RAD + 1), True),
        ((0, 0, -MOST_RAD - 1), True),
    ],
)
def test_a_robot_that_moved_or_turned_far_enough_makes_the_next_one(
    steps: tuple[int, int, int], is_one: bool
) -> None:
    robot = Driven()
    x, y, theta = 5 + steps[0], -7 + steps[1], 3 + steps[2]
    robot.to(101, x, y, theta)
    assert robot.next() == (Keyframe(101, 0, x, y, theta) if is_one else None)


def test_what_it_moved_counts_from_the_last_keyframe_and_not_from_the_last_look() -> None:
    robot = Driven()
    found = []
    for k in range(1, 9):
        robot.to(100 + k, 5 + k * (MOST_M // 3), -7, 3)
        keyframe = robot.next()
        found += [keyframe.n] if keyframe else []
    # three thirds are a little less than the whole
    assert found == [104, 108]


def test_who_may_move_though_its_wheels_stand_has_a_place_of_its_own_each_time() -> None:
    robot = Driven()
    assert robot.next(is_doubted=True) is None
    for n in (101, 102):
        robot.to(n, 5, -7, 3)
        assert robot.next() is None
        assert robot.next(is_doubted=True) == Keyframe(n, 0, 5, -7, 3)
        assert robot.next(is_doubted=True) is None


def test_behind_a_hole_a_new_segment_begins_wherever_it_is() -> None:
    robot = Driven()
    robot.to(103, 5, -7, 3)
    assert robot.next() == Keyframe(103, 1, 5, -7, 3)
    robot.to(104, 5, -7, 3)
    assert robot.next() is None
    robot.to(109, 5, -7, 3)
    robot.to(110, 5, -7, 3)
    assert robot.next() == Keyframe(109, 2, 5, -7, 3)


def test_who_turns_otherwise_has_some_between_also_of_the_way_until_then() -> None:
    """Two seconds as ever, one after it is known; what was said is not said again."""
    robot = Driven()
    for n in range(101, 131):
        robot.to(n, 100 * (n - 100) + 5, 7 * (n - 101), n - 97)
        if n in (110, 120):
            assert robot.next() is not None
    found = robot.selector.made(robot.track, is_odd=True)
    assert [k.n for k in found] == [125, 115, 105, 130]
    assert found[0] == Keyframe(125, 0, 2505, 168, 28)
    assert robot.selector.made(robot.track, is_odd=True) == []
    robot.to(140, 0, 0, 0)
    assert [k.n for k in robot.selector.made(robot.track)] == [140]


def test_who_stood_before_has_some_only_of_where_it_may_have_driven() -> None:
    robot = Driven()
    for n in range(101, 301):
        robot.to(n, 5, -7, 3)
    robot.to(301, 9000, 0, 0)
    assert robot.next() is not None
    assert [k.n for k in robot.selector.finer(robot.track)] == [296, 291, 286]


def test_across_a_hole_there_are_none() -> None:
    robot = Driven()
    robot.to(110, 9000, 0, 0)
    assert robot.next() is not None
    assert robot.selector.finer(robot.track) == []


def test_a_long_way_is_said_piece_by_piece_the_newest_first() -> None:
    robot = Driven()
    for n in range(101, 101 + 10 * (AT_ONCE + 5)):
        robot.to(n, 100 * n, 0, 0)
        if n % 10 == 0:
            assert robot.next() is not None
    last = 100 + 10 * (AT_ONCE + 5)
    first = [k.n for k in robot.selector.finer(robot.track)]
    assert first == [last - 5 - 10 * k for k in range(AT_ONCE)]
    assert [k.n for k in robot.selector.finer(robot.track)] == [145, 135, 125, 115, 105]


def stopping(robot: Driven, speed: int) -> None:
    """It drives on for two seconds, so many steps in each tenth, and stands for two."""
    for n in range(101, 141):
        robot.to(n, 5 + speed * min(n - 100, 20), -7, 3)
        if n % 10 == 0:
            robot.next()


def test_where_wheels_stop_at_once_a_keyframe_lies_on_either_side_and_is_said_once() -> None:
    """0.6 m/s; sample 100 was the first, so that it begins at that speed."""
    robot = Driven()
    stopping(robot, 600)
    found = robot.selector.made(robot.track)
    assert found == [Keyframe(n, 0, 5 + 600 * min(n - 100, 20), -7, 3) for n in (119, 121)]
    assert robot.selector.made(robot.track) == []


def test_what_lies_beside_a_jump_and_is_a_keyframe_already_is_not_said_again() -> None:
    robot = Driven()
    for n in range(101, 141):
        robot.to(n, 5 + 600 * min(n - 100, 20), -7, 3)
        if n in (110, 119, 121):
            assert robot.next() is not None
    assert robot.selector.made(robot.track) == []


def test_a_robot_that_stops_as_robots_do_makes_no_more_keyframes() -> None:
    robot = Driven()
    stopping(robot, 300)
    assert robot.selector.made(robot.track) == []


def test_a_finer_keyframe_that_lies_beside_a_jump_is_not_said_again() -> None:
    robot = Driven()
    stopping(robot, 600)
    first = robot.selector.made(robot.track)
    assert [k.n for k in first] == [119, 121]
    # 115 and 105 lie half way between those of each second; one of 120 lies beside the jump
    robot.selector._lately.append(115)
    found = [k.n for k in robot.selector.made(robot.track, is_odd=True)]
    assert 105 in found
    assert 115 not in found
