"""Numbers of a message that run out, and values that none can say: the robot goes on without."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
from borders import spoken
from message_builders import an_entry
from robot_scenes import ticked
from teams import VirtualTeam

from drslamd.conventions import SECOND_US
from drslamd.events import Effect, Restart, Send
from drslamd.gossip import messages
from drslamd.gossip.message_types import Heard, OdometryBatch, Pose
from drslamd.gossip.peer import Peer
from drslamd.robot import Robot
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry, RangeMeasurement
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.robot_model import UNTOLD


@pytest.fixture(scope="module")
def pair() -> VirtualTeam:
    """Two robots that have been talking for five seconds."""
    team = VirtualTeam(on=(0, 1))
    team.run(5.0)
    return team


@pytest.fixture
def utime(pair: VirtualTeam) -> int:
    """Of robot 1, after these seconds."""
    return pair.member(1).clock.local(pair.simulator.now)


@pytest.fixture
def robot(pair: VirtualTeam) -> Robot:
    """Robot 1 then, for one test alone."""
    return copy.deepcopy(pair.member(1).robot)


def later(robot: Robot, utime: int, seconds: int = 1) -> list[Effect]:
    """What it does at its next ticks."""
    return [e for k in range(1, seconds + 1) for e in ticked(robot, utime + k * SECOND_US)]


def restarts(effects: list[Effect]) -> list[int]:
    return [effect.above for effect in effects if isinstance(effect, Restart)]


def drive(robot: Robot, x: float, y: float, theta: float) -> None:
    """Put one more sample on its track, in steps."""
    track = robot.front.reckoning.track
    track.append(track.end, np.array([x, y, theta]))


# numbers that run out


@pytest.mark.parametrize(("counter", "again"), [(2**31 - 1 - 100_001, False), (2**31 - 2, True)])
def test_a_robot_that_runs_out_of_counters_begins_again(
    robot: Robot, utime: int, counter: int, again: bool
) -> None:
    robot.team.seal._counter = counter - 3
    drive(robot, 9_000.0, 0.0, 0.0)
    assert restarts(later(robot, utime)) == ([1] if again else [])


@pytest.mark.parametrize(("segment", "again"), [(2**15 - 2, False), (2**15 - 1, True)])
def test_a_robot_whose_odometry_broke_too_often_for_16_bits_begins_again(
    robot: Robot, utime: int, segment: int, again: bool
) -> None:
    robot.front._keyframes._segment = segment
    track = robot.front.reckoning.track
    track.append(track.end + 1, np.array([9_000.0, 0.0, 0.0]))
    assert restarts(later(robot, utime)) == ([1] if again else [])


FAR = 2**31 - 1 - 2**20


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("step", "again"), [(FAR, False), (FAR + 1, True), (-FAR - 1, True)])
def test_a_robot_that_drove_or_turned_too_far_for_32_bits_begins_again(
    robot: Robot, utime: int, axis: int, step: int, again: bool
) -> None:
    steps = [0.0, 0.0, 0.0]
    steps[axis] = float(step)
    drive(robot, *steps)
    effects = later(robot, utime, seconds=3)
    assert bool(restarts(effects)) == again
    for effect in effects:
        if isinstance(effect, Send) and messages.kind_of_channel(effect.channel) == "ODOMETRY":
            assert not isinstance(messages.decode("ODOMETRY", effect.payload), str)


def test_a_team_goes_on_when_one_of_them_has_begun_again() -> None:
    pair = VirtualTeam(on=(0, 1))
    pair.run(5.0)
    old = pair.member(1).robot
    old.front.reckoning.pose = (1e-4 * (FAR + 1), 0.0, 0.0)
    pair.run(16.0)
    new = pair.member(1).robot
    assert new is not old
    assert new.own.epoch > old.own.epoch
    utime = pair.member(0).clock.local(pair.simulator.now)
    assert set(pair.member(0).robot.team.living(utime)) == {1}


# values that no message can say


def the_spoken() -> tuple[RangeMeasurement, ClosureMeasurement, Pose, PublicPoses, OdometryBatch]:
    _, like = spoken()
    entry, pose = like["GRAPH"], like["POSE"]
    public, batch = like["PUBLIC"], like["ODOMETRY"]
    assert isinstance(entry, GraphEntry)
    assert isinstance(pose, Pose)
    assert isinstance(public, PublicPoses)
    assert isinstance(batch, OdometryBatch)
    return entry.ranges[0], entry.closures[0], pose, public, batch


def test_what_was_measured_and_no_message_can_say_is_left_out_and_counted(robot: Robot) -> None:
    team = robot.team
    place, closure, *_ = the_spoken()
    ranges = [place, replace(place, range_m=1e4), replace(place, sigma_m=33.0)]
    ranges += [replace(place, q_a=(0.0, -33.0)), replace(place, range_m=float("nan"))]
    closures = [closure, replace(closure, a_T_b=(1e4, 0.0, 0.0))]
    closures += [replace(closure, covariance=(1e40, 0.0, 0.0, 1.0, 0.0, 1.0))]
    closures += [replace(closure, covariance=(1.0, 1.0, 0.0, 1.0, 0.0, 1.0))]
    (entry,) = team.entries(UNTOLD, (), ranges, closures)
    assert entry.ranges == (place,)
    assert entry.closures == (closure,)
    assert team.unsayable == 7
    decoded, _ = team.append(entry, 10 * SECOND_US)
    assert len(decoded.ranges) == len(decoded.closures) == 1


def test_a_value_just_within_its_bound_is_still_there_when_it_is_rounded(robot: Robot) -> None:
    team = robot.team
    place, closure, *_ = the_spoken()
    edge = 1e4 - 2e-3
    ranges = [replace(place, range_m=sign * edge) for sign in (1, -1)]
    closures = [replace(closure, a_T_b=(edge, -edge, sign * np.pi)) for sign in (1, -1)]
    (entry,) = team.entries(UNTOLD, (), ranges, closures)
    decoded, _ = team.append(entry, 10 * SECOND_US)
    assert len(decoded.ranges) == len(decoded.closures) == 2
    assert team.unsayable == 0


# what a peer cannot mean


def test_a_peer_that_wants_odometry_from_the_future_gets_what_there_is(
    robot: Robot, utime: int
) -> None:
    """It believed a false batch, and would wait for ever."""
    peer: Peer = robot.team.peers[0]
    assert peer.status is not None
    wanted = Heard(1, robot.own.epoch, 0, 2**31 - 1)
    named = replace(peer.status, heard=(wanted,))
    peer.take_status(named, peer._status_counter + 1, robot.own, utime)
    later = utime + SECOND_US
    (send,) = robot.broadcast.odometry(robot.neighbours(later), later)
    assert isinstance(send, Send)
    batch = messages.decode("ODOMETRY", send.payload)
    assert isinstance(batch, OdometryBatch)
    track = robot.front.reckoning.track
    assert batch.n0 + len(batch.steps) == track.end
    assert len(batch.steps) == len(track) > 30


def test_an_entry_with_nothing_to_say_is_none(robot: Robot) -> None:
    team = robot.team
    place, *_ = the_spoken()
    assert list(team.entries(UNTOLD, (), [replace(place, range_m=1e5)], ())) == []
    assert list(team.entries(UNTOLD, an_entry(0, 1).keyframes, (), ())) != []
