"""Frames of REP 105, odometry, and peers with their covariance."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from near_scenes import NEAR

from drslamd.feed.ros_messages import ros_messages
from drslamd.gossip.message_types import PoseState
from drslamd.near.near_message import NOBODY, Near


def by_topic(near: Near) -> dict[str, Any]:
    return {topic: message for topic, _, message in ros_messages(3, near)}


def test_the_team_holds_odom_odom_holds_the_robot_and_the_robot_its_peers() -> None:
    frames = by_topic(NEAR)["/tf"]["transforms"]
    pairs = [(f["header"]["frame_id"], f["child_frame_id"]) for f in frames]
    assert pairs == [
        ("team_of_0", "robot_3/odom"),
        ("robot_3/odom", "robot_3/base_link"),
        ("robot_3/base_link", "robot_3/sees/robot_1"),
        ("robot_3/base_link", "robot_3/sees/robot_2"),
    ]
    moved = frames[1]["transform"]
    assert moved["translation"] == {"x": 1.0, "y": 2.0, "z": 0.0}
    assert moved["rotation"]["z"] == pytest.approx(math.sin(0.25))
    assert frames[0]["header"]["stamp"] == {"sec": 1_700_000_005, "nanosec": 0}


def test_odometry_has_the_speed_and_peers_have_their_covariance() -> None:
    found = by_topic(NEAR)
    assert found["/robot_3/odometry"]["twist"]["twist"]["linear"]["x"] == 0.5
    seen = found["/robot_3/sees/robot_2"]
    assert seen["header"]["frame_id"] == "robot_3/base_link"
    assert seen["pose"]["covariance"][7] == NEAR.peers.covariance[3, 1]
    assert found["/robot_3/pose"]["pose"]["covariance"][35] == NEAR.covariance[5]


def test_who_is_not_localised_has_odometry_alone() -> None:
    near = replace(NEAR, state=PoseState.NOT_LOCALISED, peers=NOBODY)
    found = by_topic(near)
    assert set(found) == {"/tf", "/robot_3/odometry"}
    assert len(found["/tf"]["transforms"]) == 1
