"""Roboteq motor controllers over their serial port: asked, they tell both absolute counters.

Source: Roboteq Advanced Digital Motor Controller manual. Commands and replies end with CR. The
query ``?C`` is answered ``C=<channel 1>:<channel 2>``, signed 32 bit; it is preferred to ``?CR``,
whose answer, when lost, takes its distance with it. A controller echoes commands until
``^ECHOF 1`` stops it, and again after it was switched off; ``+`` and ``-`` say that a command was
accepted or refused. There is no time in a reply and no checksum: samples carry the arrival time,
and a damaged number is left to the plausibility checks of `wheel_base`.
"""

from __future__ import annotations

import re
from typing import Final

from drslamd.conventions import SECOND_US
from drslamd.sensors.line_scanner import LineScanner
from drslamd.sensors.samples import WheelCounts, WheelSample
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.wheel_driver import Outcome, PolledDriver, WheelRefusal, tallied

COUNTER_BITS: Final = 32

_QUERY: Final = b"?C"
_ECHO_OFF: Final = b"^ECHOF 1\r"
_KEY: Final = b"C="
_REPLY: Final = re.compile(rb"C=(-?\d{1,10}):(-?\d{1,10})")


class RoboteqDriver(PolledDriver):
    """`WheelCounts` of 32 bits; ``poll`` has to be called and its bytes written.

    Args:
        poll_hz: how often to ask.
        swap_channels: channel 1 drives the right wheels.
    """

    expects: str = "answers C=<left>:<right> to the query ?C"

    def __init__(self, poll_hz: float, swap_channels: bool) -> None:
        self._period_us = round(SECOND_US / poll_hz)
        self._swap_channels = swap_channels
        self._lines = LineScanner()
        self._due = 0
        self._echoes = True
        self.tally: Tally[WheelRefusal] = Tally()

    def feed(self, data: bytes, utime: int) -> list[WheelSample]:
        samples = []
        for line in self._lines.feed(data):
            self._echoes = self._echoes or line == _QUERY
            samples += tallied(self.tally, self._decode(line, utime))
        self.tally.set_refused(WheelRefusal.OVERLONG, self._lines.overlong)
        return samples

    def poll(self, utime: int) -> bytes:
        """The query when it is due, after the command that stops echoes where it is needed."""
        if utime < self._due:
            return b""
        self._due += self._period_us
        if self._due <= utime:  # the first time, or held up: no burst to catch up
            self._due = utime + self._period_us
        start, self._echoes = _ECHO_OFF if self._echoes else b"", False
        return start + _QUERY + b"\r"

    def _decode(self, line: bytes, utime: int) -> Outcome:
        if not line.startswith(_KEY):
            return None
        match = _REPLY.fullmatch(line)
        if match is None:
            return WheelRefusal.MALFORMED
        first, second = int(match[1]), int(match[2])
        if not _fits(first) or not _fits(second):
            return WheelRefusal.MALFORMED
        left, right = (second, first) if self._swap_channels else (first, second)
        return [WheelCounts(utime, left, right, COUNTER_BITS)]


def _fits(count: int) -> bool:
    return -(1 << (COUNTER_BITS - 1)) <= count < 1 << (COUNTER_BITS - 1)
