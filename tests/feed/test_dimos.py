"""What dimos-lcm decodes."""

from __future__ import annotations

from typing import Any

import pytest
from near_scenes import NEAR

pytest.importorskip("dimos_lcm", reason="dimos-lcm is not installed")

from drslamd.feed import dimos
from drslamd.feed.ros_messages import ros_messages


def decoded(topic: str, kind: Any) -> Any:
    found = {name: (said, message) for name, said, message in ros_messages(3, NEAR)}
    return kind.lcm_decode(dimos.encoded(*found[topic]))


def test_frames_and_odometry_come_out_as_they_went_in() -> None:
    from dimos_lcm.nav_msgs import Odometry
    from dimos_lcm.tf2_msgs import TFMessage

    frames = decoded("/tf", TFMessage).transforms
    assert [f.child_frame_id for f in frames][:2] == ["robot_3/odom", "robot_3/base_link"]
    assert [f.transform.translation.x for f in frames] == [3.0, 1.0, 1.0, -3.0]
    assert frames[0].header.stamp.sec == 1_700_000_005
    odometry = decoded("/robot_3/odometry", Odometry)
    assert odometry.pose.pose.position.y == 2.0
    assert odometry.twist.twist.linear.x == 0.5


def test_peers_come_with_their_covariance() -> None:
    from dimos_lcm.geometry_msgs import PoseWithCovarianceStamped

    seen = decoded("/robot_3/sees/robot_1", PoseWithCovarianceStamped)
    assert next(iter(seen.pose.covariance)) == NEAR.peers.covariance[0, 0]


def test_channels_are_named_as_dimos_names_them(monkeypatch: pytest.MonkeyPatch) -> None:
    feed, said = dimos.Dimos(3, "memq://"), []

    class Spy:
        def publish(self, channel: str, payload: bytes) -> None:
            said.append(channel)

    monkeypatch.setattr(feed, "_lcm", Spy())
    feed.tell(NEAR)
    feed.close()
    assert said[:2] == ["/tf#tf2_msgs.TFMessage", "/robot_3/odometry#nav_msgs.Odometry"]
