"""What a robot adds to the pose graph: keyframes, ranges and closures, in entries of its log."""

from __future__ import annotations

from dataclasses import dataclass

from drslamd.conventions import Chain
from drslamd.slam.robot_model import RobotModel


@dataclass(frozen=True)
class Keyframe:
    """Sample n of the odometry, whole steps."""

    n: int
    segment: int
    x: int
    y: int
    theta: int


@dataclass(frozen=True)
class RangeMeasurement:
    """One distance between two keyframes; q is the antenna in their body frames, metres."""

    a_n: int
    peer: Chain
    b_n: int
    q_a: tuple[float, float]
    q_b: tuple[float, float]
    range_m: float
    sigma_m: float


@dataclass(frozen=True)
class ClosureMeasurement:
    """One relative pose a_T_b between two keyframes, kept or withdrawn."""

    number: int
    kept: bool
    a_n: int
    peer: Chain
    b_n: int
    a_T_b: tuple[float, float, float]
    covariance: tuple[float, ...]
    """xx xy xt yy yt tt."""


@dataclass(frozen=True)
class GraphEntry:
    """One message of a robot's log."""

    seq: int
    model: RobotModel | None = None
    """Of the robot's own sensors, now and then."""
    keyframes: tuple[Keyframe, ...] = ()
    ranges: tuple[RangeMeasurement, ...] = ()
    closures: tuple[ClosureMeasurement, ...] = ()
