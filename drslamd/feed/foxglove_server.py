"""A WebSocket to which Foxglove connects: frames and pose, drawn as they are, and all as JSON."""

from __future__ import annotations

import math
from typing import Any

from drslamd.feed.ros_messages import ros_messages
from drslamd.feed.stream import unix_us
from drslamd.near.near_message import Near


class FoxgloveServer:
    """Shows one robot to whoever connects.

    Attributes:
        port: where.
    """

    def __init__(self, robot: int, host: str, port: int) -> None:
        """
        Raises:
            OSError: the port cannot be had.
        """
        import foxglove
        from foxglove.channels import FrameTransformsChannel, PoseInFrameChannel

        self._robot, self._context = robot, foxglove.Context()
        try:
            self._server = foxglove.start_server(
                name=f"drslamd robot {robot}", host=host, port=port, context=self._context
            )
        except RuntimeError as error:
            raise OSError(str(error)) from None
        self.port: int = self._server.port
        context: Any = {"context": self._context}
        self._frames = FrameTransformsChannel("/tf", **context)
        self._pose = PoseInFrameChannel(f"/robot_{robot}/pose", **context)
        self._near = foxglove.Channel(
            f"/robot_{robot}/near", schema={"type": "object"}, message_encoding="json", **context
        )

    def tell(self, near: Near) -> None:
        """Log it on all channels."""
        from foxglove import messages

        stamp_us = unix_us(near, near.utime)
        log_time = 1_000 * stamp_us
        stamp = messages.Timestamp(stamp_us // 1_000_000, 1_000 * (stamp_us % 1_000_000))
        for topic, kind, message in ros_messages(self._robot, near):
            if kind == "tf2_msgs/TFMessage":
                frames = [_frame(stamp, each) for each in message["transforms"]]
                told = messages.FrameTransforms(transforms=frames)
                self._frames.log(told, log_time=log_time)
            elif topic == f"/robot_{self._robot}/pose":
                frame, pose = message["header"]["frame_id"], message["pose"]["pose"]
                body = messages.Pose(
                    position=messages.Vector3(**pose["position"]),
                    orientation=messages.Quaternion(**pose["orientation"]),
                )
                shown = messages.PoseInFrame(timestamp=stamp, frame_id=frame, pose=body)
                self._pose.log(shown, log_time=log_time)
        self._near.log(as_json(near), log_time=log_time)

    def close(self) -> None:
        self._server.stop()


def _frame(stamp: Any, message: Any) -> Any:
    from foxglove import messages

    moved = message["transform"]
    return messages.FrameTransform(
        timestamp=stamp,
        parent_frame_id=message["header"]["frame_id"],
        child_frame_id=message["child_frame_id"],
        translation=messages.Vector3(**moved["translation"]),
        rotation=messages.Quaternion(**moved["rotation"]),
    )


def as_json(near: Near) -> dict[str, Any]:
    """Everything, for plots: m, degrees, sigmas, seconds."""
    peers = near.peers
    x, y, theta = near.pose.tolist()
    return {
        "state": near.state.name.lower(),
        "pose": {"x_m": x, "y_m": y, "theta_deg": math.degrees(theta)},
        "sigma": _sigmas(near.covariance),
        "speed_mps": near.speed_mps,
        "turn_degps": math.degrees(near.turn_radps),
        "resets": near.resets,
        "peers": {
            str(robot): {
                "x_m": float(peers.a_T_b[k, 0]),
                "y_m": float(peers.a_T_b[k, 1]),
                "theta_deg": math.degrees(peers.a_T_b[k, 2]),
                "sigma": _sigmas(peers.covariance[:, k].tolist()),
                "age_s": (near.utime - peers.utimes[k]) / 1e6,
                "state": peers.states[k].name.lower(),
            }
            for k, robot in enumerate(peers.robots)
        },
    }


def _sigmas(known: Any) -> dict[str, float]:
    xx, _, _, yy, _, tt = known
    return {"x_m": xx**0.5, "y_m": yy**0.5, "theta_deg": math.degrees(tt**0.5)}
