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
    """Counters of both sides, as read: they go around after `values`, and may restart at zero.

    Attributes:
        unused: of the numbers that so many bits can say, those that never come.
    """

    utime: int
    left: int
    right: int
    bits: int
    unused: int = 0

    @property
    def values(self) -> int:
        return (1 << self.bits) - self.unused


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


WheelReading = Union[WheelCounts, WheelTurns, WheelSpeeds, Twist]


@dataclass(frozen=True)
class GyroAngle:
    """How far a gyro has turned, rad to the left; it may wrap at half a turn."""

    utime: int
    angle_rad: float


@dataclass(frozen=True)
class GyroRate:
    """How fast a gyro turns, rad/s to the left."""

    utime: int
    radps: float


WheelSample = Union[WheelReading, GyroAngle, GyroRate]
"""What a base says; gyros come with it."""


@dataclass(frozen=True)
class GyroSigmas:
    """How wrong the turns of a gyro are: random yaw, rad per square root of a second, and the
    constant yaw rate, rad/s."""

    yaw_rad_per_sqrt_s: float
    yaw_rad_per_s: float


@dataclass(frozen=True)
class Motion:
    """What the body did since the previous `Motion`: distance forward (m), turn to the left (rad).

    `gap` says that the link to the previous one is lost (a counter was reset, too long a silence):
    distance and turn are then unknown and given as zero.

    `gyro` says how wrong the turn is where a gyro gave it. `gyro_wrong_since` is the time since
    when one did and was wrong; this turn makes that good.
    """

    utime: int
    distance_m: float
    turn_rad: float
    gap: bool = False
    gyro: GyroSigmas | None = None
    gyro_wrong_since: int | None = None
