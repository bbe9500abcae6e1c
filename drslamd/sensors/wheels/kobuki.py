"""The serial protocol of Kobuki (TurtleBot2): 50 packets a second, nothing to ask for.

Source: kobuki_core, packets and packet_finder. A packet is AA 55, the length of the payload, the
payload, and the exclusive or of length and payload. The payload is a row of sub-payloads: id,
length, data. Core data (id 1) hold the time of the base in ms and both wheel counters, all 16 bit.
Inertia (id 4) holds the angle that the base makes of its gyro, id 13 raw rates of all three axes.
"""

from __future__ import annotations

import math
import re
import struct
from typing import Final

from drslamd.sensors.frame_scanner import NEED_MORE, NOT_A_FRAME, FrameScanner
from drslamd.sensors.samples import GyroAngle, GyroRate, WheelCounts, WheelSample
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.wheel_driver import (
    BaseTime,
    Outcome,
    SerialDriver,
    WheelRefusal,
    tallied,
)

COUNTER_BITS: Final = 16
TIME_BITS: Final = 16

_HEADER: Final = b"\xaa\x55"
_CORE: Final = 1
_TIME_AND_COUNTS: Final = struct.Struct("<H3x2H")  # between them: bumper, wheel drop, cliff

_INERTIA: Final = 4
_ANGLE: Final = struct.Struct("<h")  # 0.01 deg; a rate and unused bytes follow
_RAW_GYRO: Final = 13
_RAW_DEG_PER_S: Final = 0.00875
"""One digit of the gyro's z; x, y, z are one after the other behind two bytes."""

_HALVES: Final = tuple(8 << step for step in reversed(range(9)))
"""Bits: a row of up to 512 bytes, folded nine times, is the exclusive or of all of them."""

_LENGTHS: Final = {_CORE: {15}, 3: {3}, 4: {7}, 5: {6}, 6: {2}, 13: {14, 20}, 16: {16}, 21: {21}}
"""Sub-payloads of known length: another one means that the packet is damaged."""


class KobukiFormat:
    """How a `FrameScanner` finds Kobuki packets."""

    head: Final = re.compile(b"\xaa")

    def length_at(self, buffer: bytes, at: int) -> int:
        start = buffer[at : at + 3]
        if not start.startswith(_HEADER[: len(start)]):
            return NOT_A_FRAME
        if len(start) < 3:
            return NEED_MORE
        return len(_HEADER) + 1 + start[2] + 1 if start[2] else NOT_A_FRAME

    def is_intact(self, frame: bytes) -> bool:
        rest = int.from_bytes(frame[2:], "little")
        for half in _HALVES:
            rest = rest >> half ^ rest & (1 << half) - 1
        return rest == 0


def sub_payloads(packet: bytes) -> dict[int, bytes] | None:
    """Data of each sub-payload of an intact packet by its id, or None when they do not fit."""
    found, at, end = {}, len(_HEADER) + 1, len(packet) - 1
    while at + 2 <= end:
        kind, length = packet[at], packet[at + 1]
        data = packet[at + 2 : at + 2 + length]
        if len(data) != length or length not in _LENGTHS.get(kind, {length}):
            return None
        found[kind] = data
        at += 2 + length
    return found if at == end else None


class KobukiDriver(SerialDriver):
    """`WheelCounts` of 16 bits, stamped with the time of the base on the host's clock."""

    expects: str = "Kobuki packets (AA 55 ...)"

    def __init__(self) -> None:
        self._scanner = FrameScanner(KobukiFormat())
        self._time = BaseTime(TIME_BITS)
        self.tally: Tally[WheelRefusal] = Tally()

    def feed(self, data: bytes, utime: int) -> list[WheelSample]:
        samples = []
        for packet in self._scanner.feed(data, utime):
            samples += tallied(self.tally, self._decode(packet, utime))
        self.tally.set_refused(WheelRefusal.CHECKSUM, self._scanner.bad_checksums)
        return samples

    def _decode(self, packet: bytes, utime: int) -> Outcome:
        parts = sub_payloads(packet)
        if parts is None:
            return WheelRefusal.MALFORMED
        if _CORE not in parts:
            return None
        time_ms, left, right = _TIME_AND_COUNTS.unpack_from(parts[_CORE])

        def samples(measured: int) -> list[WheelSample]:
            return [*_gyro(parts, measured), WheelCounts(measured, left, right, COUNTER_BITS)]

        return self._time.stamped(time_ms, utime, samples)


def _gyro(parts: dict[int, bytes], utime: int) -> list[WheelSample]:
    """The heading that the base has integrated, else the mean of its raw rates."""
    if _INERTIA in parts:
        (angle,) = _ANGLE.unpack_from(parts[_INERTIA])
        return [GyroAngle(utime, math.radians(angle / 100))]
    if _RAW_GYRO in parts:
        data = parts[_RAW_GYRO]
        turns = [z for _, _, z in struct.iter_unpack("<3h", data[2:])]
        return [GyroRate(utime, math.radians(_RAW_DEG_PER_S * sum(turns) / len(turns)))]
    return []
