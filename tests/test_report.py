"""What a robot says of itself when it is asked: every section of its status."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from frames import KOBUKI_REST, kobuki_core, kobuki_packet, ranging_stream
from message_builders import a_status
from pair_scenes import BESIDE, MIRRORED, OwnedPair
from robot_scenes import T0, RobotScene, sends

from drslamd import report
from drslamd.conventions import Segment
from drslamd.events import ChannelMessage, NetworkState, PortCondition, PortState, SerialData
from drslamd.gossip.message_types import Heard, LogState, PoseState
from drslamd.slam.calibration.sensor_calibration import SensorCalibration
from drslamd.slam.closure_method import AGREEMENT
from drslamd.slam.graph.estimate import Learned, TeamEstimate
from drslamd.slam.graph.measurements import GraphEntry, Keyframe


def section(scene: RobotScene, name: str) -> Any:
    """As it comes out of JSON."""
    return json.loads(json.dumps(report.status(scene.robot, scene.utime)))[name]


def test_the_whole_picture_begins_with_who_it_is_and_what_is_wrong() -> None:
    scene = RobotScene(robot=3, epoch=9)
    status = report.status(scene.robot, scene.utime)
    assert list(status) == [
        "robot",
        "epoch",
        "insecure",
        "problems",
        "conditions",
        "pose",
        "uwb",
        "wheels",
        "network",
        "peers",
        "pairs",
        "hypotheses",
        "points",
        "site",
        "graph",
    ]
    assert (status["robot"], status["epoch"], status["insecure"]) == (3, 9, True)
    assert status["problems"] == []
    scene.tick()
    problems = section(scene, "problems")
    assert any("no other robot is heard" in sentence for sentence in problems)


def test_of_a_robot_that_has_just_begun_there_is_nothing_yet() -> None:
    scene = RobotScene()
    assert section(scene, "pose") == {"state": "not localised"}
    assert section(scene, "peers") == section(scene, "pairs") == {}
    assert section(scene, "graph") == {"group": [], "keyframes": {}, "modules": {}}
    assert (section(scene, "points"), section(scene, "site")) == ({}, None)
    assert section(scene, "uwb")["port"] == section(scene, "wheels")["port"] == "not tried yet"
    assert section(scene, "network")["detail"] == "not tried yet"
    assert section(scene, "uwb")["age_s"] is section(scene, "wheels")["age_s"] is None


@pytest.mark.parametrize(
    ("then", "age"), [(None, None), (T0, 0.0), (T0 - 1_234_567, 1.235), (T0 + 500_000, -0.5)]
)
def test_ages_are_in_seconds_to_a_millisecond(then: int | None, age: float | None) -> None:
    assert report.age_s(T0, then) == age


# pose


def test_a_pose_is_said_with_its_frame_its_age_and_how_certain_it_is() -> None:
    scene = RobotScene(robot=2)
    scene.drive(1)
    turn = np.array([[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]])
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = turn @ np.diag([0.3**2, 0.1**2]) @ turn.T
    covariance[2, 2] = math.radians(2.0) ** 2
    scene.localise((1.0, -2.0, math.radians(30)), covariance, frame=0)
    scene.later(0.25)
    assert section(scene, "pose") == {
        "state": "localised",
        "frame": 0,
        "age_s": 0.25,
        "x_m": 1.0,
        "y_m": -2.0,
        "theta_deg": 30.0,
        # along the longest axis
        "sigma_m": 0.3,
        "sigma_deg": 2.0,
    }


def test_a_robot_whose_odometry_broke_since_it_was_placed_is_not_localised() -> None:
    scene = RobotScene()
    scene.drive(1)
    scene.localise()
    scene.later(5)
    scene.drive(1)
    assert section(scene, "pose")["state"] == "localised"
    track = scene.robot.front.reckoning.track
    track.append(track.end + 5, np.zeros(3))
    assert section(scene, "pose") == {"state": "not localised"}


# sensors


@pytest.mark.parametrize("port", ["uwb", "wheels"])
def test_a_port_is_said_with_what_is_wrong_with_it(port: str) -> None:
    scene = RobotScene()
    for condition, detail in (
        (PortCondition.DENIED, "/dev/x: Permission denied"),
        (PortCondition.OPEN, ""),
    ):
        state = PortState(scene.utime, port, condition, "/dev/x: Permission denied")  # type: ignore[arg-type]
        scene.robot.handle(state)
        found = section(scene, port)
        assert (found["port"], found["detail"]) == (condition.value, detail)


def test_of_the_uwb_module_ranges_voltage_and_age_are_said() -> None:
    scene = RobotScene(robot=5)
    scene.hear(10, a_status(uwb_id=10))
    for frame in ranging_stream(5):
        scene.later(0.02)
        scene.robot.handle(SerialData(scene.utime, "uwb", frame))
    scene.later(0.5)
    found = section(scene, "uwb")
    assert (found["age_s"], found["voltage_v"], found["foreign_id"]) == (0.5, 4.939, None)
    assert found["counters"] == scene.robot.uwb.counters()
    # the first frame only starts the clock
    (ranged,) = found["ranges"].items()
    assert ranged == ("10", {"robot": 10, "count": 4, "age_s": 0.5})


def test_a_module_of_nobody_known_and_one_that_is_not_ours_are_said() -> None:
    scene = RobotScene(robot=5)
    scene.range_to(77)
    for frame in ranging_stream(3, own_id=6):
        scene.robot.handle(SerialData(scene.utime, "uwb", frame))
    found = section(scene, "uwb")
    assert found["ranges"] == {"77": {"robot": None, "count": 1, "age_s": 0.0}}
    assert found["foreign_id"] == 6


def test_of_the_wheels_path_and_age_are_said() -> None:
    scene = RobotScene()
    for k in range(4):
        scene.later(0.02)
        packet = kobuki_packet(kobuki_core(1000 + 20 * k, 117 * k, 117 * k) + KOBUKI_REST)
        scene.robot.handle(SerialData(scene.utime, "wheels", packet))
    scene.later(1.0)
    found = section(scene, "wheels")
    assert found["age_s"] == 1.0
    assert found["path_m"] == round(3 * 117 / 11_724.4, 3)
    assert found["counters"] == scene.robot.wheels.counters()
    assert found["counters"]["gyro.slips"] == 0
    # (one that was there in some packets, and not yet of any use)
    assert found["gyro"] == {
        "in_use": False,
        "fault": None,
        "bias_deg_per_s": 0.0,
        "bias_sigma_deg_per_h": 60.0,
        "turns_of_wheels": 1.0,
        "slips_s": 0,
    }


def test_of_wheels_without_a_gyro_none_is_spoken_of() -> None:
    found = section(RobotScene(), "wheels")
    assert "gyro" not in found
    assert not any(name.startswith("gyro") for name in found["counters"])


# network, peers


def test_of_the_network_all_that_came_and_went_is_counted() -> None:
    scene = RobotScene(epochs={4: 7})
    scene.robot.handle(NetworkState(scene.utime, True, "239.255.76.67"))
    scene.hear(4, a_status(), epoch=6)
    scene.hear(5, a_status())
    entry = GraphEntry(0, keyframes=(Keyframe(1, 0, 0, 0, 0),))
    scene.hear(5, entry)
    scene.hear(5, entry)
    scene.hear(0, a_status())
    scene.tick()
    found = section(scene, "network")
    assert (found["up"], found["detail"]) == (True, "239.255.76.67")
    assert found["accepted"] == 2
    assert found["log_entries_heard_again"] == 1
    assert found["log_entries_repeated"] == 0
    assert found["refused"] == {
        "from before a restart of its origin": 1,
        "another robot uses this id": 1,
    }
    assert (found["messages_sent"], found["held_back"]) == (1, {})
    assert found["bytes_sent"] > 100


def test_our_own_echo_is_counted_and_says_when_the_network_last_carried_us() -> None:
    scene = RobotScene()
    assert section(scene, "network")["own_echo_age_s"] is None
    heartbeat, *_ = sends(scene.tick(), "STATUS")
    scene.robot.handle(ChannelMessage(scene.utime, heartbeat.channel, heartbeat.payload))
    scene.later(2)
    found = section(scene, "network")
    assert (found["own_echoes"], found["own_echo_age_s"]) == (1, 2.0)


def test_of_a_peer_its_clock_its_state_and_what_lacks_of_its_log_are_said() -> None:
    scene = RobotScene()
    heard = (Heard(0, 1, 4_000),)
    logs = (LogState(4, 1, 0, 3, 3),)
    scene.hear(4, GraphEntry(0, keyframes=(Keyframe(1, 0, 0, 0, 0),)))
    scene.hear(4, a_status(heard, logs, uwb_id=44))
    scene.later(1)
    assert section(scene, "peers") == {
        "4": {
            "epoch": 1,
            "alive": True,
            "hears_us": True,
            "age_s": 1.0,
            "received": 1,
            "loss": 0.0,
            "clock_offset_ms": 2.0,
            # 2 ms of delay, 3.2 ms of drift over 16 s, 0.1 ms in the second since it said so
            "clock_uncertainty_ms": 5.3,
            "clock_source": "messages",
            "uwb_id": 44,
            "pose": "not localised",
            "localised": False,
            "frame": None,
            "same_graph": False,
            "log_entries_lacking": 2,
        }
    }


def test_a_peer_that_is_localised_is_said_in_whose_frame_and_whether_it_holds_the_same() -> None:
    scene = RobotScene()
    digest = scene.robot.back.digest()
    status = a_status((Heard(0, 1, 0),), uwb_id=4)
    for same in (True, False):
        told = replace(status, state=PoseState.LOCALISED, graph_hash=digest + (not same))
        scene.hear(4, told)
        found = section(scene, "peers")["4"]
        assert (found["localised"], found["frame"], found["same_graph"]) == (True, 3, same)


def test_a_peer_that_fell_silent_is_not_alive_and_of_its_clock_little_is_known() -> None:
    scene = RobotScene()
    scene.hear(4, a_status())
    scene.later(6)
    found = section(scene, "peers")["4"]
    assert (found["alive"], found["hears_us"]) == (False, False)
    assert (found["clock_source"], found["clock_uncertainty_ms"]) == ("one way", 100.0)


# pairs, graph


@pytest.mark.parametrize(("count", "is_connected"), [(4, False), (5, True)])
def test_of_a_pair_windows_and_closures_are_counted(count: int, is_connected: bool) -> None:
    scene, pair = RobotScene(), OwnedPair(AGREEMENT)
    pair.confirm()
    pair.answer(10)
    pair.see(MIRRORED, 1)
    pair.see(BESIDE, count, first=20)
    scene.robot.front.pairs[1] = pair.tracker
    assert section(scene, "pairs") == {
        "1": {
            "connected": is_connected,
            "windows": {"not enough motion": 1, "unique": 1 + count},
            "closures_seen": 1 + count,
            "closures_kept": count,
        }
    }


def test_of_the_graph_the_group_its_keyframes_and_what_was_learned_are_said() -> None:
    learned = SensorCalibration(
        scale=Learned(0.02, 0.01),
        bias={1: Learned(0.12345, 0.01)},
        turn=Learned(0.3, 0.02),
        antenna_x=Learned(0.12346, 0.02),
        antenna_y=Learned(-0.2, 0.02),
    )
    scene = RobotScene(robot=2, kept=learned)
    for peer, count in ((1, 2), (4, 3)):
        frames = tuple(Keyframe(10 * k, 0, k, 0, 0) for k in range(count))
        scene.hear(peer, GraphEntry(0, keyframes=frames))
    back = scene.robot.back
    back.looked_at = back.graph.view
    back.group = {Segment(4, 1, 0), Segment(1, 1, 0), Segment(1, 1, 2)}
    back.estimate = TeamEstimate(
        Segment(1, 1, 0), {}, iterations=7, converged=False, near_bias_m=Learned(-0.03456, 0.02)
    )
    assert section(scene, "graph") == {
        "group": [1, 4],
        "keyframes": {"1": 2, "4": 3},
        "modules": {},
        "frame": 1,
        "iterations": 7,
        "converged": False,
        "range_bias_m": {"1-2": 0.1235},
        "near_range_bias_m": -0.0346,
        "wheel_scale": {"2": 0.02},
        "wheel_turn": {"2": 0.3},
        "antenna_m": {"2": [0.1235, -0.2]},
    }
