"""One thing that stands: found, told once, watched, and let go when it is moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from passing_scene import OWN, SENSORS, PassingScene

from drslamd.conventions import Chain, node_chain
from drslamd.slam import se2
from drslamd.slam.graph.tables import NO_HEADING
from drslamd.slam.points.point_tracker import (
    LOOK_US,
    NEXT_SIGMA_M,
    OFF_M,
    OFF_S,
    PROVEN_S,
    PointTracker,
    Target,
)
from drslamd.slam.relative_pose.range_buffer import RangeBuffer

NODE = node_chain(77)
MODULE = Target(NODE)
PLACE = np.array([3.0, -2.0])


def looked(scene: PassingScene, tracker: PointTracker) -> bool:
    """A search that was due, and whether its answer is certain."""
    run = tracker.look(scene.own, scene.ranges, scene.utime)
    if run is None:
        return False
    found, when = run()
    return tracker.is_certain(found, scene.own, when)


def told(target: Target = MODULE) -> tuple[PassingScene, PointTracker]:
    """A drive of 40 s, after which the place is told as keyframe 0."""
    scene, tracker = PassingScene(PLACE), PointTracker(target, SENSORS)
    scene.drive(37)
    assert not looked(scene, tracker)
    scene.drive(3)
    assert looked(scene, tracker)
    assert tracker.say(0, scene.own, scene.ranges, scene.utime, 5)
    return scene, tracker


def test_a_place_is_told_when_two_searches_name_it() -> None:
    scene, tracker = told()
    (closure,) = tracker.tell()
    assert (closure.number, closure.kept, closure.peer, closure.b_n) == (5, True, NODE, 0)
    assert closure.covariance[5] == pytest.approx(NO_HEADING)
    keyframes = scene.own.data.keyframes
    (at,), _ = keyframes.find(np.array([float(closure.a_n)]))
    assert se2.transform(keyframes.poses[at], np.array(closure.a_T_b[:2])) == pytest.approx(
        PLACE, abs=0.1
    )
    assert tracker.tell() == []


def test_the_ranges_that_led_there_are_told_with_it_and_then_one_a_second() -> None:
    scene, tracker = told()
    ranges = tracker.tell_ranges()
    assert len(ranges) == 40
    keyframes = scene.own.data.keyframes
    for item in ranges:
        (at,), there = keyframes.find(np.array([float(item.a_n)]))
        assert there.all()
        antenna = se2.transform(keyframes.poses[at], np.array(item.q_a))
        assert np.hypot(*(antenna - PLACE)) == pytest.approx(item.range_m, abs=0.03)
    for _ in range(3):
        scene.drive(1)
        tracker.sample(scene.own, scene.ranges)
    assert len(tracker.tell_ranges()) == 3


def test_ranges_to_a_robot_are_not_told_a_second_time() -> None:
    scene, tracker = told(Target(Chain(5, 1), 0, arm_m=0.3))
    scene.drive(1)
    tracker.sample(scene.own, scene.ranges)
    assert tracker.tell_ranges() == []
    (closure,) = tracker.tell()
    bare = told()[1].tell()[0]
    assert closure.covariance[0] - bare.covariance[0] == pytest.approx(0.3**2)


def test_searches_take_their_time() -> None:
    scene, tracker = PassingScene(PLACE), PointTracker(Target(NODE), SENSORS)
    scene.drive(10)
    assert tracker.look(scene.own, scene.ranges, scene.utime) is not None
    assert tracker.look(scene.own, scene.ranges, scene.utime + LOOK_US - 1) is None
    assert tracker.look(scene.own, scene.ranges, scene.utime + LOOK_US) is not None


def test_what_was_ranged_before_it_stood_there_is_not_looked_at() -> None:
    scene = PassingScene(PLACE + [4.0, 1.0])
    scene.drive(20)
    scene.node = PLACE
    since = scene.utime
    scene.drive(40)
    for target, is_found in ((Target(NODE), False), (Target(NODE, since_us=since), True)):
        run = PointTracker(target, SENSORS).look(scene.own, scene.ranges, scene.utime)
        assert run is not None
        found, _ = run()
        is_there = found.verdict == "" and found.candidates[0].chi2 < 1.0
        assert is_there is is_found


@pytest.mark.parametrize(("moved_m", "is_moved"), [(OFF_M - 0.15, False), (2.0, True)])
def test_what_is_moved_is_noticed_within_seconds(moved_m: float, is_moved: bool) -> None:
    scene, tracker = told()
    sight = scene.path[10 * scene.seconds, :2] - PLACE
    scene.node = PLACE - moved_m * sight / np.hypot(*sight)
    said = []
    for _ in range(OFF_S + 1):
        scene.drive(1)
        estimate = scene.estimate(NODE.robot, PLACE)
        said.append(tracker.watch(estimate, scene.own, scene.ranges))
    assert any(said) is is_moved
    assert not any(said[: OFF_S - 1])


def test_what_is_let_go_is_withdrawn_and_looked_for_anew() -> None:
    scene, tracker = told()
    tracker.tell()
    tracker.let_go(scene.utime)
    (withdrawn,) = tracker.tell()
    assert (withdrawn.number, withdrawn.kept) == (5, False)
    scene.drive(2)
    run = tracker.look(scene.own, scene.ranges, scene.utime)
    assert run is not None
    found, _ = run()
    assert found.verdict != ""


@pytest.mark.parametrize("seconds", [PROVEN_S - 1, PROVEN_S])
def test_what_stood_where_it_was_told_for_long_stays_told_and_stands_elsewhere_since(
    seconds: int,
) -> None:
    """A range to the next place says so; what was not proven is withdrawn."""
    scene, tracker = told()
    for _ in range(seconds):
        scene.drive(1)
        assert not tracker.watch(scene.estimate(NODE.robot, PLACE), scene.own, scene.ranges)
    assert tracker.is_proven is (seconds == PROVEN_S)
    (first,) = tracker.tell()
    tracker.tell_ranges()
    tracker.leave(scene.own, scene.ranges, scene.utime)
    assert tracker.told is None
    assert not tracker.is_proven
    if seconds < PROVEN_S:
        assert tracker.tell() == [replace(first, kept=False)]
        assert tracker.tell_ranges() == []
        return
    assert tracker.tell() == []
    (left,) = tracker.tell_ranges()
    assert (left.peer, left.b_n, left.sigma_m) == (NODE, 1, NEXT_SIGMA_M)
    scene.say([first], [left])
    assert scene.graph.nodes[NODE.robot].keyframes.n.tolist() == [0, 1]


def test_of_what_is_out_of_sight_nothing_can_say_that_it_stands_elsewhere() -> None:
    scene, tracker = told()
    for _ in range(PROVEN_S):
        scene.drive(1)
        tracker.watch(scene.estimate(NODE.robot, PLACE), scene.own, scene.ranges)
    tracker.tell()
    tracker.tell_ranges()
    tracker.leave(scene.own, RangeBuffer(), scene.utime)
    (withdrawn,) = tracker.tell()
    assert not withdrawn.kept
    assert tracker.tell_ranges() == []


def test_somebody_else_found_it_elsewhere() -> None:
    scene, tracker = told()
    closures = tracker.tell()
    scene.say(closures)
    assert not tracker.is_outdated(scene.graph)
    scene.say([replace(closures[0], b_n=1, number=6)])
    assert tracker.is_outdated(scene.graph)


def test_of_a_place_that_is_not_solved_nothing_can_be_said() -> None:
    scene, tracker = told()
    scene.node = PLACE + 3.0
    for _ in range(OFF_S + 2):
        scene.drive(1)
        assert not tracker.watch(scene.estimate(99_999, PLACE), scene.own, scene.ranges)
        assert not tracker.watch(scene.estimate(NODE.robot, PLACE, 4), scene.own, scene.ranges)
    assert OWN.robot in scene.graph.chains
