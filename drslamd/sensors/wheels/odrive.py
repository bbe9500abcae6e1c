"""ODrive axes on a CAN bus, protocol CANSimple: one axis for each wheel.

Source: ODrive docs, can-protocol, and odrive-cansimple.dbc. An 11-bit id is axis << 5 | command.
Encoder estimates (0x09) hold position in revolutions and speed in revolutions/s as little-endian
f32 and come by themselves, every 10 ms unless set otherwise; the heartbeat (0x01) begins with the
u32 error of its axis. Both axes speak one after the other: the right one is interpolated to the
time of the left one.
"""

from __future__ import annotations

import math
import struct
from typing import Final

from drslamd.events import CanFrame
from drslamd.sensors.samples import WheelSample, WheelTurns
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.side_pairing import Side, SidePairing, linear
from drslamd.sensors.wheels.wheel_driver import CanDriver, Outcome, WheelRefusal, tallied

_COMMAND_BITS: Final = 5
_HEARTBEAT: Final = 0x01
_ENCODER_ESTIMATES: Final = 0x09
_ERROR: Final = struct.Struct("<I")
_ESTIMATES: Final = struct.Struct("<ff")


class OdriveDriver(CanDriver):
    """`WheelTurns` in turns of the motors, at the rate of the axes.

    Args:
        left_axis: node id of the axis that drives the left wheel, 0 to 63.
        right_axis: likewise for the right wheel.

    Attributes:
        axis_errors: error of each of the two axes in its last heartbeat.
    """

    def __init__(self, left_axis: int, right_axis: int) -> None:
        self._sides = {left_axis: Side.FIRST, right_axis: Side.SECOND}
        self._pairing = SidePairing(linear)
        self.axis_errors = dict.fromkeys(self._sides, 0)
        self.expects = f"encoder estimates of the ODrive axes {left_axis} and {right_axis}"
        self.tally: Tally[WheelRefusal] = Tally()

    def on_frame(self, frame: CanFrame) -> list[WheelSample]:
        return tallied(self.tally, self._decode(frame))

    def unpaired(self) -> int:
        return self._pairing.unpaired

    def fault(self) -> str | None:
        for axis, error in self.axis_errors.items():
            if error:
                return (
                    f"ODrive axis {axis} reports error 0x{error:X}: look it up with odrivetool "
                    "(dump_errors) and clear it"
                )
        return None

    def _decode(self, frame: CanFrame) -> Outcome:
        axis, command = divmod(frame.can_id, 1 << _COMMAND_BITS)
        if frame.extended or axis not in self._sides:
            return None
        if command == _HEARTBEAT:
            return self._on_heartbeat(axis, frame.data)
        if command == _ENCODER_ESTIMATES:
            return self._on_estimates(axis, frame)
        return None

    def _on_heartbeat(self, axis: int, data: bytes) -> Outcome:
        if len(data) < _ERROR.size:
            return WheelRefusal.SHORT
        (self.axis_errors[axis],) = _ERROR.unpack_from(data)
        return None

    def _on_estimates(self, axis: int, frame: CanFrame) -> Outcome:
        if len(frame.data) < _ESTIMATES.size:
            return WheelRefusal.SHORT
        turns, speed = _ESTIMATES.unpack_from(frame.data)
        if not math.isfinite(turns) or not math.isfinite(speed):
            return WheelRefusal.NOT_FINITE
        pair = self._pairing.add(self._sides[axis], frame.utime, turns)
        return [] if pair is None else [WheelTurns(pair.utime, pair.first, pair.second)]
