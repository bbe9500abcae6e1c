"""What is at the other end of a serial cable, by what it says unasked.

The decoders of the sensors judge: whoever sends their frames, packets or lines, intact and more
than once, is recognised. A checksum of one byte lets noise pass once in 256 times, so one is none.
"""

from __future__ import annotations

from collections import Counter
from enum import Enum
from typing import Final, NamedTuple

from drslamd.sensors.frame_scanner import FrameScanner
from drslamd.sensors.linktrack.codec import LINKTRACK, Frame, decode
from drslamd.sensors.linktrack.linktrack_frames import Kind
from drslamd.sensors.wheels.ascii_odometry import AsciiDriver
from drslamd.sensors.wheels.kobuki import KobukiDriver
from drslamd.sensors.wheels.wheel_driver import SerialDriver, WheelRefusal
from drslamd.sensors.wheels.wheeltec import WheeltecDriver

LEAST_FRAMES: Final = 2
LINKTRACK_BAUDS: Final = (921_600, 115_200, 460_800, 230_400, 1_000_000, 1_500_000, 2_000_000)
"""Speeds that users set in a module, the one as delivered first; bases mostly have the second."""

_RANGING: Final = {Kind.NODE_FRAME2, Kind.NODE_FRAME3, Kind.NODE_FRAME5}


class Device(Enum):
    """What speaks."""

    LINKTRACK = "LinkTrack"
    KOBUKI = "Kobuki"
    ASCII = "$ODO lines"
    WHEELTEC = "Wheeltec"
    UNKNOWN = "something that is not understood"
    SILENT = "nothing"


class Recognised(NamedTuple):
    """
    Attributes:
        frames: intact frames, packets or lines of it.
        uwb_id: of a LinkTrack module that ranges; None for one that prints nothing of use here.
    """

    device: Device
    frames: int = 0
    uwb_id: int | None = None

    @property
    def is_certain(self) -> bool:
        """Need one not listen any further?"""
        return self.device not in (Device.UNKNOWN, Device.SILENT)


def recognised(data: bytes) -> Recognised:
    """Who says `data`, heard at one speed of the line; any bytes may be given."""
    if not data:
        return Recognised(Device.SILENT)
    found = (
        _linktrack(data),
        _base(Device.KOBUKI, KobukiDriver(), data),
        _base(Device.ASCII, AsciiDriver(), data),
        _base(Device.WHEELTEC, WheeltecDriver(), data),
    )
    best = max(found, key=lambda r: r.frames)
    return best if best.frames >= LEAST_FRAMES else Recognised(Device.UNKNOWN)


def _linktrack(data: bytes) -> Recognised:
    frames = [
        frame
        for piece in FrameScanner(LINKTRACK).feed(data, 0)
        if isinstance(frame := decode(piece), Frame)
    ]
    ids = Counter(frame.values["id"] for frame in frames if frame.kind in _RANGING)
    uwb_id = ids.most_common(1)[0][0] if ids else None
    return Recognised(Device.LINKTRACK, len(frames), uwb_id)


def _base(device: Device, driver: SerialDriver, data: bytes) -> Recognised:
    driver.feed(data, 0)
    # all of it is given at once, and so the times of the base need not fit
    intact = driver.tally.accepted + driver.tally.refused[WheelRefusal.TIME]
    return Recognised(device, intact)
