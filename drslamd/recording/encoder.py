"""Events and effects of one robot as entries of an LCM log (README.md: the format).

What travelled between robots stands on its own LCM channel with its own bytes, so that lcm-spy and
lcm-logplayer know it; everything else stands on channels that begin with ``REC_``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from drslamd.events import (
    CanFrame,
    ChannelMessage,
    Datagram,
    Effect,
    Event,
    JobDone,
    NetworkState,
    Note,
    PortState,
    Restart,
    Save,
    SaveDone,
    Send,
    SerialData,
    Slept,
    Tick,
)
from drslamd.gossip import lc02
from drslamd.recording import digest
from drslamd.recording.event_log import packed
from drslamd.recording.records import (
    CAN,
    FORMAT,
    JOB,
    KINDS,
    OWN,
    PREFIX,
    RAW,
    RECENT,
    SENDERS,
    SENT,
    TICK,
    Beginning,
    Opening,
    Told,
    is_plain,
)


class Encoder:
    """Turns what one robot hears and does into bytes of a log, one file after the other.

    Attributes:
        digest: of everything that the robot did.
    """

    def __init__(self, robot: int, is_framed: bool) -> None:
        """
        Args:
            is_framed: do messages come in as datagrams, or with their framing taken off?
        """
        self.robot = robot
        self.digest = 0
        self._is_framed = is_framed
        self._channels = {kind: f"{PREFIX}{kind}_{robot:03d}".encode() for kind in KINDS}
        self._new_file()

    def _new_file(self) -> None:
        self._number = 0
        self._recent: list[tuple[str, bytes]] = []
        self._senders: dict[str, bytes] = {}

    def opening(self, opening: Opening) -> bytes:
        """A new file begins; nothing before it is needed to read on."""
        self._new_file()
        content = {
            "format": FORMAT,
            "robot": self.robot,
            "is_framed": self._is_framed,
            "part": opening.part,
            "digest": self.digest,
            "beginning": _of_beginning(opening.beginning),
            "provenance": opening.provenance,
        }
        return self._text(opening.utime, "opening", content)

    def beginning(self, utime: int, beginning: Beginning) -> bytes:
        """Another robot takes the place of the one before, in the same process."""
        return self._text(utime, "beginning", _of_beginning(beginning))

    def told(self, told: Told) -> bytes:
        """What is worth knowing beside the events."""
        return self._text(told.utime, told.kind, told.content)

    def gap(self, utime: int, lost: int) -> bytes:
        """So many events are missing here."""
        self._recent, self._senders = [], {}
        return self._text(utime, "gap", {"lost": lost, "digest": self.digest})

    # events

    def event(self, event: Event) -> bytes:
        """One event, before the robot answers it."""
        utime = event.utime
        if isinstance(event, SerialData):
            return self._entry(utime, event.port.upper(), event.data)
        if isinstance(event, CanFrame):
            data = CAN.pack(event.can_id, event.extended) + event.data
            return self._entry(utime, "CAN", data)
        if isinstance(event, Tick):
            return self._entry(utime, "TICK", TICK.pack(self.digest))
        if isinstance(event, (Datagram, ChannelMessage)):
            return self._message(event)
        if isinstance(event, JobDone):
            found = digest.of_result(event.result)
            return self._entry(utime, "JOB", JOB.pack(event.job_id, event.elapsed_us, found))
        if isinstance(event, PortState):
            state = {"port": event.port, "condition": event.condition.name, "detail": event.detail}
            return self._text(utime, "port", state)
        if isinstance(event, NetworkState):
            return self._text(utime, "network", {"up": event.up, "detail": event.detail})
        if isinstance(event, Slept):
            return self._text(utime, "slept", {"asleep_us": event.asleep_us})
        if isinstance(event, SaveDone):
            return self._text(utime, "saved", {"fault": event.fault})
        return self._text(utime, "stop", {})

    def _message(self, event: Datagram | ChannelMessage) -> bytes:
        if isinstance(event, Datagram):
            framed = lc02.decode(event.data)
            name, data, is_framed = b"", event.data, True
        else:
            framed = event.channel, event.payload
            name, data, is_framed = _utf8(event.channel), event.payload, False
        sender = _utf8(event.sender)
        is_odd = isinstance(framed, lc02.FramingFault) or not is_plain(framed[0])
        if isinstance(framed, lc02.FramingFault) or is_odd or is_framed != self._is_framed:
            head = RAW.pack(is_framed, len(sender), len(name))
            return self._entry(event.utime, "RAW", head + sender + name + data)
        if framed in self._recent:
            ago = len(self._recent) - 1 - self._recent.index(framed)
            return self._entry(event.utime, "OWN", OWN.pack(ago) + sender)
        channel, payload = framed
        return self._from(event.utime, channel, sender) + self._plain(event.utime, channel, payload)

    def _from(self, utime: int, channel: str, sender: bytes) -> bytes:
        """Who sent the next message, where it is another one than last on that channel."""
        if self._senders.get(channel) == sender:
            return b""
        if len(self._senders) >= SENDERS:
            self._senders.clear()
        self._senders[channel] = sender
        return self._entry(utime, "FROM", channel.encode() + b"\0" + sender)

    # effects

    def effects(self, utime: int, effects: list[Effect]) -> bytes:
        """What the robot did about the event at `utime`."""
        if not effects:
            return b""
        sends = [effect for effect in effects if isinstance(effect, Send)]
        out = [self._entry(utime, "SENT", SENT.pack(len(sends)))] if sends else []
        for effect in effects:
            self.digest = digest.of_effect(effect, self.digest)
            if isinstance(effect, Send):
                self._recent = [*self._recent[1 - RECENT :], (effect.channel, effect.payload)]
                out.append(self._plain(utime, effect.channel, effect.payload))
        for effect in effects:
            if isinstance(effect, (Note, Save, Restart)):
                content = json.loads(digest.text_of(effect))
                out.append(self._text(utime, type(effect).__name__.lower(), content))
        return b"".join(out)

    # entries

    def _text(self, utime: int, kind: str, content: Mapping[str, Any]) -> bytes:
        text = json.dumps({"kind": kind, **content}, default=str)
        return self._entry(utime, "TEXT", text.encode("ascii"))

    def _entry(self, utime: int, kind: str, data: bytes) -> bytes:
        self._number += 1
        return packed(self._number - 1, utime, self._channels[kind], data)

    def _plain(self, utime: int, channel: str, payload: bytes) -> bytes:
        self._number += 1
        return packed(self._number - 1, utime, channel.encode("ascii"), payload)


def _of_beginning(beginning: Beginning) -> dict[str, Any]:
    epochs = {str(robot): epoch for robot, epoch in beginning.epochs.items()}
    kept = {"calibration": dict(beginning.calibration), "place": dict(beginning.place)}
    return {"epoch": beginning.epoch, "epochs": epochs, **kept}


def _utf8(name: str) -> bytes:
    return name.encode("utf-8", "surrogatepass")
