"""The robot by itself: every event in, every effect out, nothing from outside."""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
import pytest
from acquainted import introduce
from frames import KOBUKI_REST, kobuki_core, kobuki_packet, ranging_stream
from message_builders import a_seal, a_status, sealed
from robot_scenes import RobotScene, saves, sends, status_in
from slam_scenes import product, same_pose

from drslamd.conventions import GRID_US, Chain, Segment
from drslamd.events import (
    CanFrame,
    ChannelMessage,
    Datagram,
    Effect,
    Level,
    NetworkState,
    Note,
    PortCondition,
    PortState,
    Restart,
    Save,
    Send,
    SerialData,
    Stop,
    Write,
)
from drslamd.gossip import lc02
from drslamd.gossip.message_types import Heard
from drslamd.slam.calibration.sensor_calibration import SensorCalibration
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import GraphEntry, Keyframe

ROBOTEQ = 'source = "roboteq"\nport = "x"\ntrack_m = 0.5\ncounts_per_metre = 1000.0\n'
AGILEX = 'source = "agilex"\ntrack_m = 0.5\n'

# every kind of event


def test_bytes_of_the_uwb_module_become_ranges() -> None:
    scene = RobotScene(robot=5)
    for frame in ranging_stream(3):
        assert scene.robot.handle(SerialData(scene.utime, "uwb", frame)) == []
        scene.later(0.02)
    assert scene.robot.front.ranges[10].count == 2


def test_bytes_of_the_wheels_become_odometry() -> None:
    scene = RobotScene()
    for k in range(50):
        packet = kobuki_packet(kobuki_core(1000 + 20 * k, 117 * k, 117 * k) + KOBUKI_REST)
        assert scene.robot.handle(SerialData(scene.utime, "wheels", packet)) == []
        scene.later(0.02)
    reckoning = scene.robot.front.reckoning
    assert reckoning.path_m == pytest.approx(49 * 117 / 11_724.4)
    assert len(reckoning.track) == 10


def test_can_frames_become_odometry() -> None:
    scene = RobotScene(wheels=AGILEX)
    for k in range(3):
        data = struct.pack(">ii", 10 * k, 10 * k)
        assert scene.robot.handle(CanFrame(scene.utime, 0x311, False, data)) == []
        scene.later(0.02)
    assert scene.robot.front.reckoning.path_m == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("condition", "level"), [(PortCondition.OPEN, Level.INFO), (PortCondition.LOST, Level.WARNING)]
)
def test_the_state_of_a_port_is_remembered_and_noted(
    condition: PortCondition, level: Level
) -> None:
    scene = RobotScene()
    state = PortState(scene.utime, "uwb", condition, "/dev/uwb")
    note = Note(level, "uwb.port", {"state": condition.value, "detail": "/dev/uwb"})
    assert scene.robot.handle(state)[0] == note
    assert scene.robot.ports == {"uwb": state}


def test_of_a_port_that_opens_nobody_reads_any_longer_why_it_was_shut() -> None:
    """Both stand in one answer to `status`, also between two looks at the health."""
    scene = RobotScene()
    scene.robot.handle(PortState(scene.utime, "uwb", PortCondition.BUSY, "/dev/uwb"))
    assert scene.robot.health.sentences()["uwb"].startswith("uwb: in use by another program")
    scene.robot.handle(PortState(scene.utime + 1, "uwb", PortCondition.OPEN, "/dev/uwb"))
    assert "uwb" not in scene.robot.health.sentences()


@pytest.mark.parametrize(
    ("up", "note"),
    [
        (True, Note(Level.INFO, "network.up", {"detail": "eth0"})),
        (False, Note(Level.WARNING, "network.down", {"detail": "eth0"})),
    ],
)
def test_the_state_of_the_network_is_remembered_and_noted(up: bool, note: Note) -> None:
    scene = RobotScene()
    state = NetworkState(scene.utime, up, "eth0")
    assert scene.robot.handle(state)[0] == note
    assert ("network" in scene.robot.health.sentences()) is not up
    assert scene.robot.network is state


@pytest.mark.parametrize("is_framed", [True, False])
def test_what_a_peer_adds_to_the_graph_is_taken_in_once(is_framed: bool) -> None:
    scene = RobotScene()
    introduce(scene.robot.team, Chain(4, 1))
    entry = GraphEntry(0, keyframes=(Keyframe(7, 0, 0, 0, 0),))
    channel, payload = sealed(a_seal(4), entry)
    event: Datagram | ChannelMessage = ChannelMessage(scene.utime, channel, payload)
    if is_framed:
        event = Datagram(scene.utime, lc02.encode(1, channel, payload))
    for _ in range(2):
        assert scene.robot.handle(event) == []
    assert scene.robot.back.graph.chains[4].keyframes.n.tolist() == [7]
    assert scene.robot.team.repeats_heard == 1


@pytest.mark.parametrize(("wheels", "sleep_us"), [(ROBOTEQ, 10_000), (None, 100_000)])
def test_a_base_that_must_be_asked_is_asked_and_no_other_wakes_the_robot_for_it(
    wheels: str | None, sleep_us: int
) -> None:
    scene = RobotScene(wheels=wheels)
    written = [effect for effect in scene.tick() if isinstance(effect, Write)]
    assert written == ([Write("wheels", b"^ECHOF 1\r?C\r")] if wheels else [])
    assert scene.robot.next_tick == scene.utime + sleep_us


@pytest.mark.row("O4")
def test_an_orderly_stop_says_goodbye_three_times_and_keeps_the_state() -> None:
    scene = RobotScene(epoch=9, epochs={4: 7})
    *said, last = scene.robot.handle(Stop(scene.utime))
    assert [status_in(e).leaving for e in said if isinstance(e, Send)] == [True] * 3
    assert isinstance(last, Save)
    assert (last.state["epoch"], last.state["epochs"]) == (9, {4: 7})


def test_what_the_budget_does_not_allow_is_held_back_and_all_else_goes_out() -> None:
    scene = RobotScene(extra="[gossip]\nmax_bytes_per_s = 2000\n")
    outbox = scene.robot.outbox
    heartbeat = scene.tick()[0]
    assert isinstance(heartbeat, Send)
    while outbox.passes(heartbeat, scene.utime):
        pass
    held = outbox.held_back["status"]
    effects = scene.robot.handle(Stop(scene.utime))
    assert sends(effects) == []
    assert len(saves(effects)) == 1
    assert outbox.held_back["status"] == held + 3


# our pose


def test_a_pose_is_the_solved_keyframe_carried_on_by_odometry() -> None:
    scene = RobotScene()
    scene.drive(2, metres=0.05, radians=0.04)
    track = scene.robot.front.reckoning.track
    then = track.at(track.end - 11)
    scene.localise((3.0, -1.0, 0.7), n=track.end - 11)
    found = scene.robot.pose()
    assert found is not None
    assert found.utime == scene.utime // GRID_US * GRID_US
    now = track.at(track.end - 1)
    back = product((*-then[:2], 0.0))
    step = product((0.0, 0.0, -then[2]), back, now)
    assert same_pose(found.pose, product((3.0, -1.0, 0.7), step))
    assert np.hypot(*(found.pose[:2] - [3.0, -1.0])) == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize(
    ("theta", "turns", "expected"),
    [
        (3.0, 10, 3.4 - 2 * math.pi),
        (-3.0, -10, -3.4 + 2 * math.pi),
        (3.0, 2, 3.08),
        (0.5, -10, 0.1),
    ],
)
@pytest.mark.row("O12")
def test_the_heading_stays_within_half_a_turn_however_far_the_robot_turns(
    theta: float, turns: int, expected: float
) -> None:
    """Forty milliradians in each tenth of a second."""
    scene = RobotScene()
    scene.drive(1)
    scene.localise((0.0, 0.0, theta))
    scene.drive(abs(turns) / 10, metres=0.0, radians=math.copysign(0.04, turns))
    found = scene.robot.pose()
    assert found is not None
    assert found.pose[2] == pytest.approx(expected, abs=1e-3)


def test_a_pose_is_as_uncertain_as_the_estimate_says() -> None:
    scene = RobotScene()
    scene.drive(1)
    covariance = np.array([[0.04, 0.01, 0.002], [0.01, 0.09, -0.003], [0.002, -0.003, 0.0025]])
    scene.localise(covariance=covariance)
    found = scene.robot.pose()
    assert found is not None
    assert np.array_equal(found.covariance, covariance)


def test_a_pose_is_the_more_uncertain_the_farther_odometry_went_since() -> None:
    scene = RobotScene()
    scene.drive(1)
    covariance = np.diag([0.04, 0.09, 0.0025])
    scene.localise(covariance=covariance)
    traces = []
    for _ in range(3):
        found = scene.robot.pose()
        assert found is not None
        traces.append(np.trace(found.covariance[:2, :2]))
        scene.drive(5)
    assert traces[0] == pytest.approx(0.13)
    # half a metre a second, whose heading was known to 0.05 rad
    assert traces[1] > 0.13 + (0.05 * 2.4) ** 2
    assert traces[2] > traces[1] + (0.05 * 2.4) ** 2


def test_a_pose_across_a_hole_in_the_odometry_is_not_known() -> None:
    scene = RobotScene()
    scene.drive(1)
    scene.localise()
    assert scene.robot.pose() is not None
    track = scene.robot.front.reckoning.track
    track.append(track.end + 1, np.zeros(3))
    assert scene.robot.pose() is None
    scene.localise()
    assert scene.robot.pose() is not None


def test_without_odometry_or_an_estimate_of_us_there_is_no_pose() -> None:
    scene = RobotScene()
    other = Trajectory(Chain(4, 1), np.array([7]), np.zeros((1, 3)))
    own = Trajectory(scene.robot.own, np.array([1001]), np.zeros((1, 3)))
    joint = np.eye(3)
    assert scene.robot.pose() is None
    scene.robot.back.on_solution(TeamEstimate(Segment(0, 1, 0), {0: own}, joint))
    assert scene.robot.pose() is None
    scene.drive(1)
    assert scene.robot.pose() is not None
    # an estimate that claims nothing of us
    scene.robot.back.on_solution(TeamEstimate(Segment(0, 1, 0), {4: other, 0: own}, joint))
    assert scene.robot.pose() is None
    scene.robot.back.on_solution(TeamEstimate(Segment(4, 1, 0), {4: other}, joint))
    assert scene.robot.pose() is None


# what outlives a start


def saved(effects: list[Effect]) -> list[dict[str, Any]]:
    return [dict(save.state) for save in saves(effects)]


def test_the_state_is_kept_when_there_is_news_of_it() -> None:
    """Looked at once a minute."""
    scene = RobotScene(epoch=3, epochs={4: 7})
    assert saved(scene.tick()) == []
    assert saved(scene.tick(60)) == []
    scene.hear(5, a_status())
    assert saved(scene.tick(59.9)) == []
    (state,) = saved(scene.tick(0.1))
    assert (state["epoch"], state["epochs"]) == (3, {4: 7, 5: 1})
    assert saved(scene.tick(60)) == []


def test_what_was_learned_of_the_sensors_is_news_too() -> None:
    scene = RobotScene()
    scene.tick()
    scene.robot.calibration.latest = SensorCalibration(scale=Learned(0.05, 0.01))
    (state,) = saved(scene.tick(60))
    assert state["calibration"]["scale"] == [0.05, 0.01]
    assert saved(scene.tick(60)) == []


def test_a_later_start_goes_on_with_what_was_kept() -> None:
    kept = SensorCalibration(scale=Learned(0.05, 0.01))
    scene = RobotScene(kept=kept)
    assert scene.robot.calibration.used == kept
    scene.drive(1, metres=0.1)
    assert scene.robot.front.reckoning.path_m == pytest.approx(0.95 * 10 * 0.1, rel=0.01)
    off = RobotScene(kept=kept, extra="[relative_pose]\nself_calibration = false\n")
    off.drive(1, metres=0.1)
    assert off.robot.front.reckoning.path_m == pytest.approx(10 * 0.1, rel=0.01)
    assert off.robot.memory.state()["calibration"] == kept.state()


def restarts(effects: list[Effect]) -> list[int]:
    return [effect.above for effect in effects if isinstance(effect, Restart)]


@pytest.mark.parametrize(("known", "above"), [(5, []), (6, [6]), (40, [40])])
def test_a_robot_that_lost_its_memory_begins_above_what_a_peer_says_twice(
    known: int, above: list[int]
) -> None:
    scene = RobotScene(epoch=5)
    scene.tick()  # its first word: what was known before it counts for nothing
    scene.hear(4, a_status((Heard(0, known, 0),)))
    assert restarts(scene.tick()) == []
    scene.later(2)
    scene.hear(4, a_status((Heard(0, known, 0),)))
    # (a second late it is looked at twice)
    assert [*dict.fromkeys(restarts(scene.tick()))] == above


def test_a_robot_whose_id_is_used_by_another_does_not_begin_again() -> None:
    """Each of the two would drive the other on for ever."""
    scene = RobotScene(epoch=5)
    for _ in range(2):
        scene.later(2)
        scene.hear(0, a_status(), epoch=9)
        scene.hear(4, a_status((Heard(0, 9, 0),)))
    assert restarts(scene.tick()) == []
    # ten seconds after the other one was heard last
    assert restarts(scene.tick(9)) == []
    assert restarts(scene.tick(1.5)) == [9]
