"""LCM's event log: entries one after the other, each found by its sync word.

    sync word 0xEDA1DA01, number (8 bytes), time (8 bytes, us), length of the channel, length of the
    data (4 bytes each), channel, data; everything big-endian

Source: LCM documentation, log file format. A file that was cut in the middle of an entry is good up
to there; bytes that are no entry are passed over up to the next sync word, and said.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

SYNC = 0xEDA1DA01
MAX_CHANNEL = 255
"""Bytes; LCM's own channels have 63."""
MAX_DATA = 1 << 20
"""Bytes; an entry of ours has a tenth of it, and a length that was damaged asks for no memory."""
CHUNK = 1 << 20
"""Bytes that are read at a time."""

_HEADER = struct.Struct(">IqqII")
_SYNC = struct.pack(">I", SYNC)


class Entry(NamedTuple):
    """One event of a log; time in us."""

    number: int
    utime: int
    channel: str
    data: bytes


class Damage(NamedTuple):
    """So many bytes at this place are no entry; `is_tail`: the file ends in the middle of one."""

    at: int
    size: int
    is_tail: bool


def packed(number: int, utime: int, channel: bytes, data: bytes) -> bytes:
    """One entry as it stands in the file."""
    return _HEADER.pack(SYNC, number, utime, len(channel), len(data)) + channel + data


def entries(file: BinaryIO) -> Iterator[Entry | Damage]:
    """Everything in a file, from where it stands."""
    buffer, at, lost = bytearray(), 0, 0
    is_over = False
    while True:
        found = _first(buffer)
        if isinstance(found, Entry):
            if lost:
                yield Damage(at - lost, lost, False)
                lost = 0
            yield found
            size = _HEADER.size + len(found.channel) + len(found.data)
            del buffer[:size]
            at += size
        elif found is _MORE and not is_over:
            more = file.read(CHUNK)
            is_over = not more
            buffer += more
        elif not buffer:
            break
        else:
            ahead = buffer.find(_SYNC, 1)
            skipped = ahead if ahead > 0 else max(1, len(buffer) - 3 * (not is_over))
            del buffer[:skipped]
            at, lost = at + skipped, lost + skipped
    if lost:
        yield Damage(at - lost, lost, True)


_MORE = object()


def _first(buffer: bytearray) -> Entry | object:
    """The entry that a buffer begins with; `_MORE` where it may, None where it does not."""
    if len(buffer) < _HEADER.size:
        return _MORE if _SYNC.startswith(bytes(buffer[:4])) else None
    sync, number, utime, channel_size, data_size = _HEADER.unpack_from(buffer)
    if sync != SYNC or not 0 < channel_size <= MAX_CHANNEL or data_size > MAX_DATA:
        return None
    end = _HEADER.size + channel_size + data_size
    if len(buffer) < end:
        return _MORE
    name = bytes(buffer[_HEADER.size : _HEADER.size + channel_size])
    if not name.isascii():
        return None
    return Entry(
        number, utime, name.decode("ascii"), bytes(buffer[_HEADER.size + channel_size : end])
    )
