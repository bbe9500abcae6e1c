"""The serial protocol of Wheeltec's base controllers: 20 frames a second, nothing to ask for.

Source: wheeltec_driver (serial_protocol.hpp) and turn_on_robot. A frame has 24 bytes, numbers are
big-endian: 7B, a stop flag, the speeds ahead, sideways (mm/s) and about (0.001 rad/s) that the
wheels tell, three raw accelerations, three raw rates of a gyro, the battery in mV, the exclusive or
of all that, 7D. There is no counter and no time: speeds are integrated over times of arrival, and
with every lost frame a bit of that is guessed.

A base that moves sideways (mecanum wheels) is refused while it does.
"""

from __future__ import annotations

import re
import struct
from functools import reduce
from operator import xor
from typing import Final

from drslamd.conventions import SECOND_US
from drslamd.sensors.frame_scanner import NOT_A_FRAME, FrameScanner
from drslamd.sensors.samples import GyroRate, Twist, WheelSample
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.wheel_driver import Outcome, SerialDriver, WheelRefusal, tallied

GYRO_RADPS: Final = 0.00026644
"""One digit of the gyro: 500 degrees a second are half of 16 bits, nearly."""
SIDEWAYS_MPS: Final = 0.05
"""Slower is what a base that stands may say."""
SIDEWAYS_US: Final = SECOND_US // 2
"""How long after the last such frame a base is taken to move sideways."""

_HEAD: Final = 0x7B
_TAIL: Final = 0x7D
_FRAME: Final = struct.Struct(">xB3h10xhHBB")  # between them: accelerations, gyro's x and y


class WheeltecFormat:
    """How a `FrameScanner` finds Wheeltec's frames."""

    head: Final = re.compile(bytes([_HEAD]))

    def length_at(self, buffer: bytes, at: int) -> int:
        return _FRAME.size if buffer[at] == _HEAD else NOT_A_FRAME

    def is_intact(self, frame: bytes) -> bool:
        return frame[-1] == _TAIL and reduce(xor, frame[:-1]) == 0


class WheeltecDriver(SerialDriver):
    """`Twist` and the rate of the gyro, stamped with their arrival.

    Attributes:
        is_stopped: does the base say that its motors are switched off?
    """

    expects: str = "Wheeltec frames (7B ... 7D)"

    def __init__(self) -> None:
        self._scanner = FrameScanner(WheeltecFormat())
        self._sideways_utime: int | None = None
        self.is_stopped = False
        self.tally: Tally[WheelRefusal] = Tally()

    def feed(self, data: bytes, utime: int) -> list[WheelSample]:
        samples = []
        for frame in self._scanner.feed(data, utime):
            samples += tallied(self.tally, self._decode(frame, utime))
        self.tally.set_refused(WheelRefusal.CHECKSUM, self._scanner.bad_checksums)
        return samples

    def fault(self) -> str | None:
        if self._sideways_utime is not None:
            return (
                "the base moves sideways, which cannot be integrated: drive it like one with two "
                "wheels"
            )
        if self.is_stopped:
            return "the base says that its motors are switched off: release its stop switch"
        return None

    def _decode(self, frame: bytes, utime: int) -> Outcome:
        stop, ahead, sideways, about, turn, _, _, _ = _FRAME.unpack(frame)
        self.is_stopped = bool(stop)
        if abs(sideways) / 1000 > SIDEWAYS_MPS:
            self._sideways_utime = utime
        elif self._sideways_utime is not None and utime - self._sideways_utime > SIDEWAYS_US:
            self._sideways_utime = None
        if self._sideways_utime is not None:
            return WheelRefusal.NO_ODOMETRY
        return [GyroRate(utime, GYRO_RADPS * turn), Twist(utime, ahead / 1000, about / 1000)]
