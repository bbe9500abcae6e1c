"""What goes on from one frame of a module to the next, for damage that the checksum lets pass.

The checksum is a sum of bytes, so two bits in the same place of two bytes pass it together. One of
them may be anywhere; so a frame is looked at as a whole, and whatever breaks with the frame before
waits until the next one says the same:

1. bytes that never changed still do not (roles, reserved ones, values that a module does not have);
   one that did change is not looked at again,
2. the supply voltage and the lead of system_time change slowly,
3. of each peer: distance, powers and the age of its entry.

What changes in truth costs one frame or one range; a module whose frames never agree is believed at
every third one, and who is heard less often than every ten seconds is not believed.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Final, NamedTuple

from drslamd.conventions import SECOND_US
from drslamd.sensors.linktrack.codec import Frame
from drslamd.sensors.linktrack.linktrack_frames import LAYOUTS, Kind
from drslamd.sensors.wheels.wrapping import wrapped_difference

REMEMBERED_US: Final = SECOND_US
"""A frame that is older says nothing about now."""
PEER_REMEMBERED_US: Final = 10 * SECOND_US
"""Likewise of the range to a peer, which may be far away or one of many and heard now and then."""
SETTLED_US: Final = 2 * SECOND_US
"""After so long a module has named all peers that it hears; one more waits for its second range."""
PATIENCE: Final = 2
"""Frames in a row that may wait."""
VOLTAGE_STEP_V: Final = 0.3
LEAD_STEP_MS: Final = 10
"""Two modules drift apart by 40 us a second; a new time base differs by more than this."""
AGE_STEP_MS: Final = 250
"""An entry of NODE_FRAME2 says when it was measured, which is not long before its frame."""
POWER_STEP_DB: Final = 20.0
RANGE_STEP_M, RANGE_SPEED_MPS = 0.5, 10.0
"""Noise and reflections from one frame to the next, and two robots that drive apart."""
MAX_PEERS: Final = 255
TIME_BITS: Final = 32


class FrameHead(NamedTuple):
    """Of one frame, what all of its entries share."""

    kind: Kind
    still: int
    """All bytes of its head that may well be the same for ever, as one number."""
    volts: float
    lead_ms: int | None
    """Of system_time before local_time, where that is told and steady."""
    local_ms: int
    utime: int


def head_of(data: bytes, frame: Frame, lead_ms: int | None, utime: int) -> FrameHead:
    values = frame.values
    size, mask = _LOOKED_AT[frame.kind]
    still = int.from_bytes(data[:size], "little") & mask
    return FrameHead(
        frame.kind, still, values["voltage_v"], lead_ms, values["local_time_ms"], utime
    )


def _looked_at(kind: Kind) -> tuple[int, int]:
    """Size of the head of a frame, and ones in all bytes of it that may be the same for ever."""
    body = LAYOUTS[kind].body
    moving = {"local_time_ms", "system_time_ms", "voltage_v", "id"}
    places = set(range(4, body.size - 1))  # all but kind, length and number of entries
    for field in body.fields:
        if field.name in moving:
            places -= set(range(field.offset, field.offset + field.type.size))
    return body.size, _ones(places)


def _ones(places: Collection[int]) -> int:
    """A number whose bytes are full in these places."""
    return sum(0xFF << 8 * place for place in places)


_LOOKED_AT: Final = {
    kind: _looked_at(kind) for kind in (Kind.NODE_FRAME2, Kind.NODE_FRAME3, Kind.NODE_FRAME5)
}


class HeadSteps:
    """The heads of one module's frames."""

    def __init__(self) -> None:
        self._last: FrameHead | None = None
        self._waiting: list[FrameHead] = []
        self._changing = dict.fromkeys(_LOOKED_AT, 0)
        """Ones in the bytes that have changed."""

    def goes_on(self, head: FrameHead) -> list[FrameHead] | None:
        """Heads that are now believed besides this one, oldest first; None while it waits."""
        last = self._last
        if last is None or head.utime - last.utime > REMEMBERED_US or last.kind is not head.kind:
            believed: list[FrameHead] = []
        elif not self._breaks(last, head):
            believed = []
        elif self._waiting and not self._breaks(self._waiting[-1], head):
            believed = self._waiting[-1:]
        elif len(self._waiting) < PATIENCE:
            self._waiting.append(head)
            return None
        else:
            believed = self._waiting[-1:]
        if last is not None and last.kind is head.kind:
            self._note_changes(last, head)
        self._last, self._waiting = head, []
        return believed

    def _note_changes(self, before: FrameHead, now: FrameHead) -> None:
        bits = self._changed(before, now)
        if bits:
            size, _ = _LOOKED_AT[now.kind]
            places = [place for place, byte in enumerate(bits.to_bytes(size, "little")) if byte]
            self._changing[now.kind] |= _ones(places)

    def _changed(self, before: FrameHead, now: FrameHead) -> int:
        """Bits that differ, in bytes that never did before."""
        return (before.still ^ now.still) & ~self._changing[now.kind]

    def _breaks(self, before: FrameHead, now: FrameHead) -> bool:
        if abs(now.volts - before.volts) > VOLTAGE_STEP_V:
            return True
        if before.lead_ms is not None and now.lead_ms is not None:
            step = wrapped_difference(now.lead_ms, before.lead_ms, TIME_BITS)
            if abs(step) > LEAD_STEP_MS:
                return True
        return self._changed(before, now) != 0


class _Reported(NamedTuple):
    utime: int
    metres: float
    powers: tuple[float, float]
    role: int
    age_ms: int

    def breaks(self, now: _Reported) -> bool:
        """Does `now` not follow this one?"""
        passed_s = (now.utime - self.utime) / SECOND_US
        (first_path, received), (first_path_before, received_before) = now.powers, self.powers
        return (
            now.role != self.role
            or abs(now.metres - self.metres) > RANGE_STEP_M + RANGE_SPEED_MPS * passed_s
            or abs(first_path - first_path_before) > POWER_STEP_DB
            or abs(received - received_before) > POWER_STEP_DB
            or abs(wrapped_difference(now.age_ms, self.age_ms, TIME_BITS)) > AGE_STEP_MS
        )


class RangeSteps:
    """The ranges of one module, by peer."""

    def __init__(self) -> None:
        self._last: dict[int, _Reported] = {}
        self._waiting: dict[int, _Reported] = {}
        self._began: int | None = None

    def goes_on(self, node: Mapping[str, Any], system_ms: int, utime: int) -> bool:
        """May this range be believed now?

        Args:
            system_ms: of its frame.
        """
        age_ms = system_ms - node.get("system_time_ms", system_ms)
        powers = node["fp_rssi_db"], node["rx_rssi_db"]
        entry = _Reported(utime, node["distance_m"], powers, node["role"], age_ms)
        peer: int = node["id"]
        if self._began is None:
            self._began = utime
        last, waiting = self._fresh(self._last, peer, utime), self._waiting.pop(peer, None)
        if waiting is not None and utime - waiting.utime > PEER_REMEMBERED_US:
            waiting = None
        is_new = last is None and utime - self._began > SETTLED_US
        breaks = is_new if last is None else last.breaks(entry)
        if breaks and (waiting is None or waiting.breaks(entry)):
            self._keep(self._waiting, peer, entry)
            return False
        self._keep(self._last, peer, entry)
        return True

    def _fresh(self, known: dict[int, _Reported], peer: int, utime: int) -> _Reported | None:
        entry = known.get(peer)
        return entry if entry is not None and utime - entry.utime <= PEER_REMEMBERED_US else None

    def _keep(self, known: dict[int, _Reported], peer: int, entry: _Reported) -> None:
        if peer not in known and len(known) >= MAX_PEERS:
            known.clear()
        known[peer] = entry
