"""What is said: typed messages, the channels that carry them, and their passage to LCM bytes.

`encode` and `decode` are inverse for every message whose numbers are already whole steps (rounding
is done where a number is born). `decode` accepts only what `encode` could have made: counts within
their bounds, every number finite, no byte left over.
"""

from __future__ import annotations

import struct
from io import BytesIO
from typing import cast

from drslamd.conventions import MAX_ROBOT_ID
from drslamd.gossip.codecs import CODECS
from drslamd.gossip.message_types import (
    MAX_BATCH,
    MAX_HEARD,
    MAX_LOGS,
    UNKNOWN_CLOCK,
    Heard,
    LogState,
    Message,
    OdometryBatch,
    Pose,
    Status,
)
from drslamd.gossip.seal import TAG_BYTES, Header

__all__ = [
    "CHANNEL_PREFIX",
    "FINGERPRINTS",
    "NEAR_PREFIX",
    "MAX_BATCH",
    "MAX_HEARD",
    "MAX_LOGS",
    "UNKNOWN_CLOCK",
    "Heard",
    "LogState",
    "Message",
    "OdometryBatch",
    "Pose",
    "Status",
    "channel",
    "decode",
    "encode",
    "kind_of",
    "kind_of_channel",
]

CHANNEL_PREFIX = "DRSLAM_"
NEAR_PREFIX = f"{CHANNEL_PREFIX}NEAR_"
"""Of what robots tell whoever steers, and do not listen to."""
FINGERPRINTS = {kind: codec.struct._get_packed_fingerprint() for kind, codec in CODECS.items()}
"""LCM's eight bytes that begin every message of a kind."""

_KIND_OF = {codec.message: kind for kind, codec in CODECS.items()}
_DECODE_EXCEPTIONS = (ValueError, struct.error, IndexError)
"""What the generated decoders and our checks raise on bytes that are not theirs."""


class _Whole(BytesIO):
    """Bytes of which nobody gets fewer than asked for: LCM's decoders take what is left of them for
    an array of bytes, however many it says it has."""

    def read(self, size: int | None = -1, /) -> bytes:
        found = super().read(size)
        if len(found) != size:
            raise ValueError("bytes that end too soon")
        return found


def channel(kind: str, robot: int) -> str:
    return f"{CHANNEL_PREFIX}{kind}_{robot:03d}"


_KIND_OF_CHANNEL = {channel(k, robot): k for k in CODECS for robot in range(MAX_ROBOT_ID + 1)}


def kind_of_channel(name: str) -> str | None:
    """The kind that a channel carries, None when it is not one of ours."""
    return _KIND_OF_CHANNEL.get(name)


def kind_of(message: Message) -> str:
    return _KIND_OF[type(message)]


def encode(header: Header, message: Message) -> bytes:
    """LCM bytes with an empty tag."""
    codec = CODECS[kind_of(message)]
    out = codec.struct()
    out.header.version, out.header.origin = header.version, header.origin
    out.header.epoch, out.header.counter = header.epoch, header.counter
    out.header.utime, out.header.tag = header.utime, bytes(TAG_BYTES)
    codec.fill(out, message)
    return bytes(out.encode())


def decode(kind: str, payload: bytes) -> Message | str:
    """The message, or one phrase that says what is wrong with it."""
    codec, stream = CODECS[kind], _Whole(payload)
    try:
        raw = codec.struct.decode(stream)
        if stream.tell() < len(payload):
            return "bytes left over"
        return cast(Message, codec.read(raw))
    except _DECODE_EXCEPTIONS as error:
        return str(error) or type(error).__name__
