"""What pymavlink reads at a UDP port."""

from __future__ import annotations

import math
import socket
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from near_scenes import NEAR

from drslamd.gossip.message_types import PoseState

common = pytest.importorskip("pymavlink.dialects.v20.common", reason="pymavlink is not installed")

from drslamd.feed.mavlink import Mavlink  # noqa: E402


@pytest.fixture
def port() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind(("127.0.0.1", 0))
        udp.settimeout(5)
        yield udp


def heard(port: socket.socket, near: Any = NEAR, in_odom: bool = False) -> Any:
    feed = Mavlink(3, port.getsockname(), in_odom)
    feed.tell(near)
    feed.close()
    return common.MAVLink(None).parse_buffer(port.recv(1024))[0]


def test_the_pose_of_the_team_comes_with_y_and_yaw_to_the_right(port: socket.socket) -> None:
    message = heard(port)
    x, y, theta = NEAR.pose
    assert message.get_type() == "ODOMETRY"
    assert (message.frame_id, message.child_frame_id) == (20, 12)
    assert (message.x, message.y, message.z) == pytest.approx((x, -y, 0.0))
    assert message.q == pytest.approx([math.cos(theta / 2), 0, 0, -math.sin(theta / 2)])
    assert (message.vx, message.yawspeed) == pytest.approx((0.5, -0.125))
    assert message.time_usec == 1_700_000_005_000_000
    assert message.reset_counter == 259 % 256
    known = message.pose_covariance
    places = {0: 0.0625, 1: -0.015625, 6: 0.125, 20: 0.03125}
    assert known == pytest.approx([places.get(k, 0.0) for k in range(21)])
    assert math.isnan(message.velocity_covariance[0])
    assert message.quality == 100


def test_a_doubtful_pose_is_of_little_quality(port: socket.socket) -> None:
    assert heard(port, replace(NEAR, state=PoseState.DOUBTFUL)).quality == 1


def test_dead_reckoning_never_resets(port: socket.socket) -> None:
    message = heard(port, in_odom=True)
    assert (message.x, message.y) == (1.0, -2.0)
    assert message.reset_counter == 0
    assert math.isnan(message.pose_covariance[0])


def test_who_is_not_localised_says_nothing() -> None:
    feed = Mavlink(3, ("127.0.0.1", 9))
    assert feed.packed(replace(NEAR, state=PoseState.NOT_LOCALISED)) == []
    feed.close()
