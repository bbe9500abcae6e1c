"""ODrive axes on a CAN bus, protocol CANSimple: one axis for each wheel.

Source: ODrive docs, can-protocol, and odrive-cansimple.dbc. An 11-bit id is axis << 5 | command.
Encoder estimates (0x09) hold position in revolutions and speed in revolutions/s as little-endian
f32 and come by themselves, every 10 ms unless set otherwise; the heartbeat (0x01) begins with the
u32 error of its axis. Both axes speak one after the other: the right one is interpolated to the
time of the left one.

An ODrive sends heartbeats also when its estimates were turned off, estimates also when its encoder
is not calibrated (no numbers) or has stopped (a speed, but a position that stands). Each of these
has its own sentence.
"""

from __future__ import annotations

import math
import struct
from typing import Final, NamedTuple

from drslamd.conventions import SECOND_US
from drslamd.events import CanFrame
from drslamd.sensors.samples import WheelSample, WheelTurns
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.side_pairing import Side, SidePairing, linear
from drslamd.sensors.wheels.wheel_driver import CanDriver, Outcome, WheelRefusal, tallied

MAX_AXES: Final = 64
_COMMAND_BITS: Final = 5
_HEARTBEAT: Final = 0x01
_ENCODER_ESTIMATES: Final = 0x09
_ERROR: Final = struct.Struct("<I")
_ESTIMATES: Final = struct.Struct("<ff")


HEARD_US: Final = 2 * SECOND_US
"""An axis that said something during this time speaks."""
STANDING_US: Final = SECOND_US
TURNING_RPS: Final = 0.1
"""At this speed a position that stands for so long is none: the wheel has turned by 36 degrees."""

_RATE: Final = (
    "set encoder_rate_ms (encoder_msg_rate_ms in newer firmware) of its CAN settings to 10"
)


class _Standing(NamedTuple):
    """A position, and since when an axis has been there although it says that it turns."""

    turns: float
    since: int
    until: int

    @property
    def is_long(self) -> bool:
        return self.until - self.since >= STANDING_US


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
        self._standing: dict[int, _Standing] = {}
        self._heartbeats: dict[int, int] = {}
        self._estimates: dict[int, int] = {}
        """When each axis on the bus, of at most 64, last sent them."""
        self._no_numbers: dict[int, int] = {}
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
        for axis, standing in self._standing.items():
            if standing.is_long:
                return (
                    f"ODrive axis {axis} says that it turns but its position stands: check its "
                    "encoder and the settings of it"
                )
        return None

    def why_no_sample(self, utime: int) -> str | None:
        wanted = set(self._sides)
        speaking = {axis for axis, last in self._estimates.items() if utime - last <= HEARD_US}
        alive = {axis for axis, last in self._heartbeats.items() if utime - last <= HEARD_US}
        broken = {axis for axis, last in self._no_numbers.items() if utime - last <= HEARD_US}
        if broken:
            return (
                f"the encoder estimates of ODrive {_axes(broken)} are no numbers: calibrate the "
                "encoder, and look for errors with odrivetool (dump_errors)"
            )
        silent = wanted - speaking
        if silent & alive:
            return f"ODrive {_axes(silent & alive)}: heartbeats but no encoder estimates: {_RATE}"
        others = (speaking | alive) - wanted
        if silent and others:
            return (
                f"nothing from ODrive {_axes(silent)}, but {_axes(others)} on the bus: correct "
                "wheels.left_axis and wheels.right_axis"
            )
        if silent and silent != wanted:
            return (
                f"nothing from ODrive {_axes(silent)}, only from {_axes(wanted - silent)}: check "
                "its power, its cable and its node id"
            )
        return None

    def _decode(self, frame: CanFrame) -> Outcome:
        axis, command = divmod(frame.can_id, 1 << _COMMAND_BITS)
        if frame.extended or command not in (_HEARTBEAT, _ENCODER_ESTIMATES):
            return None
        heard = self._heartbeats if command == _HEARTBEAT else self._estimates
        heard[axis % MAX_AXES] = frame.utime
        if axis not in self._sides:
            return None
        if command == _HEARTBEAT:
            return self._on_heartbeat(axis, frame.data)
        return self._on_estimates(axis, frame)

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
            self._no_numbers[axis] = frame.utime
            return WheelRefusal.NOT_FINITE
        if self._stands(axis, frame.utime, turns, speed):
            return WheelRefusal.STANDING
        pair = self._pairing.add(self._sides[axis], frame.utime, turns)
        return [] if pair is None else [WheelTurns(pair.utime, pair.first, pair.second)]

    def _stands(self, axis: int, utime: int, turns: float, speed: float) -> bool:
        before = self._standing.pop(axis, None)
        if abs(speed) < TURNING_RPS:
            return False
        since = before.since if before is not None and before.turns == turns else utime
        self._standing[axis] = _Standing(turns, since, utime)
        return self._standing[axis].is_long


def _axes(axes: set[int]) -> str:
    numbers = [str(axis) for axis in sorted(axes)]
    return f"axis {numbers[0]}" if len(numbers) == 1 else f"axes {' and '.join(numbers)}"
