"""``team.mcap`` as the readers of others read it: mcap, its support for ROS 2, rosbags."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import team_answers
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from drslamd.export.ros2.team_file import write
from drslamd.slam import se2

ROBOTS = ("0", "1", "2")


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    (found,) = write(tmp_path_factory.mktemp("mcap"), team_answers.answers())
    return found


@pytest.fixture(scope="module")
def said(path: Path) -> dict[str, list[Any]]:
    """Messages by topic, as mcap-ros2-support decodes them."""
    out = defaultdict(list)
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            stamp = decoded.transforms[0].header if channel.topic == "/tf" else decoded.header
            ns = stamp.stamp.sec * 1_000_000_000 + stamp.stamp.nanosec
            assert ns == message.log_time == message.publish_time
            out[channel.topic].append(decoded)
    return out


def planar(pose: Any) -> np.ndarray[Any, Any]:
    position = getattr(pose, "position", None) or pose.translation
    turn = getattr(pose, "orientation", None) or pose.rotation
    return np.array([position.x, position.y, 2 * np.arctan2(turn.z, turn.w)])


def test_it_is_of_the_ros_2_profile_and_says_how_wrong_its_stamps_are(path: Path) -> None:
    with path.open("rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == "ros2"
        assert {c.message_encoding for c in reader.get_summary().channels.values()} == {"cdr"}  # type: ignore[union-attr]
        ((_, about),) = ((m.name, m.metadata) for m in reader.iter_metadata())
    assert about["frame"] == "team_of_0"
    assert about["stamps_of_robot_1"] == "robot 1: UNIX time, +-0.002 s"
    assert about["stamps_of_robot_0"].startswith("robot 0: UNIX time, +-0.00")


def test_there_is_a_topic_of_each_kind_for_each_robot(said: dict[str, list[Any]]) -> None:
    graph = team_answers.answers()["graph"]
    kinds = {f"/robot_{r}/{kind}" for r in ROBOTS for kind in ("odometry", "pose", "path")}
    assert set(said) == kinds | {"/tf", "/diagnostics"}
    keyframes = graph["keyframes"]["rows"]
    assert len(said["/tf"]) == len(keyframes)
    for robot in ROBOTS:
        assert len(said[f"/robot_{robot}/pose"]) == len(graph["poses"][robot]["rows"])
        assert len(said[f"/robot_{robot}/odometry"]) == sum(str(k[1]) == robot for k in keyframes)


def test_two_transforms_lead_from_the_team_to_a_robot(said: dict[str, list[Any]]) -> None:
    """Their product is where the keyframe was solved to be."""
    keyframes = {(k[1], k[2]): k[3:6] for k in team_answers.answers()["graph"]["keyframes"]["rows"]}
    found = defaultdict(list)
    for message in said["/tf"]:
        w_T_o, o_T_k = message.transforms
        robot = w_T_o.child_frame_id.partition("/")[0]
        assert w_T_o.header.frame_id == "team_of_0"
        assert (w_T_o.child_frame_id, o_T_k.header.frame_id) == (f"{robot}/odom",) * 2
        assert o_T_k.child_frame_id == f"{robot}/base_link"
        found[int(robot[6:])].append(se2.compose(planar(w_T_o.transform), planar(o_T_k.transform)))
    for robot, poses in found.items():
        solved = np.array([pose for (of, _), pose in keyframes.items() if of == robot])
        assert np.array(poses)[:, :2] == pytest.approx(solved[:, :2], abs=1e-5)


def test_odometry_says_how_fast_a_robot_was(said: dict[str, list[Any]]) -> None:
    messages = said["/robot_1/odometry"]
    speeds = [message.twist.twist.linear.x for message in messages]
    assert speeds[0] == 0
    assert 0.2 < np.median(speeds) < 0.55
    steps = [
        np.hypot(*(planar(b.pose.pose) - planar(a.pose.pose))[:2])
        for a, b in itertools.pairwise(messages)
    ]
    assert sum(steps) == pytest.approx(0.9 * sum(speeds), rel=0.25)


def test_published_poses_have_their_covariance(said: dict[str, list[Any]]) -> None:
    rows = team_answers.answers()["graph"]["poses"]["2"]["rows"]
    for message, row in zip(said["/robot_2/pose"], rows, strict=True):
        assert planar(message.pose.pose)[:2] == pytest.approx(row[3:5])
        square = np.reshape(message.pose.covariance, (6, 6))
        assert square[0, 0] == pytest.approx(row[6])
        assert square[0, 1] == square[1, 0] == pytest.approx(row[7])
        assert square[5, 5] == pytest.approx(row[11])
        assert message.header.frame_id == f"team_of_{row[2]}"


def test_a_path_is_that_of_the_trajectory(said: dict[str, list[Any]]) -> None:
    told = team_answers.answers()["trajectory"]["robots"]
    for robot in ROBOTS:
        (message,) = said[f"/robot_{robot}/path"]
        poses = np.array([planar(p.pose)[:2] for p in message.poses])
        assert poses == pytest.approx(np.array(told[robot]["poses"])[:, :2], abs=1e-6)


def test_rosbags_reads_the_same(path: Path, said: dict[str, list[Any]]) -> None:
    count: dict[str, int] = defaultdict(int)
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            message: Any = reader.deserialize(raw, connection.msgtype)
            other = said[connection.topic][count[connection.topic]]
            count[connection.topic] += 1
            if connection.topic.endswith("/odometry"):
                assert planar(message.pose.pose).tolist() == planar(other.pose.pose).tolist()
    assert count == {topic: len(messages) for topic, messages in said.items()}


def after_the_health(team: dict[str, Any]) -> Iterator[str]:
    yield from (f"/robot_{robot}/pose" for robot in team["graph"]["poses"])


def test_a_robot_in_no_group_has_its_health_and_what_it_published(tmp_path: Path) -> None:
    answers = team_answers.unlocalised()
    (path,) = write(tmp_path, answers)
    with AnyReader([path]) as reader:
        assert set(reader.topics) == {"/diagnostics", *after_the_health(answers)}


def test_a_robot_whose_clock_nobody_knows_is_left_out(tmp_path: Path) -> None:
    answers, unknown = team_answers.answers(), {"source": "unknown", "readings": []}
    answers["graph"]["clocks"]["0"] = answers["trajectory"]["robots"]["0"]["clock"] = unknown
    (path,) = write(tmp_path, answers)
    with AnyReader([path]) as reader:
        assert not [topic for topic in reader.topics if topic.startswith("/robot_0/")]
        assert "/robot_1/path" in reader.topics
