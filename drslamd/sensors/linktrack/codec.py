"""LinkTrack frames: where one starts and ends in a stream, and what it says.

Law of this file: the tables of `linktrack_frames` say everything about a kind of frame, this file
only reads them. A frame is believed when its kind is known, its length, its sum and the number of
its entries agree; whether its values make sense is judged by `linktrack_input`.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping
from enum import Enum
from typing import Any, Final, NamedTuple

from drslamd.sensors.binary_layout import BlockReader, narrowed
from drslamd.sensors.frame_scanner import MAX_BUFFER_BYTES, NEED_MORE, NOT_A_FRAME
from drslamd.sensors.linktrack.linktrack_frames import LAYOUTS, Kind, Layout

NODE_OUTPUT: Final = 0x55
"""Header of everything a node prints by itself; marks without a table may appear below it."""

UNKNOWN_MIN_BYTES: Final = 12
"""The shortest node frame there is: NODE_FRAME0 without an entry."""
UNKNOWN_MAX_BYTES: Final = 1024
"""Frames for 20 nodes stay below 400 bytes, and nearly every false header is of an unknown kind:
at 1450 bytes a second this holds the scanner for 0.7 s, not for the 2.8 s of a full buffer."""

_LENGTH: Final = struct.Struct("<2xH")
_KINDS: Final = {kind.value: kind for kind in Kind}
_LAYOUTS: Final = {kind.value: layout for kind, layout in LAYOUTS.items()}
"""By the mark with which a frame begins: asked for each frame, and bytes are found fast."""
_READERS: Final = {mark: BlockReader(layout.body) for mark, layout in _LAYOUTS.items()}

RANGING_VALUES: Final = frozenset(
    {"id", "role", "local_time_ms", "system_time_ms", "voltage_v", "error_bits"}
    | {"distance_m", "fp_rssi_db", "rx_rssi_db"}
)
"""What ranging asks of a frame and of its entries."""
_RANGING_READERS: Final = {
    mark: BlockReader(narrowed(layout.body, RANGING_VALUES)) for mark, layout in _LAYOUTS.items()
}


class Refusal(Enum):
    """Why a frame is not used: the first four by `decode`, the others by `LinkTrackInput`."""

    UNKNOWN_KIND = "a kind of frame that is not read here"
    LENGTH = "a length that this kind of frame cannot have"
    CHECKSUM = "a wrong checksum"
    ENTRIES = "entries that do not fill the frame"
    LP_MODE = "printed only in the LP modes"
    WRONG_ID = "printed by another module than the configured one"
    VOLTAGE = "a supply voltage on which no module lives"
    TIME = "a local time that does not continue the one before"
    STEP = "something that goes on from frame to frame and did not, until the next says the same"


class Frame(NamedTuple):
    """One frame: its values by the names of its table.

    Entries are under the name of their tail or slots (``nodes``, ``tags``), as a tuple of mappings.
    """

    kind: Kind
    values: Mapping[str, Any]


class LinkTrackFormat:
    """How a `FrameScanner` finds LinkTrack frames."""

    head: Final = re.compile(rb"[\x52\x54\x55]")

    def length_at(self, buffer: bytes, at: int) -> int:
        """Length of the frame at `at`; refused as soon as length and entry count disagree."""
        if at + 2 > len(buffer):
            return NEED_MORE
        layout = _LAYOUTS.get(buffer[at : at + 2])
        if layout is None and buffer[at] != NODE_OUTPUT:
            return NOT_A_FRAME
        if layout is not None and not layout.has_length:
            return layout.body.size + 1
        if at + _LENGTH.size > len(buffer):
            return NEED_MORE
        length: int = _LENGTH.unpack_from(buffer, at)[0]
        if layout is None:
            return length if UNKNOWN_MIN_BYTES <= length <= UNKNOWN_MAX_BYTES else NOT_A_FRAME
        return _checked_length(buffer, at, length, layout)

    def is_intact(self, frame: bytes) -> bool:
        layout = _LAYOUTS.get(frame[:2])
        end = None if layout is None else layout.end
        return frame[-1] == (sum(frame[:-1]) & 0xFF if end is None else end)


def _checked_length(buffer: bytes, at: int, length: int, layout: Layout) -> int:
    """`length` when this kind of frame can have it; the entries are counted once they are there."""
    shortest, tail = layout.body.size + 1, layout.body.tail
    if tail is None or tail.entry is None:
        return length if length == shortest else NOT_A_FRAME
    if not shortest <= length <= MAX_BUFFER_BYTES:
        return NOT_A_FRAME
    if at + layout.body.size > len(buffer):
        return NEED_MORE
    shortest += tail.entry.size * buffer[at + tail.number.offset]
    fits = length == shortest if tail.entry.tail is None else length >= shortest
    return length if fits else NOT_A_FRAME


LINKTRACK: Final = LinkTrackFormat()


def decode(frame: bytes) -> Frame | Refusal:
    """What `frame`, from header to checksum, says; any bytes may be given.

    Source: protocol sheet NLink V1.4.
    """
    kind = _KINDS.get(frame[:2])
    if kind is None:
        return Refusal.UNKNOWN_KIND
    if LINKTRACK.length_at(frame, 0) != len(frame):
        return Refusal.LENGTH
    if not LINKTRACK.is_intact(frame):
        return Refusal.CHECKSUM
    return _read(frame, _READERS)


def decode_intact(frame: bytes) -> Frame | Refusal:
    """The same of a frame whose length and sum are right, as a scanner with `LINKTRACK` knows, and
    of its values only what ranging asks for."""
    return _read(frame, _RANGING_READERS)


def _read(frame: bytes, readers: Mapping[bytes, BlockReader]) -> Frame | Refusal:
    mark = frame[:2]
    kind = _KINDS.get(mark)
    if kind is None:
        return Refusal.UNKNOWN_KIND
    body_end = len(frame) - 1
    block = readers[mark].read(frame, 0, body_end)
    if block is None or block[1] != body_end:
        return Refusal.ENTRIES
    return Frame(kind, block[0])
