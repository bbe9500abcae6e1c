"""AgileX bases (Scout, Hunter, Bunker, Ranger, Tracer) on a CAN bus, protocol V2.

Source: ugv_sdk, agilex_protocol_v2. Ids of 11 bits, numbers big-endian. 0x311 holds the path of
the left and the right wheels in mm since power-up, as signed 32 bit, every 20 ms. It is preferred
to the speed of the body in 0x221, which loses distance with every lost frame: that one is used
only while 0x311 is missing. 0x211 holds the state of the base. Frames of other ids are normal.

What the models send, by their makers' sheets:

Scout, Bunker, Tracer    0x311; 0x221 with speed and yaw rate.
Hunter SE                0x311 of both rear wheels.
Hunter 2.0               no 0x311; in 0x221 no yaw rate but, in bytes 6 and 7, the angle of the
                         inner front wheel. With ``wheelbase_m`` that is a turn, without it nothing
                         is known of turns, and the base is refused as soon as it steers.
Ranger                   0x291 says how its four wheels are steered. Only in mode 0 do the two paths
                         of 0x311 mean a turn; sideways and on the spot they are refused.

LIMO                     beside 0x311 a gyro: 0x322 with rates about x, y and z in 0.01 deg/s, 0x323
                         with yaw, pitch and roll in 0.01 deg, as its driver reads them. The yaw
                         counts where it comes: the base makes it of all that its gyro says.

A base that moves sideways (0x221, bytes 4 and 5: mecanum wheels) is refused while it does.
"""

from __future__ import annotations

import math
import struct
from typing import Final, NamedTuple

from drslamd.conventions import SECOND_US
from drslamd.events import CanFrame
from drslamd.sensors.samples import GyroAngle, GyroRate, Twist, WheelCounts, WheelSample
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.wheel_driver import CanDriver, Outcome, WheelRefusal, tallied

COUNTS_PER_METRE: Final = 1000.0
COUNTER_BITS: Final = 32

ODOMETRY_MISSING_US: Final = SECOND_US // 2
"""25 frames of 0x311 in a row."""

SIDEWAYS_MPS: Final = 0.05
"""Slower is what the sensors of a base take for motion while it stands."""
SIDEWAYS_US: Final = SECOND_US // 2
"""How long after the last such frame a base is taken to move sideways."""
STEERS: Final = 0.004
"""m/s times rad: from here on even a base of two metres would send a yaw rate of 0.002 rad/s."""
MAX_STEERING_RAD: Final = 1.4
_ALONG: Final = 0
"""The motion mode in which a base turns by its two sides."""

_SYSTEM_STATE: Final = 0x211
_MOTION: Final = 0x221
_MOTION_MODE: Final = 0x291
_ODOMETRY: Final = 0x311
_RATES: Final = 0x322
_ANGLES: Final = 0x323
_ONLY_IN_V1: Final = 0x151

_STATE_AND_ERRORS: Final = struct.Struct(">B3xH")  # between them: control mode, battery
_SPEEDS: Final = struct.Struct(">hh")  # 0.001 m/s, 0.001 rad/s
_BESIDES: Final = struct.Struct(">4xhh")  # sideways 0.001 m/s, steering 0.001 rad
_PATHS: Final = struct.Struct(">ii")
_AXES: Final = struct.Struct(">3h")
ANGLES_MISSING_US: Final = SECOND_US
"""Rates count when angles have not come for so long."""

_STATES: Final = {1: "an emergency stop", 2: "a fault"}


class Steering(NamedTuple):
    """A base with steered front wheels: its wheelbase, and the distance between two wheels, m."""

    wheelbase_m: float
    track_m: float

    def yaw_rate(self, speed_mps: float, inner_rad: float) -> float:
        """Of the middle of the rear axle; the wheel inside the turn stands at `inner_rad`."""
        tangent = math.tan(inner_rad)
        return speed_mps * tangent / (self.wheelbase_m + abs(tangent) * self.track_m / 2)


class AgilexDriver(CanDriver):
    """`WheelCounts` in mm, or `Twist` while the base sends no odometry.

    Args:
        steering: of a base that says how it steers and not how it turns.

    Attributes:
        vehicle_state: 0 in order, 1 emergency stop, 2 fault.
        error_bits: of the last state frame; their meaning depends on the model.
    """

    expects: str = "AgileX CAN id 0x311 (or 0x221)"

    def __init__(self, steering: Steering | None = None) -> None:
        self._steering = steering
        self._steers = False
        self._mode: int | None = None
        self._is_changing = False
        self._sideways_utime: int | None = None
        self._state_utime: int | None = None
        self._odometry_utime: int | None = None
        self._angle_utime: int | None = None
        self.vehicle_state = 0
        self.error_bits = 0
        self.tally: Tally[WheelRefusal] = Tally()

    def on_frame(self, frame: CanFrame) -> list[WheelSample]:
        if self._odometry_utime is None:  # 0x311 gets its time to appear before 0x221 is used
            self._odometry_utime = frame.utime
        return tallied(self.tally, self._decode(frame, self._odometry_utime))

    def fault(self) -> str | None:
        if self.tally.refused[WheelRefusal.OLD_PROTOCOL] and not self.tally.accepted:
            return (
                "the base speaks AgileX protocol V1 (CAN id 0x151), which is not supported: "
                "update its firmware to protocol V2"
            )
        if self.vehicle_state in _STATES:
            return (
                f"the base reports {_STATES[self.vehicle_state]} (error bits "
                f"0x{self.error_bits:04X}): release the stop, or look the bits up in its manual"
            )
        return self._undrivable()

    def why_no_sample(self, utime: int) -> str | None:
        if self._state_utime is None or utime - self._state_utime > SECOND_US:
            return None
        return (
            "the base sends its state (0x211) but neither 0x311 nor 0x221: update its firmware, or "
            "ask its maker how it is made to send odometry"
        )

    def _undrivable(self) -> str | None:
        """Why what it does cannot be integrated."""
        if self._mode not in (None, _ALONG) or self._is_changing:
            return (
                f"the base drives in motion mode {self._mode} (0x291), in which the paths of its "
                "wheels are no odometry: drive it in mode 0"
            )
        if self._sideways_utime is not None:
            return (
                "the base moves sideways, which cannot be integrated: drive it like one with two "
                "wheels"
            )
        if self._steers and self._mode is not None:
            return (
                "the base steers four wheels and sends no 0x311: its turns cannot be integrated; "
                "update its firmware"
            )
        if self._steers and self._steering is None:
            return (
                "the base says how it steers and not how it turns (a Hunter 2.0?): set "
                "wheels.wheelbase_m, the distance between its axles"
            )
        return None

    def _decode(self, frame: CanFrame, odometry_utime: int) -> Outcome:
        if frame.extended:
            return None
        if frame.can_id == _ODOMETRY:
            return self._on_odometry(frame)
        if frame.can_id == _MOTION:
            return self._on_motion(frame, frame.utime - odometry_utime > ODOMETRY_MISSING_US)
        if frame.can_id == _MOTION_MODE:
            return self._on_mode(frame)
        if frame.can_id in (_RATES, _ANGLES):
            return self._on_gyro(frame)
        if frame.can_id == _SYSTEM_STATE:
            self._state_utime = frame.utime
            return self._on_state(frame.data)
        return WheelRefusal.OLD_PROTOCOL if frame.can_id == _ONLY_IN_V1 else None

    def _on_odometry(self, frame: CanFrame) -> Outcome:
        if len(frame.data) < _PATHS.size:
            return WheelRefusal.SHORT
        left, right = _PATHS.unpack_from(frame.data)
        self._odometry_utime = frame.utime
        self._steers = False  # its sides say how it turns
        if self._undrivable():
            return WheelRefusal.NO_ODOMETRY
        return [WheelCounts(frame.utime, left, right, COUNTER_BITS)]

    def _on_gyro(self, frame: CanFrame) -> Outcome:
        if len(frame.data) < _AXES.size:
            return WheelRefusal.SHORT
        first, _, last = _AXES.unpack_from(frame.data)
        if frame.can_id == _ANGLES:
            self._angle_utime = frame.utime
            return [GyroAngle(frame.utime, math.radians(first / 100))]
        said = self._angle_utime
        is_needed = said is None or frame.utime - said > ANGLES_MISSING_US
        return [GyroRate(frame.utime, math.radians(last / 100))] if is_needed else None

    def _on_state(self, data: bytes) -> Outcome:
        if len(data) < _STATE_AND_ERRORS.size:
            return WheelRefusal.SHORT
        self.vehicle_state, self.error_bits = _STATE_AND_ERRORS.unpack_from(data)
        return None

    def _on_mode(self, frame: CanFrame) -> Outcome:
        if not frame.data:
            return WheelRefusal.SHORT
        could = self._undrivable() is None
        self._mode, self._is_changing = frame.data[0], any(frame.data[1:2])
        return self._break(could, frame.utime)

    def _break(self, could: bool, utime: int) -> Outcome:
        """What the wheels do from here on is not linked to what they did before."""
        if not could or self._undrivable() is None:
            return None
        # counters would bridge it; after a sample of another kind they begin anew
        return [Twist(utime, 0.0, 0.0)]

    def _on_motion(self, frame: CanFrame, is_needed: bool) -> Outcome:
        if len(frame.data) < _SPEEDS.size:
            return WheelRefusal.SHORT if is_needed else None
        linear, angular = (value / 1000 for value in _SPEEDS.unpack_from(frame.data))
        sideways = steering = 0.0
        if len(frame.data) >= _BESIDES.size:
            sideways, steering = (value / 1000 for value in _BESIDES.unpack_from(frame.data))
        could = self._undrivable() is None
        if abs(sideways) >= SIDEWAYS_MPS:
            self._sideways_utime = frame.utime
        elif self._sideways_utime is not None and frame.utime - self._sideways_utime > SIDEWAYS_US:
            self._sideways_utime = None
        if not is_needed:
            return self._break(could, frame.utime)
        self._steers = self._steers or (not angular and abs(linear * steering) >= STEERS)
        if self._undrivable():
            return WheelRefusal.NO_ODOMETRY
        if abs(steering) > MAX_STEERING_RAD:
            return WheelRefusal.MALFORMED
        if not angular and self._steering is not None:
            angular = self._steering.yaw_rate(linear, steering)
        return [Twist(frame.utime, linear, angular)]
