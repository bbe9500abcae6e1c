"""LCM's framing of a small message: ``LC02``, a sequence number, the channel, a NUL, the payload.

Source: LCM documentation, UDP multicast protocol. Fragmented messages (``LC03``) are refused:
whatever is larger than one datagram is lost too often on a radio, and their reassembly is where
liblcm can be crashed from outside.
"""

from __future__ import annotations

import struct
from enum import Enum

MAGIC_SHORT = 0x4C433032
MAGIC_FRAGMENT = 0x4C433033
MAX_CHANNEL = 63
"""Bytes of a channel name in LCM, without its NUL."""
MAX_PAYLOAD = 1_400
"""One Ethernet frame with room for IP, UDP and tunnel headers: IP never fragments it."""

_HEADER = struct.Struct(">II")
MAX_DATAGRAM = _HEADER.size + MAX_CHANNEL + 1 + MAX_PAYLOAD


class FramingFault(Enum):
    TOO_SHORT = "datagram too short"
    TOO_LONG = "datagram too long"
    NOT_LCM = "not an LCM datagram"
    FRAGMENT = "fragmented LCM message"
    NO_CHANNEL_END = "channel without its NUL"
    BAD_CHANNEL = "channel is empty or not ASCII"


def encode(sequence: int, channel: str, payload: bytes) -> bytes:
    """One datagram.

    Raises:
        ValueError: the channel or the payload does not fit; that is a bug of the caller.
    """
    name = channel.encode("ascii")
    if not 0 < len(name) <= MAX_CHANNEL or b"\0" in name or len(payload) > MAX_PAYLOAD:
        raise ValueError(f"{channel!r}: channel of {len(name)}, payload of {len(payload)} bytes")
    return _HEADER.pack(MAGIC_SHORT, sequence & 0xFFFFFFFF) + name + b"\0" + payload


def decode(datagram: bytes) -> tuple[str, bytes] | FramingFault:
    """Channel and payload, or why not."""
    if len(datagram) > MAX_DATAGRAM:
        return FramingFault.TOO_LONG
    if len(datagram) < _HEADER.size:
        return FramingFault.TOO_SHORT
    magic, _ = _HEADER.unpack_from(datagram)
    if magic == MAGIC_FRAGMENT:
        return FramingFault.FRAGMENT
    if magic != MAGIC_SHORT:
        return FramingFault.NOT_LCM
    end = datagram.find(b"\0", _HEADER.size, _HEADER.size + MAX_CHANNEL + 1)
    if end < 0:
        return FramingFault.NO_CHANNEL_END
    name, payload = datagram[_HEADER.size : end], datagram[end + 1 :]
    if not name or not name.isascii():
        return FramingFault.BAD_CHANNEL
    if len(payload) > MAX_PAYLOAD:
        return FramingFault.TOO_LONG
    return name.decode("ascii"), payload
