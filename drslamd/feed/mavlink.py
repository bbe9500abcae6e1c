"""ODOMETRY of MAVLink, over UDP, for ArduPilot and PX4.

MAVLink wants x forward, y to the right, z down: frame LOCAL_FRD, body BODY_FRD. The vehicle stands
on flat ground, so height, roll and pitch are zero and certain. `reset_counter` counts the jumps of
the pose, modulo 256; smaller corrections are within what the covariance says and need no reset.
"""

from __future__ import annotations

import math
import socket
from collections.abc import Sequence
from typing import Any

from drslamd.feed.stream import unix_us
from drslamd.gossip.message_types import PoseState
from drslamd.near.near_message import Near

COMPONENT = 197
"""MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY: who sends such messages to an autopilot."""
LOCAL_FRD, BODY_FRD = 20, 12
"""MAV_FRAME."""
QUALITY = {
    PoseState.LOCALISED: 100,
    PoseState.DOUBTFUL: 1,
    PoseState.STALE: 1,
    PoseState.POSITION: 1,
}
"""Percent; ArduPilot's VISO_QUAL_MIN says what it takes."""


class Mavlink:
    """Tells one robot's pose to one autopilot."""

    def __init__(self, robot: int, to: tuple[str, int], in_odom: bool = False) -> None:
        """
        Args:
            in_odom: the pose of dead reckoning, which never jumps, and not that of the team.
        """
        from pymavlink.dialects.v20 import common

        self._in_odom = in_odom
        self._mavlink: Any = common.MAVLink(None, srcSystem=robot + 1, srcComponent=COMPONENT)
        family, kind, _, _, where = socket.getaddrinfo(*to, type=socket.SOCK_DGRAM)[0]
        self._to: Any = where
        self._socket = socket.socket(family, kind)

    def tell(self, near: Near) -> None:
        """Send it, where there is a pose."""
        for packed in self.packed(near):
            try:
                self._socket.sendto(packed, self._to)
            except OSError:
                continue  # nobody there yet; the next one comes in a moment

    def packed(self, near: Near) -> list[bytes]:
        """One MAVLink 2 message, none where there is no pose."""
        if self._in_odom:
            x, y, theta = near.odom
            known: Sequence[float] = [math.nan] * 6
            resets, quality = 0, 0
        elif near.state == PoseState.NOT_LOCALISED:
            return []
        else:
            x, y, theta = near.pose.tolist()
            known, resets, quality = near.covariance, near.resets, QUALITY[near.state]
        message = self._mavlink.odometry_encode(
            time_usec=max(0, unix_us(near, near.utime)),
            frame_id=LOCAL_FRD,
            child_frame_id=BODY_FRD,
            x=x,
            y=-y,
            z=0.0,
            q=[math.cos(theta / 2), 0.0, 0.0, -math.sin(theta / 2)],
            vx=near.speed_mps,
            vy=0.0,
            vz=0.0,
            rollspeed=0.0,
            pitchspeed=0.0,
            yawspeed=-near.turn_radps,
            pose_covariance=_frd(known),
            velocity_covariance=[math.nan] + [0.0] * 20,
            reset_counter=resets % 256,
            estimator_type=0,
            quality=quality,
        )
        return [bytes(message.pack(self._mavlink))]

    def close(self) -> None:
        self._socket.close()


def _frd(known: Sequence[float]) -> list[float]:
    """21 numbers, the upper triangle of x, y, z, roll, pitch, yaw; the first is NaN if unknown."""
    xx, xy, xt, yy, yt, tt = known
    out = [0.0] * 21
    out[0], out[1], out[5], out[6], out[10], out[20] = xx, -xy, -xt, yy, yt, tt
    return out
