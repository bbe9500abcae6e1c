"""Entries of an LCM log as the events and effects that they were (README.md: the format).

A file is read as if a stranger had written it: what cannot be understood is `Unreadable`, with the
reason, and nothing is raised.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

from drslamd.events import (
    CanFrame,
    ChannelMessage,
    Datagram,
    JobDone,
    NetworkState,
    Port,
    PortCondition,
    PortState,
    SaveDone,
    Send,
    SerialData,
    Slept,
    Stop,
    Tick,
)
from drslamd.gossip import lc02
from drslamd.recording.event_log import Entry
from drslamd.recording.records import (
    CAN,
    FORMAT,
    JOB,
    OWN,
    PREFIX,
    RAW,
    RECENT,
    SENT,
    TICK,
    Beginning,
    Marked,
    Opening,
    Record,
    Sent,
    Told,
)

_DECODE_EXCEPTIONS = (struct.error, ValueError, KeyError, IndexError, TypeError, AttributeError)
"""What bytes that the encoder did not write can raise here."""


@dataclass(frozen=True)
class Unreadable:
    """An entry that no robot wrote."""

    utime: int
    reason: str


class Decoder:
    """Reads what one `Encoder` wrote, entry by entry.

    Attributes:
        robot: whose log it is; None before its first entry.
    """

    def __init__(self) -> None:
        self.robot: int | None = None
        self._is_framed = True
        self._new_file()
        self._readers: dict[str, Callable[[int, bytes], Record | None]] = {
            "TEXT": self._text,
            "UWB": lambda utime, data: SerialData(utime, "uwb", data),
            "WHEELS": lambda utime, data: SerialData(utime, "wheels", data),
            "CAN": _can,
            "TICK": lambda utime, data: Marked(Tick(utime), TICK.unpack(data)[0]),
            "JOB": _job,
            "SENT": self._sent,
            "FROM": self._from,
            "OWN": self._own,
            "RAW": _raw,
        }

    def _new_file(self) -> None:
        self._recent: list[Send] = []
        self._senders: dict[str, str] = {}
        self._sent_follow = 0

    def decode(self, entry: Entry) -> Record | Unreadable | None:
        """What an entry is; None when it only helps to read the next ones."""
        try:
            if not entry.channel.startswith(PREFIX):
                return self._message(entry)
            kind = entry.channel.split("_")[1]
            if self.robot is None and kind != "TEXT":
                return Unreadable(entry.utime, "the log does not begin with an opening")
            return self._readers[kind](entry.utime, entry.data)
        except _DECODE_EXCEPTIONS as error:
            return Unreadable(entry.utime, f"{entry.channel}: {type(error).__name__} {error}")

    def _message(self, entry: Entry) -> Record:
        if self._sent_follow:
            self._sent_follow -= 1
            send = Send(entry.channel, entry.data)
            self._recent = [*self._recent[1 - RECENT :], send]
            return Sent(entry.utime, send)
        return self._heard(
            entry.utime, entry.channel, entry.data, self._senders.get(entry.channel, "")
        )

    def _heard(self, utime: int, channel: str, payload: bytes, sender: str) -> Record:
        if self._is_framed:
            return Datagram(utime, lc02.encode(0, channel, payload), sender)
        return ChannelMessage(utime, channel, payload, sender)

    def _sent(self, utime: int, data: bytes) -> None:
        (self._sent_follow,) = SENT.unpack(data)

    def _from(self, utime: int, data: bytes) -> None:
        channel, _, sender = data.partition(b"\0")
        self._senders[channel.decode("ascii")] = _name(sender)

    def _own(self, utime: int, data: bytes) -> Record:
        (ago,) = OWN.unpack_from(data)
        send = self._recent[-1 - ago]
        return self._heard(utime, send.channel, send.payload, _name(data[OWN.size :]))

    def _text(self, utime: int, data: bytes) -> Record:
        content = json.loads(data)
        kind = content.pop("kind")
        if kind == "opening":
            return self._opening(utime, content)
        if kind == "beginning":
            return _beginning(content)
        if kind == "port":
            condition = PortCondition[content["condition"]]
            return PortState(utime, cast(Port, content["port"]), condition, content["detail"])
        if kind == "network":
            return NetworkState(utime, content["up"], content["detail"])
        if kind == "slept":
            return Slept(utime, int(content["asleep_us"]))
        if kind == "saved":
            return SaveDone(utime, content["fault"])
        if kind == "stop":
            return Stop(utime)
        if kind == "gap":
            self._new_file()
        return Told(utime, kind, content)

    def _opening(self, utime: int, content: dict[str, Any]) -> Opening:
        if content["format"] != FORMAT:
            raise ValueError(f"format {content['format']}, this program reads {FORMAT}")
        self._new_file()
        self.robot, self._is_framed = int(content["robot"]), bool(content["is_framed"])
        beginning, part = _beginning(content["beginning"]), int(content["part"])
        if not isinstance(content["provenance"], dict):
            raise ValueError("provenance is no table")
        return Opening(utime, beginning, part, content["provenance"], int(content["digest"]))


def _beginning(content: dict[str, Any]) -> Beginning:
    epochs = {int(robot): int(epoch) for robot, epoch in content["epochs"].items()}
    place = content.get("place", {})
    return Beginning(int(content["epoch"]), epochs, content["calibration"], place)


def _can(utime: int, data: bytes) -> CanFrame:
    can_id, extended = CAN.unpack_from(data)
    return CanFrame(utime, can_id, bool(extended), data[CAN.size :])


def _job(utime: int, data: bytes) -> Marked:
    job_id, elapsed_us, digest = JOB.unpack(data)
    return Marked(JobDone(utime, job_id, None, elapsed_us), digest)


def _raw(utime: int, data: bytes) -> Datagram | ChannelMessage:
    is_framed, sender_size, name_size = RAW.unpack_from(data)
    at = RAW.size + sender_size
    sender, name, rest = data[RAW.size : at], data[at : at + name_size], data[at + name_size :]
    if is_framed:
        return Datagram(utime, rest, _name(sender))
    return ChannelMessage(utime, _name(name), rest, _name(sender))


def _name(data: bytes) -> str:
    return data.decode("utf-8", "surrogatepass")
