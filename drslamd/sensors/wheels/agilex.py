"""AgileX bases (Scout, Hunter, Bunker, Ranger, Tracer) on a CAN bus, protocol V2.

Source: ugv_sdk, agilex_protocol_v2. Ids of 11 bits, numbers big-endian. 0x311 holds the path of
the left and the right wheels in mm since power-up, as signed 32 bit, every 20 ms. It is preferred
to the speed of the body in 0x221, which loses distance with every lost frame: that one is used
only while 0x311 is missing. 0x211 holds the state of the base. Frames of other ids are normal.
"""

from __future__ import annotations

import struct
from typing import Final

from drslamd.conventions import SECOND_US
from drslamd.events import CanFrame
from drslamd.sensors.samples import Twist, WheelCounts, WheelSample
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.wheel_driver import CanDriver, Outcome, WheelRefusal, tallied

COUNTS_PER_METRE: Final = 1000.0
COUNTER_BITS: Final = 32

ODOMETRY_MISSING_US: Final = SECOND_US // 2
"""25 frames of 0x311 in a row."""

_SYSTEM_STATE: Final = 0x211
_MOTION: Final = 0x221
_ODOMETRY: Final = 0x311
_ONLY_IN_V1: Final = 0x151

_STATE_AND_ERRORS: Final = struct.Struct(">B3xH")  # between them: control mode, battery
_SPEEDS: Final = struct.Struct(">hh")  # 0.001 m/s, 0.001 rad/s
_PATHS: Final = struct.Struct(">ii")

_STATES: Final = {1: "an emergency stop", 2: "a fault"}


class AgilexDriver(CanDriver):
    """`WheelCounts` in mm, or `Twist` while the base sends no odometry.

    Attributes:
        vehicle_state: 0 in order, 1 emergency stop, 2 fault.
        error_bits: of the last state frame; their meaning depends on the model.
    """

    expects: str = "AgileX CAN id 0x311 (or 0x221)"

    def __init__(self) -> None:
        self._odometry_utime: int | None = None
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
        return None

    def _decode(self, frame: CanFrame, odometry_utime: int) -> Outcome:
        if frame.extended:
            return None
        if frame.can_id == _ODOMETRY:
            return self._on_odometry(frame)
        if frame.can_id == _MOTION:
            return _on_motion(frame, frame.utime - odometry_utime > ODOMETRY_MISSING_US)
        if frame.can_id == _SYSTEM_STATE:
            return self._on_state(frame.data)
        return WheelRefusal.OLD_PROTOCOL if frame.can_id == _ONLY_IN_V1 else None

    def _on_odometry(self, frame: CanFrame) -> Outcome:
        if len(frame.data) < _PATHS.size:
            return WheelRefusal.SHORT
        left, right = _PATHS.unpack_from(frame.data)
        self._odometry_utime = frame.utime
        return [WheelCounts(frame.utime, left, right, COUNTER_BITS)]

    def _on_state(self, data: bytes) -> Outcome:
        if len(data) < _STATE_AND_ERRORS.size:
            return WheelRefusal.SHORT
        self.vehicle_state, self.error_bits = _STATE_AND_ERRORS.unpack_from(data)
        return None


def _on_motion(frame: CanFrame, is_needed: bool) -> Outcome:
    if not is_needed:
        return None
    if len(frame.data) < _SPEEDS.size:
        return WheelRefusal.SHORT
    linear, angular = _SPEEDS.unpack_from(frame.data)
    return [Twist(frame.utime, linear / 1000, angular / 1000)]
