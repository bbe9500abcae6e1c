"""What module 3 says: where everybody was, in the frame of the team."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from drslamd.conventions import Chain, Segment
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class Trajectory:
    """Solved keyframes of one chain: n (k,) ascending, w_T_k (k, 3)."""

    chain: Chain
    n: Array
    poses: Array


@dataclass(frozen=True)
class Lifted:
    """State of the relaxation on one robot.

    Attributes:
        n: (k,) its keyframes; rows: (k, 2 r) their lifted poses.
        anchor: (2 r,) the lifted pose that anchors the frame of the team; origin: (3,) where in
            that frame it is.
        carriers: (m,) keyframes that carry closures and are therefore public.
        weights: (m, 2) how stiffly closures hold rotation and position of these, 1 and 1/m^2.
        ends: how many closures were counted.
        quiet: how many moves were made on the very same keyframes and closures.
        gain: share of its cost that the last move brought, or would have.
    """

    n: Array
    rows: Array
    anchor: Array
    origin: Array
    carriers: Array
    weights: Array
    ends: int
    quiet: int
    gain: float


class Learned(NamedTuple):
    """A constant of a sensor, and the sigma of what was measured of it (infinite of nothing)."""

    value: float = 0.0
    sigma: float = float("inf")


class PoseNow(NamedTuple):
    """Where a robot is: utime on its clock, w_T_a (3,), covariance (3, 3) of x, y, theta."""

    utime: int
    pose: Array
    covariance: Array


@dataclass(frozen=True)
class TeamEstimate:
    """The last solution, in the frame of segment `frame`.

    Attributes:
        trajectories: by robot.
        covariances: (3, 3) of each robot's last pose.
        bias_m: range bias of each pair, m.
        scale, yaw: of each robot's odometry, fraction and rad/m.
        near_bias_m: of the team, at range 0 (`RangeModel.near_range_shape`).
        scatter: how many times the configured sigma the ranges of a pair scatter.
        lifted: state of the relaxation, with `rbcd`.
    """

    frame: Segment
    trajectories: dict[int, Trajectory]
    covariances: dict[int, Array] = field(default_factory=dict)
    bias_m: dict[tuple[int, int], Learned] = field(default_factory=dict)
    scale: dict[int, Learned] = field(default_factory=dict)
    yaw: dict[int, Learned] = field(default_factory=dict)
    near_bias_m: Learned = field(default_factory=Learned)
    scatter: dict[tuple[int, int], float] = field(default_factory=dict)
    cost: float = 0.0
    iterations: int = 0
    converged: bool = True
    lifted: Lifted | None = None
