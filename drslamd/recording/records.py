"""What a recording holds beside events: where it comes from, what was sent, what was done.

`encoder.py` writes these and the events, `decoder.py` reads them; README.md is the format.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Union

from drslamd.events import Event, JobDone, Send, Tick

FORMAT = 1
"""Of the entries; a reader refuses another one."""
PREFIX = "REC_"
KINDS = ("TEXT", "UWB", "WHEELS", "CAN", "TICK", "JOB", "SENT", "FROM", "OWN", "RAW")
"""Of entries that are not messages of a network: the middle of the name of their channel."""
RECENT = 64
"""Own messages that are recognised when they come back: twenty seconds of them."""
SENDERS = 256
"""Channels whose last sender is remembered; a network may make up any number of names."""
LONGEST_CHANNEL = 63
"""Bytes, in LCM."""

CAN = struct.Struct(">IB")
TICK = struct.Struct(">I")
JOB = struct.Struct(">qqI")
OWN = struct.Struct(">H")
RAW = struct.Struct(">BHH")
SENT = struct.Struct(">H")


@dataclass(frozen=True)
class Beginning:
    """What a robot begins with, beside its configuration.

    Attributes:
        epochs: of its peers, as they were kept.
        calibration: `SensorCalibration.state` of the start before; place: `LastPlace.state` of it.
    """

    epoch: int
    epochs: Mapping[int, int] = field(default_factory=dict)
    calibration: Mapping[str, Any] = field(default_factory=dict)
    place: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Opening:
    """The first entry of a file: where everything comes from.

    Attributes:
        beginning: of the robot that the file goes on with.
        part: number of the file in its run, from 0.
        provenance: configuration, versions, host, clocks (`io/recording/provenance.py`).
        digest: of what was done before.
    """

    utime: int
    beginning: Beginning
    part: int
    provenance: Mapping[str, Any]
    digest: int = 0


@dataclass(frozen=True)
class Told:
    """Something that is no event: `kind` "clock", "gap", "note", "save", "restart"."""

    utime: int
    kind: str
    content: Mapping[str, Any]


@dataclass(frozen=True)
class Sent:
    """The robot sent this in answer to the event before."""

    utime: int
    send: Send


@dataclass(frozen=True)
class Marked:
    """An event, and what the robot had done up to it (of a `JobDone`: what was found)."""

    event: Tick | JobDone
    digest: int


Record = Union[Event, Opening, Beginning, Told, Sent, Marked]


def is_plain(channel: str) -> bool:
    """Can messages on this channel stand in the log as they are?"""
    is_name = channel.isascii() and 0 < len(channel) <= LONGEST_CHANNEL and "\0" not in channel
    return is_name and not channel.startswith(PREFIX)
