"""The bound of every number in a message, and why it has it.

A reader refuses what lies beyond, and whoever speaks leaves unsaid what a reader would refuse: so
no number that comes in can leave its type in what is made of it. Epochs have a page of their own
(`epochs`), times and samples end with the 32 bits of the 10 Hz grid (`conventions.LAST_N`). What is
within its bound may still be a lie; whose lie costs whom what is on the page of this folder.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Union

import numpy as np

from drslamd.conventions import (
    LAST_N,
    LAST_UTIME,
    MAX_ROBOT_ID,
    ROTATION_STEP_RAD,
)
from drslamd.gossip.epochs import FIRST_EPOCH, MAX_EPOCH
from drslamd.gossip.message_types import (
    UNKNOWN_CLOCK,
    Hypotheses,
    OdometryBatch,
    Pose,
    PoseState,
)
from drslamd.slam import se2
from drslamd.slam.graph.measurements import ClosureMeasurement, Keyframe, RangeMeasurement
from drslamd.slam.graph.pair_data import BEST_SIGMA, FARTHEST_M, WORST_SIGMA
from drslamd.slam.graph.public_poses import PublicPoses

LONGEST_STEP = 2**15 - 1
"""Between two samples: 3.2 m or 3.2 rad in a tenth of a second."""
LAST_STEP = 2**31 - 1
"""214 km or 34,000 turns from where a chain began, its 32 bits."""
SPENT_STEP = LAST_STEP - 2**20
"""A robot that came so near to it, 100 m or 16 turns, needs another start."""
LAST_SEGMENT = 2**15 - 1
"""Breaks in the odometry of one start, its 16 bits; then it needs another."""
LAST_SEQ = 2**31 - 2
"""Of an entry: one past it still fits 32 bits. At one a second it takes 68 years."""
MAX_TRAIT = 10.0
LEAST_SIGMA = 2.0**-30
"""Of a robot's odometry; much less would be no positive number in 32 bits."""
MAX_UWB_ID = 2**32 - 1
MAX_RANK = 20
"""Of the relaxation, as the configuration allows."""
MAX_UWB_CLOCK_US = 2 * LAST_UTIME
"""A robot's clock minus LinkTrack's system_time, which wraps after 49.7 days."""
LAST_ROUND = 2**62 - 1
"""A robot's moves with `rbcd`; no lie brings an honest one there (`pose_exchange.LEAP`)."""
MAX_PLACE_M = 1e6
"""From the origin of the team's frame: beyond two tracks end to end."""
MAX_VARIANCE = 1e12
"""Of a pose, m^2 and rad^2: the square of `MAX_PLACE_M`."""
LONGEST_LEVER_M = 32.767
"""Millimetres of 16 bits; also of the sigma of a range."""
MAX_ANGLE = math.pi + ROTATION_STEP_RAD
"""Angles of poses are wrapped; one step for the rounding."""
ROOM_M = 1e-3
"""What is said stays so far within its bound, and is still there when it is rounded."""
ROOM_RAD = ROTATION_STEP_RAD / 2
VARIANCES = (0, 3, 5)
"""Their places among xx xy xt yy yt tt."""


def bounded(what: str, value: int, least: int, most: int) -> int:
    """The value.

    Raises:
        ValueError: it lies outside.
    """
    if not least <= value <= most:
        raise ValueError(f"{what}: {value}, allowed are {least} to {most}")
    return value


def robot(value: int) -> int:
    """An id; errors as of `bounded`, here and below."""
    return bounded("robot id", value, 0, MAX_ROBOT_ID)


def flag(value: int) -> int:
    return bounded("flag", value, 0, 1)


def pose_state(value: int) -> PoseState:
    return PoseState(bounded("state", value, min(PoseState), max(PoseState)))


def epoch(value: int) -> int:
    return bounded("epoch", value, FIRST_EPOCH, MAX_EPOCH)


def sample(value: int) -> int:
    """A number on the 10 Hz grid."""
    return bounded("sample", value, 0, LAST_N)


def uwb_clock(value: int) -> int:
    if value == UNKNOWN_CLOCK:
        return value
    return bounded("clock", value, -MAX_UWB_CLOCK_US, MAX_UWB_CLOCK_US)


def is_range(metres: float, room: float = 0.0) -> bool:
    return abs(metres) < FARTHEST_M - room


def is_closure(
    a_T_b: Sequence[float], covariance: Sequence[float], room_m: float = 0.0, room_rad: float = 0.0
) -> bool:
    """Is it a relative pose, with a covariance that is one in 32 bits too?"""
    x, y, theta = a_T_b
    if not (is_range(x, room_m) and is_range(y, room_m) and abs(theta) < MAX_ANGLE - room_rad):
        return False
    if not all(abs(v) < WORST_SIGMA**2 for v in covariance):
        return False
    said = tuple(float(np.float32(v)) for v in covariance)
    if not all(BEST_SIGMA**2 < said[k] < WORST_SIGMA**2 for k in VARIANCES):
        return False
    return bool(np.linalg.eigvalsh(se2.unpacked(said))[0] > 0)


def is_pose(pose: Sequence[float], covariance: Sequence[float]) -> bool:
    """Is it a place that a team can reach, and a finite covariance?"""
    x, y, theta = pose
    return (
        abs(x) <= MAX_PLACE_M
        and abs(y) <= MAX_PLACE_M
        and abs(theta) < MAX_ANGLE
        and all(abs(v) <= MAX_VARIANCE for v in covariance)
        and all(covariance[k] >= 0 for k in VARIANCES)
    )


Measurement = Union[Keyframe, RangeMeasurement, ClosureMeasurement]
"""What a log entry is made of."""


def is_sayable(item: Measurement | OdometryBatch | Pose | PublicPoses | Hypotheses) -> bool:
    """Would a reader take it? What a sensor or a solver makes up may be beyond all bounds."""
    if isinstance(item, Keyframe):
        places = (item.x, item.y, item.theta)
        near = all(abs(v) <= SPENT_STEP for v in places)
        return near and item.segment <= LAST_SEGMENT and item.n <= LAST_N
    if isinstance(item, RangeMeasurement):
        levers = max(abs(v) for v in (*item.q_a, *item.q_b))
        fits = levers < LONGEST_LEVER_M and 0 < item.sigma_m < LONGEST_LEVER_M
        return fits and is_range(item.range_m, ROOM_M)
    if isinstance(item, ClosureMeasurement):
        return is_closure(item.a_T_b, item.covariance, ROOM_M, ROOM_RAD)
    if isinstance(item, OdometryBatch):
        last = item.n0 + len(item.steps) - 1
        return bool((np.abs(item.steps) <= SPENT_STEP).all()) and last <= LAST_N
    if isinstance(item, Pose):
        return is_pose(item.pose, item.covariance)
    if isinstance(item, Hypotheses):
        known = [is_pose(place.pose, place.covariance) for place in item.places]
        return all(known) and all(abs(v) <= MAX_PLACE_M for v in item.odom)
    parts = np.ascontiguousarray(item.values).view(float)
    return bool((np.abs(parts) <= MAX_PLACE_M).all())
