"""What is wrong with the LinkTrack module, in one sentence with a remedy.

Only the present counts: a good frame wipes out what was wrong before it, and one odd frame in a
stream of noise is not yet a finding. The judges are asked in the order of `advice`; the first that
has something to say is heard.
"""

from __future__ import annotations

import re
from collections import Counter
from enum import Enum
from typing import Final, NamedTuple

from drslamd.conventions import SECOND_US
from drslamd.sensors.linktrack.codec import Refusal
from drslamd.sensors.linktrack.linktrack_frames import ModuleFault

SILENCE_US: Final = 2 * SECOND_US
"""The slowest update rate of a module is 1 Hz."""
NO_FRAME_US: Final = 5 * SECOND_US
"""Bytes for this long without a ranging frame are a finding."""
REPEATED: Final = 3
"""So many refusals for one reason, without a good frame among them, are a finding."""
FAULT_SHOWN_US: Final = 60 * SECOND_US
"""How long a fault that the module reported is repeated; modules report it once."""

_NMEA: Final = re.compile(rb"\$GP(?:GGA|GSA|RMC),")
_NMEA_BYTES: Final = len("$GPGGA,")

_HEADS: Final = {
    b"\x55\xa0": "LinkTrack's firmware of 2018 printed: update it with NAssistant",
    b"\x57\x00": "a Nooploop TOFSense prints: is uwb.port the right one?",
    b"\x6a\x00": "a Nooploop IOT module prints: is uwb.port the right one?",
}
"""With which frames begin that are none of ours, and whose they are."""
HEADS_LEAST: Final = 5
HEADS_APART: Final = 1_000
"""On average in bytes: no frame is longer. Random bytes hold one in 65,536."""

_OUTPUT: Final = "with NAssistant set it to DR_MODE0 and NODE_FRAME3, or DR_MODE1 and NODE_FRAME5"

_REMEDIES: Final = {
    Refusal.LP_MODE: "the UWB module is in LP mode (it prints {detail}) and ranges only to "
    "anchors: " + _OUTPUT,
    Refusal.UNKNOWN_KIND: "the UWB module prints frames of kind {detail}, which drslamd does not "
    "use: " + _OUTPUT,
    Refusal.WRONG_ID: "the UWB module has id {detail} but uwb.id is {own_id}: correct uwb.id, or "
    "the id of the module with NAssistant",
    Refusal.VOLTAGE: "the UWB module reports a supply of {detail}: it needs 3.6 to 5.5 V",
    Refusal.TIME: "the clock of the UWB module jumps again and again: does it restart, is its "
    "supply too weak?",
    Refusal.ENTRIES: "the UWB module prints damaged {detail}: is its firmware up to date?",
}

_FAULT_REMEDIES: Final = {
    ModuleFault.DUPLICATE_ID: "the UWB module found its id in use by another module: give each "
    "module its own id with NAssistant",
    ModuleFault.HARDWARE: "the UWB module reports a hardware fault: switch it off and on, then "
    "replace it",
    ModuleFault.UWB_TRANSMIT: "the UWB module cannot transmit: switch it off and on, then replace "
    "it",
    ModuleFault.RESTART: "the UWB module has restarted by itself: check its supply",
    ModuleFault.USER_DATA_TOO_LONG: "something writes to the serial port of the UWB module: close "
    "the other program (ModemManager?)",
}
"""In the order of what hurts most."""


class Oddity(Enum):
    """What good frames say that should not be so."""

    LP_ROLES = (
        "the UWB module has the role TAG and all its partners the role ANCHOR, as in the LP modes, "
        "in which it ranges only to anchors: if nobody gave them these labels, " + _OUTPUT
    )
    OWN_ID = "another UWB module has id {detail}, too: give each module its own id with NAssistant"
    TWICE = (
        "two UWB modules have id {detail}: distances to both come in one frame; give each module "
        "its own id with NAssistant"
    )


class _Odd(NamedTuple):
    """The last oddity, and how often it came without a pause."""

    oddity: Oddity
    detail: str
    times: int
    utime: int


class _Trouble(NamedTuple):
    """The last refusal, and how often it was for that reason without a pause or a good frame."""

    reason: Refusal
    detail: str
    times: int
    utime: int


class LinkTrackWatch:
    """Watches what comes and says what a person can do about it.

    Attributes:
        wrong_mode: what was last printed that a module prints only in the LP modes.
    """

    def __init__(self, uwb_id: int, line: str = "") -> None:
        self._uwb_id = uwb_id
        self._where = f" on {line}" if line else ""
        self._last_byte: int | None = None
        self._trying_since = 0
        self._trouble: _Trouble | None = None
        self._fault: tuple[ModuleFault, int] | None = None
        self._odd: _Odd | None = None
        self._text = b""
        self._last = b""
        self._strange: Counter[bytes] = Counter()
        self._strange_bytes = 0
        self.wrong_mode: str | None = None

    def on_bytes(self, data: bytes, utime: int) -> None:
        if not data:
            return
        if self._last_byte is None or utime - self._last_byte > SILENCE_US:
            self._try_anew(utime)
        self._last_byte = utime
        self._strange_bytes += len(data)
        seen = self._last + data
        for head in _HEADS:
            if count := seen.count(head):
                self._strange[head] += count
        self._last = data[-1:]
        text = self._text + data
        for _ in _NMEA.finditer(text):
            self.on_refused(Refusal.LP_MODE, "NMEA sentences", utime)
        self._text = text[1 - _NMEA_BYTES :]

    def _try_anew(self, utime: int) -> None:
        self._trying_since, self._strange_bytes = utime, 0
        self._strange.clear()

    def on_good_frame(self, utime: int) -> None:
        self._try_anew(utime)
        self._trouble = None
        self.wrong_mode = None

    def on_refused(self, reason: Refusal, detail: str, utime: int) -> None:
        before, times = self._trouble, 1
        if before and before.reason is reason and utime - before.utime <= NO_FRAME_US:
            times += before.times
        self._trouble = _Trouble(reason, detail, times, utime)
        if reason is Refusal.LP_MODE:
            self.wrong_mode = detail

    def on_odd(self, oddity: Oddity, detail: str, utime: int) -> None:
        before, times = self._odd, 1
        if before and before.oddity is oddity and utime - before.utime <= NO_FRAME_US:
            times += before.times
        self._odd = _Odd(oddity, detail, times, utime)

    def on_fault(self, faults: ModuleFault, utime: int) -> None:
        self._fault = (faults, utime)

    def advice(self, utime: int) -> str | None:
        """One sentence about the present trouble, or None."""
        for judge in (
            self._silence,
            self._refusals,
            self._module_faults,
            self._oddities,
            self._strange_frames,
            self._no_frames,
        ):
            if sentence := judge(utime):
                return sentence
        return None

    def _silence(self, utime: int) -> str | None:
        if self._last_byte is None:
            return "no bytes from the UWB module yet: check its power, the cable and uwb.port"
        silent_us = utime - self._last_byte
        if silent_us <= SILENCE_US:
            return None
        seconds = silent_us // SECOND_US
        return f"no bytes from the UWB module for {seconds} s: check its power and the cable"

    def _refusals(self, utime: int) -> str | None:
        trouble = self._trouble
        if trouble is None or trouble.times < REPEATED or utime - trouble.utime > NO_FRAME_US:
            return None
        sentence = _REMEDIES.get(trouble.reason, "the frames of the UWB module have {detail}")
        return sentence.format(detail=trouble.detail, own_id=shown_id(self._uwb_id))

    def _module_faults(self, utime: int) -> str | None:
        if self._fault is None or utime - self._fault[1] > FAULT_SHOWN_US:
            return None
        faults = self._fault[0]
        return next((text for bit, text in _FAULT_REMEDIES.items() if bit in faults), None)

    def _oddities(self, utime: int) -> str | None:
        odd = self._odd
        if odd is None or odd.times < REPEATED or utime - odd.utime > NO_FRAME_US:
            return None
        return odd.oddity.value.format(detail=odd.detail)

    def _strange_frames(self, utime: int) -> str | None:
        if utime - self._trying_since < NO_FRAME_US or not self._strange:
            return None
        ((head, count),) = self._strange.most_common(1)
        if count < HEADS_LEAST or count * HEADS_APART < self._strange_bytes:
            return None
        return (
            f"no ranging frame from the UWB module, but {head.hex(' ').upper()} again and again, "
            f"as {_HEADS[head]}"
        )

    def _no_frames(self, utime: int) -> str | None:
        seconds = (utime - self._trying_since) // SECOND_US
        if utime - self._trying_since < NO_FRAME_US:
            return None
        return (
            f"bytes but no ranging frame from the UWB module{self._where} for {seconds} s: is "
            "uwb.baud right (921600 unless it was changed), is its output NODE_FRAME3 or "
            "NODE_FRAME5?"
        )


def shown_id(uwb_id: int) -> str:
    """An id as NAssistant shows it: 8-bit ids in decimal, 32-bit ids as 8 hex digits."""
    return str(uwb_id) if uwb_id <= 0xFF else f"0x{uwb_id:08X}"
