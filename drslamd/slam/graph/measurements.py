"""What a robot adds to the pose graph: keyframes, ranges and closures, in entries of its log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

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
    """One distance between two keyframes.

    Attributes:
        q_a, q_b: the antennas in the body frames of the keyframes, m.
        turn_a, turn_b: how the robots stood turned against their keyframes, rad.
    """

    a_n: int
    peer: Chain
    b_n: int
    q_a: tuple[float, float]
    q_b: tuple[float, float]
    range_m: float
    sigma_m: float
    turn_a: float = 0.0
    turn_b: float = 0.0


@dataclass(frozen=True)
class ClosureMeasurement:
    """One relative pose a_T_b between two keyframes, kept or withdrawn.

    Attributes:
        covariance: xx xy xt yy yt tt.
        corrected: with which scale and turn of a and of b it was found, fractions; 0 as configured.
    """

    number: int
    kept: bool
    a_n: int
    peer: Chain
    b_n: int
    a_T_b: tuple[float, float, float]
    covariance: tuple[float, ...]
    corrected: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


Item = TypeVar("Item")
Placed = tuple[int, Item]
"""A measurement and its place in the log: which entry said it, and where in there."""


@dataclass(frozen=True)
class Chapter:
    """Part of what a robot says again of earlier entries (`chapters`).

    Attributes:
        parts: of the last part, in how many messages the chapter is said: they are the entries up
            to it; of another part 0.
        replaces: of the last part, the entries for which the chapter stands, as spans first ..
            end - 1 in order, none of which touches the next one; of another part none.
        models: of its sensors, with the entry that said so.
        ranges, closures: by their peer, then by their place.
    """

    parts: int
    replaces: tuple[tuple[int, int], ...] = ()
    models: tuple[tuple[int, RobotModel], ...] = ()
    keyframes: tuple[Keyframe, ...] = ()
    ranges: tuple[Placed[RangeMeasurement], ...] = ()
    closures: tuple[Placed[ClosureMeasurement], ...] = ()


@dataclass(frozen=True)
class GraphEntry:
    """One message of a robot's log."""

    seq: int
    model: RobotModel | None = None
    """Of the robot's own sensors, now and then."""
    keyframes: tuple[Keyframe, ...] = ()
    ranges: tuple[RangeMeasurement, ...] = ()
    closures: tuple[ClosureMeasurement, ...] = ()
    chapter: Chapter | None = None
    """Said again; such an entry says nothing else."""
