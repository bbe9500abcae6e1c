"""Planar poses, stamps and covariances as the messages of ROS 2 have them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from drslamd.export.answers import Array

Message = dict[str, Any]

PLANE = (0, 1, 5)
"""x, y and yaw among the six of a covariance: x, y, z, roll, pitch, yaw."""


def header(unix_us: int, frame: str) -> Message:
    seconds, us = divmod(unix_us, 1_000_000)
    return {"stamp": {"sec": seconds, "nanosec": 1_000 * us}, "frame_id": frame}


def point(x: float, y: float) -> Message:
    """Or a vector."""
    return {"x": x, "y": y, "z": 0.0}


def quaternion(theta: float) -> Message:
    return {"x": 0.0, "y": 0.0, "z": math.sin(theta / 2), "w": math.cos(theta / 2)}


def pose(planar: Sequence[float] | Array) -> Message:
    """Of x, y, theta."""
    x, y, theta = (float(value) for value in planar)
    return {"position": point(x, y), "orientation": quaternion(theta)}


def covariance(packed: Sequence[float] | None) -> list[float]:
    """36 numbers of xx xy xt yy yt tt; zeros, which say nothing, where none are known."""
    out = [0.0] * 36
    if packed is None:
        return out
    xx, xy, xt, yy, yt, tt = packed
    square = ((xx, xy, xt), (xy, yy, yt), (xt, yt, tt))
    for row, values in zip(PLANE, square, strict=True):
        for column, value in zip(PLANE, values, strict=True):
            out[6 * row + column] = float(value)
    return out


def transform(unix_us: int, frame: str, child: str, planar: Sequence[float] | Array) -> Message:
    """Where `child` is in `frame`."""
    x, y, theta = (float(value) for value in planar)
    return {
        "header": header(unix_us, frame),
        "child_frame_id": child,
        "transform": {"translation": point(x, y), "rotation": quaternion(theta)},
    }


def odometry(
    unix_us: int, frame: str, child: str, planar: Array, speed_mps: float, turn_radps: float
) -> Message:
    """A pose in the frame of the odometry, and how fast the robot was."""
    twist = {"linear": point(speed_mps, 0.0), "angular": {"x": 0.0, "y": 0.0, "z": turn_radps}}
    return {
        "header": header(unix_us, frame),
        "child_frame_id": child,
        "pose": {"pose": pose(planar), "covariance": covariance(None)},
        "twist": {"twist": twist, "covariance": covariance(None)},
    }
