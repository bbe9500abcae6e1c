"""tf and odometry as readers without ROS see them."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest
from near_scenes import NEAR

pytest.importorskip("mcap", reason="mcap is not installed")

from drslamd.feed.ros2 import Dds, Mcap, dds_type


def test_rosbags_and_mcap_read_tf_and_odometry_of_the_file(tmp_path: Path) -> None:
    from mcap.reader import make_reader
    from rosbags.highlevel import AnyReader

    path = tmp_path / "run.mcap"
    feed = Mcap(3, path)
    feed.tell(NEAR)
    feed.close()
    with path.open("rb") as file:
        topics = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert {"/tf", "/robot_3/odometry", "/robot_3/sees/robot_1"} <= topics
    with AnyReader([path]) as bag:
        found: dict[str, Any] = {
            c.topic: bag.deserialize(raw, c.msgtype) for c, _, raw in bag.messages(bag.connections)
        }
    assert found["/tf"].transforms[0].transform.translation.x == 3.0
    assert found["/robot_3/odometry"].pose.pose.position.y == 2.0


def test_a_reader_of_dds_takes_tf() -> None:
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed")
    from cyclonedds.core import DDSException
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    try:
        participant = DomainParticipant(83)
    except DDSException:
        pytest.skip("DDS finds no network interface here")
    kind = dds_type("tf2_msgs/TFMessage")
    reader = DataReader(participant, Topic(participant, "rt/tf", kind))
    feed = Dds(3, 83)
    found: list[Any] = []
    end = time.monotonic() + 10
    while not found and time.monotonic() < end:
        feed.tell(NEAR)
        time.sleep(0.02)
        found = reader.take(1)
    feed.close()
    names = [frame.child_frame_id for frame in found[0].transforms]
    assert names[:2] == ["robot_3/odom", "robot_3/base_link"]
    assert found[0].transforms[0].transform.translation.x == 3.0
    assert kind.__idl_typename__ == "tf2_msgs::msg::dds_::TFMessage_"
