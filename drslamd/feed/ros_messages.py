"""What is told as messages of ROS 2, whoever carries them; frames follow REP 105.

``team_of_F`` -> ``robot_N/odom`` moves when a solution corrects it, ``robot_N/odom`` ->
``robot_N/base_link`` never jumps. A peer M is ``robot_N/sees/robot_M``, a child of our base.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from drslamd.export.ros2 import nouns
from drslamd.export.ros2.nouns import Message
from drslamd.feed.stream import unix_us
from drslamd.gossip.message_types import PoseState
from drslamd.near.near_message import Near
from drslamd.slam.se2 import Array

Topic = tuple[str, str, Message]
"""Name, type, message."""
POSE = "geometry_msgs/PoseWithCovarianceStamped"


def ros_messages(robot: int, near: Near) -> Iterator[Topic]:
    """Of one message of the daemon of a robot."""
    odom, base, stamp = f"robot_{robot}/odom", f"robot_{robot}/base_link", unix_us(near, near.utime)
    o_T_a = np.array(near.odom)
    frames = [nouns.transform(stamp, odom, base, o_T_a)]
    is_known = near.state != PoseState.NOT_LOCALISED
    if is_known:
        team = f"team_of_{near.frame}"
        frames.insert(0, nouns.transform(stamp, team, odom, np.array(near.correction)))
    peers = near.peers
    for peer, a_T_b in zip(peers.robots, peers.a_T_b, strict=True):
        frames.append(nouns.transform(stamp, base, f"robot_{robot}/sees/robot_{peer}", a_T_b))
    yield "/tf", "tf2_msgs/TFMessage", {"transforms": frames}
    speeds = near.speed_mps, near.turn_radps
    odometry = nouns.odometry(stamp, odom, base, o_T_a, *speeds)
    yield f"/robot_{robot}/odometry", "nav_msgs/Odometry", odometry
    if is_known:
        head = nouns.header(stamp, team)
        yield f"/robot_{robot}/pose", POSE, _pose(head, near.pose, near.covariance)
    for k, peer in enumerate(peers.robots):
        head = nouns.header(stamp, base)
        known = peers.covariance[:, k].tolist()
        yield f"/robot_{robot}/sees/robot_{peer}", POSE, _pose(head, peers.a_T_b[k], known)


def _pose(head: Message, pose: Array, known: Sequence[float]) -> Message:
    body = {"pose": nouns.pose(pose), "covariance": nouns.covariance(known)}
    return {"header": head, "pose": body}
