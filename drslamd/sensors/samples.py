"""What the sensors say, whoever made them.

Every sample carries `utime`, the time of the measurement on the robot's own clock.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union


@dataclass(frozen=True)
class RangeSample:
    """One distance that this robot's own module measured."""

    utime: int
    peer_uwb_id: int
    range_m: float
    power_gap_db: float
    """Received power minus first-path power; below 6 dB likely line of sight, above 10 dB likely
    not (LinkTrack user manual 7.2)."""


@dataclass(frozen=True)
class WheelCounts:
    """Counters of both sides, as read: they wrap at 2 ** bits and may restart at zero."""

    utime: int
    left: int
    right: int
    bits: int


@dataclass(frozen=True)
class WheelTurns:
    """Turns of both wheels since power-up, as floating point: they do not wrap."""

    utime: int
    left: float
    right: float


@dataclass(frozen=True)
class WheelSpeeds:
    """Ground speed of both sides, m/s; must be integrated."""

    utime: int
    left_mps: float
    right_mps: float


@dataclass(frozen=True)
class Twist:
    """Speed of the body: m/s forward, rad/s to the left; must be integrated."""

    utime: int
    linear_mps: float
    angular_radps: float


WheelSample = Union[WheelCounts, WheelTurns, WheelSpeeds, Twist]


@dataclass(frozen=True)
class Motion:
    """What the body did since the previous `Motion`: distance forward (m), turn to the left (rad).

    `gap` says that the link to the previous one is lost (a counter was reset, too long a silence):
    distance and turn are then unknown and given as zero.
    """

    utime: int
    distance_m: float
    turn_rad: float
    gap: bool = False
