"""All that stands around one robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.play import virtual_team
from lab.recordings import world
from passing_scene import OWN, SENSORS, PassingScene
from slam_scenes import NOISE, keyframes, model_of
from teams import EASY

from drslamd import report
from drslamd.conventions import Chain, node_chain
from drslamd.gossip import messages
from drslamd.gossip.message_types import Pose, PoseState
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry
from drslamd.slam.graph.tables import NO_HEADING
from drslamd.slam.points.point_tracker import PROVEN_S, Target
from drslamd.slam.points.points import FIRST_NUMBER, MOST, Points

UWB_ID, OTHER = 77, 78
NODE = node_chain(UWB_ID)
PLACE = np.array([3.0, -2.0])


class Robot:
    """A drive past one module, look by look."""

    def __init__(self) -> None:
        self.scene, self.points = PassingScene(PLACE), Points(OWN, SENSORS)
        self.targets = {UWB_ID: Target(NODE)}
        self.estimate: TeamEstimate | None = None
        self.carried: dict[int, int] = {}
        self.told = 0

    def drive(self, seconds: int, is_solved: bool = False) -> None:
        """Second by second; what is told goes into the log."""
        scene, points = self.scene, self.points
        for _ in range(seconds):
            scene.drive(1)
            ranges = {UWB_ID: scene.ranges}
            if is_solved:
                self.estimate = scene.estimate(NODE.robot, PLACE)
            known = scene.own, scene.graph, self.estimate
            run = points.look(self.targets, ranges, *known, self.carried.get, scene.utime)
            if run is not None:
                points.on_found(run(), ranges, scene.own, scene.graph, self.estimate)
            closures, told = points.tell(), points.tell_ranges()
            self.told += len(closures)
            scene.say(closures, told)

    def kept(self) -> list[tuple[int, int]]:
        """Number and place of the closures that count."""
        pair = self.scene.graph.pairs.get((OWN.robot, NODE.robot))
        return [(c.number, c.b_n) for c in pair.kept_closures()] if pair else []


def test_a_module_is_told_once() -> None:
    robot = Robot()
    robot.drive(45)
    assert robot.kept() == [(FIRST_NUMBER + 1, 0)]
    robot.drive(5)
    assert robot.told == 1
    assert len(robot.scene.graph.pairs[OWN.robot, NODE.robot].ranges) >= 40


def test_a_module_that_is_moved_gets_another_place() -> None:
    robot = Robot()
    robot.drive(45)
    robot.drive(1, is_solved=True)
    robot.scene.node = PLACE + [2.0, 2.0]
    robot.drive(30, is_solved=True)
    assert (FIRST_NUMBER + 1, 0) not in robot.kept()
    robot.estimate = None
    robot.drive(30)
    assert robot.kept() == [(FIRST_NUMBER + 2, 1)]


def test_a_module_that_stood_long_enough_keeps_its_place_and_gets_the_next_one() -> None:
    robot = Robot()
    robot.drive(45)
    robot.drive(PROVEN_S, is_solved=True)
    robot.scene.node = PLACE + [-4.0, 2.0]
    kept = []
    for _ in range(30):
        robot.drive(1, is_solved=True)
        named = robot.scene.graph.nodes[NODE.robot].keyframes.n.tolist()
        kept.append((named, robot.kept()))
    assert ([0], [(FIRST_NUMBER + 1, 0)]) in kept
    assert ([0, 1], [(FIRST_NUMBER + 1, 0)]) in kept
    assert robot.kept() == [(FIRST_NUMBER + 1, 0), (FIRST_NUMBER + 2, 1)]


@pytest.mark.parametrize("seconds", [PROVEN_S - 1, PROVEN_S])
def test_what_somebody_else_found_elsewhere_was_here_before_if_ranges_fitted_for_long(
    seconds: int,
) -> None:
    robot = Robot()
    robot.drive(45)
    robot.drive(seconds, is_solved=True)
    (closure,) = robot.scene.graph.pairs[OWN.robot, NODE.robot].kept_closures()
    insert(robot, Chain(8, 1), replace(closure, b_n=1))
    robot.drive(1)
    kept = [(FIRST_NUMBER + 1, 0)] if seconds == PROVEN_S else []
    assert robot.kept() == kept


@pytest.mark.parametrize(("moved", "said"), [((2.0, -2.0), 0), ((2.0, 2.0), 3)])
def test_a_range_that_may_be_to_another_place_is_not_said(
    moved: tuple[float, float], said: int
) -> None:
    """Across the line of sight a move shows in the fourth second, by 0.5 m and 2.7 sigmas: not yet
    enough to say that it was one."""
    robot = Robot()
    robot.drive(45)
    robot.drive(2, is_solved=True)
    counts = []
    for seconds in (1, 4):
        robot.drive(seconds, is_solved=True)
        counts.append(len(robot.scene.graph.pairs[OWN.robot, NODE.robot].ranges))
        robot.scene.node = PLACE + moved
    assert counts[1] - counts[0] == said
    assert robot.kept() == [(FIRST_NUMBER + 1, 0)]


def test_a_module_that_turns_out_to_be_a_robots_is_withdrawn() -> None:
    robot = Robot()
    robot.drive(45)
    robot.targets = {UWB_ID: Target(Chain(5, 1), 3)}
    robot.drive(1)
    assert robot.kept() == []


@pytest.mark.parametrize("is_followed", [True, False])
def test_a_module_whose_robot_is_switched_on_is_withdrawn_wherever_that_is_known(
    is_followed: bool,
) -> None:
    """A robot that has its pose by then is no target, nor is one that is out of sight."""
    robot = Robot()
    robot.drive(45)
    robot.targets = {}
    if not is_followed:
        robot.targets = {k: Target(node_chain(k)) for k in range(100, 100 + MOST)}
    robot.drive(1)
    assert (UWB_ID in robot.points.trackers) is is_followed
    robot.carried = {UWB_ID: 5}
    robot.drive(1)
    assert robot.kept() == [(FIRST_NUMBER + 1, 0)]
    # its log has begun
    robot.scene.graph.insert(Chain(5, 1), GraphEntry(0, keyframes=keyframes([0], [(0, 0, 0)])))
    robot.drive(1)
    assert robot.kept() == []
    assert UWB_ID not in robot.points.trackers
    robot.drive(1)
    assert robot.told == 2


def test_a_robot_that_drives_to_another_place_is_followed_there_and_stays_told_here() -> None:
    robot = Robot()
    robot.targets = {UWB_ID: Target(Chain(5, 1), 3)}
    robot.drive(45)
    robot.targets = {UWB_ID: Target(Chain(5, 1), 9, robot.scene.utime)}
    robot.drive(1)
    assert robot.points.trackers[UWB_ID].target.n == 9
    (closure,) = robot.scene.graph.pairs[OWN.robot, 5].kept_closures()
    assert closure.b_n == 3


def test_two_who_find_one_module_name_one_place_and_another_where_it_was_moved() -> None:
    other = Robot()
    other.drive(45)
    (closure,) = other.scene.graph.pairs[OWN.robot, NODE.robot].kept_closures()
    for elsewhere, place in (((0.0, 0.0), 4), ((3.0, 0.0), 5)):
        robot = Robot()
        robot.drive(20)
        insert(robot, Chain(8, 1), replace(closure, b_n=4))
        for _ in range(30):
            robot.drive(1)
            there = PLACE + np.array(elsewhere)
            robot.estimate = robot.scene.estimate(NODE.robot, there, 4)
            if robot.kept():
                break
        assert [b_n for _, b_n in robot.kept()] == [place]


def insert(robot: Robot, peer: Chain, closure: ClosureMeasurement) -> None:
    """Somebody else says so."""
    graph = robot.scene.graph
    graph.insert(peer, GraphEntry(0, model_of(NOISE), keyframes([closure.a_n], [(0, 0, 0)])))
    graph.insert(peer, GraphEntry(1, closures=(closure,)))


def test_so_many_things_are_followed_and_no_more() -> None:
    robot = Robot()
    robot.targets = {k: Target(node_chain(k)) for k in range(MOST + 1)}
    robot.drive(1)
    assert len(robot.points.trackers) == MOST
    robot.targets = {}
    robot.drive(1)
    assert robot.points.trackers == {}


def test_who_drives_on_makes_room_for_what_is_heard_there() -> None:
    robot = Robot()
    robot.drive(45)
    robot.targets = {k: Target(node_chain(k)) for k in range(100, 100 + MOST)}
    robot.drive(1)
    assert sorted(robot.points.trackers) == sorted(robot.targets)
    assert robot.kept() == [(FIRST_NUMBER + 1, 0)]


def test_what_is_told_is_remembered_while_it_is_not_heard() -> None:
    robot = Robot()
    robot.drive(45)
    robot.targets = {}
    robot.drive(2)
    assert UWB_ID in robot.points.trackers


@pytest.mark.slow
def test_a_team_finds_a_parked_robot_and_a_module_and_agrees_on_both() -> None:
    """Two drive; the third and a module stand. Nobody learns a heading of what stands."""
    rng = np.random.default_rng(3)
    scene = world.Scene(**{**EASY.__dict__, "robots": 4, "seconds": 45.0})
    drives = [world.drive(rng, scene) for _ in range(2)]
    places = ((5.0, 6.0, 0.7), (2.0, 9.0, 0.0))
    parked = [np.tile(place, (len(drives[0]), 1)) for place in places]
    whole = world.recorded("two stand", rng, scene, [*drives, *parked])
    trails = {robot: whole.trails[robot] for robot in range(3)}
    recording = replace(whole, trails=trails, ranges=whole.ranges[whole.ranges[:, 1] < 3])
    simulator = virtual_team.play(recording, 3)
    node = node_chain(3).robot
    robots = {r: simulator.members[r].robot for r in range(3)}
    one = robots[0].back.estimate
    assert one is not None
    for robot in robots.values():
        estimate = robot.back.estimate
        assert estimate is not None
        assert estimate.points == {2, node}
        assert sorted(estimate.nodes) == [node]
        apart = estimate.everybody[2].poses[-1, :2] - estimate.nodes[node].poses[-1, :2]
        assert np.hypot(*apart) == pytest.approx(np.hypot(3.0, 3.0), abs=0.2)
        for number in (2, node):
            covariance = estimate.covariance(number)
            assert covariance is not None
            assert covariance[2, 2] == pytest.approx(NO_HEADING)
            there = estimate.everybody[number].poses
            assert there == pytest.approx(one.everybody[number].poses, abs=1e-6)
    assert len({robot.back.digest() for robot in robots.values()}) == 1
    member = simulator.members[2]
    said = {
        message.state
        for _, channel, payload in member.traces.sent
        if messages.kind_of_channel(channel) == "POSE"
        and isinstance(message := messages.decode("POSE", payload), Pose)
    }
    assert said <= {PoseState.POSITION, PoseState.STALE}
    assert PoseState.POSITION in said
    status = report.status(member.robot, member.clock.local(simulator.now))
    assert list(status["graph"]["modules"]) == ["3"]
