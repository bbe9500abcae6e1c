"""Wheel odometry in plain lines, for bases that somebody programs himself.

There is no standard, so this is the project's own line, ended by CR, LF or both:

    $ODO,<ms>,<left>,<right>*HH
    $ODO,<ms>,<left>,<right>,<heading>*HH

``ms`` is the time of the base in milliseconds (unsigned, wraps at 2 ** 32 as ``millis()`` does),
``left`` and ``right`` are the wheel counters in decimal (32 bit, signed or unsigned, they wrap),
``HH`` the exclusive or of all characters between ``$`` and ``*`` as two hex digits, as in NMEA.
``heading`` is the angle that a gyro has turned to the left, in degrees, with up to four digits
after the point; it may go on or wrap. Example: ``$ODO,123456,1532,-48*4B``. Send one at least every
100 ms. Other lines are ignored, so the base may print what else it likes.
"""

from __future__ import annotations

import math
import re
from functools import reduce
from operator import xor
from typing import Final

from drslamd.sensors.line_scanner import LineScanner
from drslamd.sensors.samples import GyroAngle, WheelCounts, WheelSample
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.wheel_driver import (
    BaseTime,
    Outcome,
    SerialDriver,
    WheelRefusal,
    tallied,
)

COUNTER_BITS: Final = 32
TIME_BITS: Final = 32

_START: Final = b"$ODO,"
_LINE: Final = re.compile(
    rb"\$(?P<text>ODO,(?P<ms>\d{1,10}),(?P<left>-?\d{1,10}),(?P<right>-?\d{1,10})"
    rb"(,(?P<heading>-?\d{1,7}(\.\d{1,4})?))?)"
    rb"\*(?P<sum>[0-9A-Fa-f]{2})"
)


class AsciiDriver(SerialDriver):
    """`WheelCounts` of 32 bits, stamped with the time of the base on the host's clock."""

    expects: str = "lines of the form $ODO,<ms>,<left>,<right>*HH"

    def __init__(self) -> None:
        self._lines = LineScanner()
        self._time = BaseTime(TIME_BITS)
        self.tally: Tally[WheelRefusal] = Tally()

    def feed(self, data: bytes, utime: int) -> list[WheelSample]:
        samples = []
        for line in self._lines.feed(data):
            samples += tallied(self.tally, self._decode(line, utime))
        self.tally.set_refused(WheelRefusal.OVERLONG, self._lines.overlong)
        return samples

    def _decode(self, line: bytes, utime: int) -> Outcome:
        start = line.rfind(_START)  # noise, or a line cut short, may stand before it
        if start < 0:
            return None
        match = _LINE.fullmatch(line, start)
        if match is None:
            return WheelRefusal.MALFORMED
        if reduce(xor, match["text"]) != int(match["sum"], 16):
            return WheelRefusal.CHECKSUM
        time_ms, left, right = (int(match[name]) for name in ("ms", "left", "right"))
        if time_ms >= 1 << TIME_BITS or not _fits(left) or not _fits(right):
            return WheelRefusal.MALFORMED
        heading = match["heading"]

        def samples(measured: int) -> list[WheelSample]:
            counts = WheelCounts(measured, left, right, COUNTER_BITS)
            if heading is None:
                return [counts]
            return [GyroAngle(measured, math.radians(float(heading))), counts]

        return self._time.stamped(time_ms, utime, samples)


def _fits(count: int) -> bool:
    return -(1 << (COUNTER_BITS - 1)) <= count < 1 << COUNTER_BITS
