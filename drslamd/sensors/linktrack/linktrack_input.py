"""Bytes of a LinkTrack module in, believable ranges out.

A module in DR_MODE0 prints NODE_FRAME2 or NODE_FRAME3, in DR_MODE1 NODE_FRAME5: its own distances
to all others. The one checksum byte of a frame lets one damaged frame in 256 pass, so a frame is
used only when all of this holds as well:

1. it comes from the module that the configuration names,
2. the supply voltage is one on which a module lives,
3. its local time continues that of the frame before, which asks for two frames after a start,
4. what goes on from frame to frame goes on, or the next frame says the same (`continuity`).

The role byte is a free label in the DR modes and no reason, unless it changes from one frame to the
next. Whatever is turned away is counted under one reason. A range is stamped with the time at which
the module measured it.

This is the border for numbers: every range passes `LinkTrackInput.feed`, and each one that leaves
it is finite and within the limits of the module, whatever a table says of how numbers are sent.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from operator import itemgetter
from statistics import median
from typing import Any, Final

from drslamd.conventions import MILLISECOND_US
from drslamd.sensors.device_clock import WINDOW_US, DeviceClock
from drslamd.sensors.frame_scanner import FrameScanner
from drslamd.sensors.linktrack import continuity
from drslamd.sensors.linktrack.codec import LINKTRACK, Frame, Refusal, decode_intact
from drslamd.sensors.linktrack.linktrack_advice import LinkTrackWatch, Oddity, shown_id
from drslamd.sensors.linktrack.linktrack_frames import EMPTY_ID, Kind, ModuleFault
from drslamd.sensors.samples import RangeSample
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.wrapping import wrapped_difference

MIN_VOLTAGE_V: Final = 3.3
MAX_VOLTAGE_V: Final = 6.0
"""The selection guide allows 3.6 to 5.5 V; the margin is for the module's own voltmeter."""
MIN_RANGE_M: Final = -0.5
"""Near contact a module may print slightly negative distances."""

TIME_BITS: Final = 32
SYSTEM_TIME_PERIOD_US: Final = (1 << TIME_BITS) * MILLISECOND_US
"""Both stamps of a module are u32 milliseconds and wrap after 49.7 days."""

HEALTH_BITS: Final = (
    ModuleFault.DUPLICATE_ID
    | ModuleFault.RESTART
    | ModuleFault.HARDWARE
    | ModuleFault.UWB_TRANSMIT
    | ModuleFault.USER_DATA_TOO_LONG
)

ONE_MODULE_M: Final = 3.0
"""Distances to one id in one frame differ by noise and reflections; by more, they are to two."""
_TAG: Final = 2
_ANCHOR: Final = 1
_SHORT_IDS: Final = (Kind.NODE_FRAME2, Kind.NODE_FRAME3)
"""(Of so few each frame finds its own without a hash.)"""
_measured: Final = itemgetter("distance_m", "fp_rssi_db", "rx_rssi_db")
_RANGING: Final = (*_SHORT_IDS, Kind.NODE_FRAME5)
_REFUSED_KINDS: Final = {
    Kind.ANCHOR_FRAME0: Refusal.LP_MODE,
    Kind.TAG_FRAME0: Refusal.LP_MODE,
    Kind.NODE_FRAME1: Refusal.LP_MODE,
    Kind.NODE_FRAME4: Refusal.LP_MODE,
    Kind.AOA_NODE_FRAME0: Refusal.UNKNOWN_KIND,
}


NEWER_KINDS: Final = {"55 0B": "55 0B (NODE_FRAME7 of newer firmware)"}
"""Marks of frames whose layout nobody has published."""


class RangeRefusal(Enum):
    """Why one entry of a good frame gives no sample of its own."""

    EMPTY = "marked as not valid by the module"
    SELF = "a range to itself"
    NOT_FINITE = "a value that is not a finite number"
    LIMITS = "a distance that this kind of module cannot measure"
    STEP = "a step from the range before that the next one has not confirmed"
    DUPLICATE = "further distance to the same module, taken into the median"


class LinkTrackInput:
    """The UWB sensor of one robot.

    Args:
        uwb_id: the 8-bit id of its module in DR_MODE0, the 32-bit one in DR_MODE1.
        max_range_m: longest distance that is believed.
        line: what it is read from, for sentences.

    Attributes:
        frames: intact frames; accepted are those with ranges, ignored those that carry none.
        ranges: entries of accepted frames; accepted ones became samples.
        bytes_received: all bytes since the start.
        last_good_utime: when the last accepted frame arrived.
        foreign_id: the last id in a frame that was not `uwb_id`.
        voltage_v: supply of the module in the last accepted frame.
        module_faults: what the last ERROR_FRAME0 said, of the bits that concern the DR modes.
    """

    def __init__(self, uwb_id: int, max_range_m: float, line: str = "") -> None:
        self._uwb_id = uwb_id
        self._max_range_m = max_range_m
        self._scanner = FrameScanner(LINKTRACK)
        self._clock = DeviceClock(TIME_BITS, MILLISECOND_US)
        self._watch = LinkTrackWatch(uwb_id, line)
        self._lead_ms: int | None = None
        self._lead_is_steady = False
        self._heads, self._steps = continuity.HeadSteps(), continuity.RangeSteps()
        self.frames: Tally[Refusal] = Tally()
        self.ranges: Tally[RangeRefusal] = Tally()
        self.bytes_received = 0
        self.last_good_utime: int | None = None
        self.foreign_id: int | None = None
        self.voltage_v: float | None = None
        self.module_faults = ModuleFault(0)

    def feed(self, data: bytes, utime: int) -> list[RangeSample]:
        """Ranges in the frames that `data`, which arrived at `utime` (us), completes."""
        self.bytes_received += len(data)
        self._watch.on_bytes(data, utime)
        samples = []
        for frame in self._scanner.feed(data, utime):
            samples += self._on_frame(frame, utime)
        return samples

    @property
    def wrong_mode(self) -> str | None:
        """What the module prints that belongs to the LP modes, since the last good frame."""
        return self._watch.wrong_mode

    def advice(self, utime: int) -> str | None:
        """One sentence about the present trouble and its remedy, or None.

        Ask once the port has been open for some seconds: before, silence is no trouble.
        """
        return self._watch.advice(utime)

    def system_offset_us(self, utime: int) -> int | None:
        """Time of this host minus system_time of the modules, microseconds.

        In DR_MODE0 all modules of a team share one system_time, so ``utime - offset`` is the same
        on all robots, modulo `SYSTEM_TIME_PERIOD_US`; error as in `device_clock`, and 1 ms for the
        resolution of the stamp. None in DR_MODE1, without a good frame during the last few
        seconds, and from a jump of system_time until the next frame confirms the new time base.
        """
        offset_us = self._clock.offset_us
        if self.last_good_utime is None or utime - self.last_good_utime > WINDOW_US:
            return None
        if offset_us is None or self._lead_ms is None or not self._lead_is_steady:
            return None
        return offset_us - self._lead_ms * MILLISECOND_US

    def counters(self) -> dict[str, int]:
        """Everything that is counted, by flat names."""
        return {
            "bytes": self.bytes_received,
            "garbage_bytes": self._scanner.garbage_bytes,
            "bad_checksums": self._scanner.bad_checksums,
            "module_restarts": self._clock.restarts,
            **self.frames.counters("frames"),
            **self.ranges.counters("ranges"),
        }

    def _on_frame(self, data: bytes, utime: int) -> list[RangeSample]:
        frame = decode_intact(data)
        if isinstance(frame, Refusal):
            mark = data[:2].hex(" ").upper()
            return self._refuse(frame, NEWER_KINDS.get(mark, mark), utime)
        if frame.kind in _RANGING:
            return self._on_ranging(data, frame, utime)
        if frame.kind in _REFUSED_KINDS:
            return self._refuse(_REFUSED_KINDS[frame.kind], frame.kind.name, utime)
        if frame.kind is Kind.ERROR_FRAME0:
            self.module_faults = HEALTH_BITS & frame.values["error_bits"]
            self._watch.on_fault(self.module_faults, utime)
        self.frames.ignored += 1
        return []

    def _on_ranging(self, data: bytes, frame: Frame, utime: int) -> list[RangeSample]:
        """Checks everything, then takes everything."""
        values = frame.values
        if values["id"] != self._uwb_id:
            self.foreign_id = values["id"]
            return self._refuse(Refusal.WRONG_ID, shown_id(values["id"]), utime)
        if not MIN_VOLTAGE_V <= values["voltage_v"] <= MAX_VOLTAGE_V:
            return self._refuse(Refusal.VOLTAGE, f"{values['voltage_v']:.1f} V", utime)
        lead_ms = _lead_ms(frame)
        steady_ms = lead_ms if self._lead_is_steady else None
        head = continuity.head_of(data, frame, steady_ms, utime)
        believed = self._heads.goes_on(head)
        if believed is None:
            return self._refuse(Refusal.STEP, "", utime)
        for waited in believed:
            self._clock.to_host(waited.local_ms, waited.utime)
        measured = self._clock.to_host(values["local_time_ms"], utime)
        if measured is None:
            return self._refuse(Refusal.TIME, "", utime)
        self.frames.accepted += 1
        self.last_good_utime = utime
        self.voltage_v = values["voltage_v"]
        self._follow_system_time(lead_ms)
        self._watch.on_good_frame(utime)
        self._look_for_oddities(frame, utime)
        return self._samples(frame, measured)

    def _look_for_oddities(self, frame: Frame, utime: int) -> None:
        """The role is a free label in the DR modes: nothing is refused for it."""
        nodes = frame.values["nodes"]
        if nodes and frame.values["role"] == _TAG and all(n["role"] == _ANCHOR for n in nodes):
            self._watch.on_odd(Oddity.LP_ROLES, "", utime)
        ids = {node["id"] for node in nodes}
        if self._uwb_id in ids:
            self._watch.on_odd(Oddity.OWN_ID, shown_id(self._uwb_id), utime)
        if len(ids) == len(nodes):
            return
        heard: dict[int, list[float]] = {}
        for node in nodes:
            heard.setdefault(node["id"], []).append(node["distance_m"])
        for uwb_id, metres in heard.items():
            is_empty = uwb_id == EMPTY_ID and frame.kind in _SHORT_IDS
            if not is_empty and max(metres) - min(metres) > ONE_MODULE_M:
                self._watch.on_odd(Oddity.TWICE, shown_id(uwb_id), utime)

    def _refuse(self, reason: Refusal, detail: str, utime: int) -> list[RangeSample]:
        self.frames.refuse(reason)
        self._watch.on_refused(reason, detail, utime)
        return []

    def _follow_system_time(self, lead_ms: int | None) -> None:
        """system_time leads local_time by a constant until one of the two starts anew."""
        before, self._lead_ms = self._lead_ms, lead_ms
        self._lead_is_steady = (
            before is not None
            and lead_ms is not None
            and abs(wrapped_difference(lead_ms, before, TIME_BITS)) <= continuity.LEAD_STEP_MS
        )

    def _samples(self, frame: Frame, measured: int) -> list[RangeSample]:
        """One sample for each peer, in the order of the frame (at most 255 entries)."""
        by_peer: dict[int, list[Mapping[str, Any]]] = {}
        for node in frame.values["nodes"]:
            if reason := self._entry_refusal(frame.kind, node):
                self.ranges.refuse(reason)
            else:
                by_peer.setdefault(node["id"], []).append(node)
        samples, system_ms = [], frame.values["system_time_ms"]
        for peer, nodes in by_peer.items():
            sample = _sample(measured, peer, nodes)
            entry = nodes[0] if len(nodes) == 1 else {**nodes[0], "distance_m": sample.range_m}
            if not self._steps.goes_on(entry, system_ms, measured):
                self.ranges.refuse(RangeRefusal.STEP, len(nodes))
                continue
            samples.append(sample)
            if len(nodes) > 1:
                self.ranges.refuse(RangeRefusal.DUPLICATE, len(nodes) - 1)
        self.ranges.accepted += len(samples)
        return samples

    def _entry_refusal(self, kind: Kind, node: Mapping[str, Any]) -> RangeRefusal | None:
        if node["id"] == EMPTY_ID and kind in _SHORT_IDS:
            return RangeRefusal.EMPTY
        if node["id"] == self._uwb_id:
            return RangeRefusal.SELF
        metres, first_path_db, all_db = _measured(node)
        if not (math.isfinite(metres) and math.isfinite(first_path_db) and math.isfinite(all_db)):
            return RangeRefusal.NOT_FINITE
        if not MIN_RANGE_M <= metres <= self._max_range_m:
            return RangeRefusal.LIMITS
        return None


def _lead_ms(frame: Frame) -> int | None:
    """Of system_time before local_time, where both are told."""
    if frame.kind not in _SHORT_IDS:
        return None
    system_ms, local_ms = frame.values["system_time_ms"], frame.values["local_time_ms"]
    return wrapped_difference(system_ms, local_ms, TIME_BITS)


def _sample(measured: int, peer: int, nodes: list[Mapping[str, Any]]) -> RangeSample:
    if len(nodes) == 1:
        metres, first_path_db, all_db = _measured(nodes[0])
        return RangeSample(measured, peer, metres, all_db - first_path_db)
    return RangeSample(
        utime=measured,
        peer_uwb_id=peer,
        range_m=median(node["distance_m"] for node in nodes),
        power_gap_db=median(node["rx_rssi_db"] - node["fp_rssi_db"] for node in nodes),
    )
