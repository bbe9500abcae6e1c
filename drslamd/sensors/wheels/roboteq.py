"""Roboteq motor controllers over their serial port: asked, they tell both absolute counters.

Source: Roboteq Advanced Digital Motor Controller manual. Commands and replies end with CR. The
query ``?C`` is answered ``C=<channel 1>:<channel 2>``, signed 32 bit; it is preferred to ``?CR``,
whose answer, when lost, takes its distance with it. A controller echoes commands until
``^ECHOF 1`` stops it, and again after it was switched off; ``+`` and ``-`` say that a command was
accepted or refused. There is no time in a reply and no checksum: samples carry the arrival time,
and a damaged number is left to the plausibility checks of `wheel_base`.

``?C`` are the counters of encoders. Motors with hall sensors alone are counted by ``?CB`` in the
same form, and their ``?C`` stays 0:0 for ever, as that of a base that has not moved yet does. So
while it is 0:0 the other one is asked as well, now and then.
"""

from __future__ import annotations

import re
from typing import Final, Literal

from drslamd.conventions import SECOND_US
from drslamd.sensors.line_scanner import LineScanner
from drslamd.sensors.samples import WheelCounts, WheelSample
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.wheel_driver import Outcome, PolledDriver, WheelRefusal, tallied

COUNTER_BITS: Final = 32

Counter = Literal["encoder", "hall"]

AT_ZERO_US: Final = 10 * SECOND_US
"""Counters that are both exactly 0 for so long are worth a word."""
ASK_OTHER_US: Final = SECOND_US

_KEYS: Final[dict[Counter, bytes]] = {"encoder": b"C", "hall": b"CB"}
_OTHERS: Final[dict[Counter, Counter]] = {"encoder": "hall", "hall": "encoder"}
_ECHO_OFF: Final = b"^ECHOF 1\r"
_REFUSED: Final = b"-"
_REPLY: Final = re.compile(rb"CB?=(-?\d{1,10}):(-?\d{1,10})")


class RoboteqDriver(PolledDriver):
    """`WheelCounts` of 32 bits; ``poll`` has to be called and its bytes written.

    Args:
        poll_hz: how often to ask.
        swap_channels: channel 1 drives the right wheels.
        counter: which counters to ask for.
    """

    def __init__(self, poll_hz: float, swap_channels: bool, counter: Counter = "encoder") -> None:
        self._period_us = round(SECOND_US / poll_hz)
        self._swap_channels = swap_channels
        self._counter, self._other = counter, _OTHERS[counter]
        key = _KEYS[counter]
        self._query, self._key, self._other_key = b"?" + key, key + b"=", _KEYS[self._other] + b"="
        self.expects = f"answers {key.decode()}=<left>:<right> to the query ?{key.decode()}"
        self._lines = LineScanner()
        self._due = 0
        self._ask_other_at = 0
        self._echoes = True
        self._refused_utime: int | None = None
        self._zero_since: int | None = None
        self._zero_until = 0
        self._other_counts: tuple[int, int] | None = None
        self.tally: Tally[WheelRefusal] = Tally()

    def feed(self, data: bytes, utime: int) -> list[WheelSample]:
        samples = []
        for line in self._lines.feed(data):
            self._echoes = self._echoes or line == self._query
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
        return start + self._query + b"\r" + self._question_to_the_other(utime)

    def fault(self) -> str | None:
        if self._zero_since is None or self._other_counts == (0, 0):
            return None
        if self._other_counts is not None:
            return (
                f"the {self._counter} counters of the Roboteq stand at 0:0 while its "
                f'{self._other} counters count: set wheels.counter = "{self._other}"'
            )
        if self._zero_until - self._zero_since < AT_ZERO_US:
            return None
        return (
            f"both {self._counter} counters of the Roboteq are 0 since they are asked for: if the "
            f"base has driven, nothing is connected to them; with {self._other} counters alone set "
            f'wheels.counter = "{self._other}"'
        )

    def why_no_sample(self, utime: int) -> str | None:
        if self._refused_utime is not None and utime - self._refused_utime <= SECOND_US:
            return (
                f"the Roboteq refuses the query {self._query.decode()}: its motors have no "
                f"{self._counter} counters, or its firmware is too old; is wheels.counter right?"
            )
        return None

    def _question_to_the_other(self, utime: int) -> bytes:
        if self._zero_since is None or utime < self._ask_other_at:
            return b""
        self._ask_other_at = utime + ASK_OTHER_US
        return b"?" + _KEYS[self._other] + b"\r"

    def _decode(self, line: bytes, utime: int) -> Outcome:
        if line == _REFUSED:
            self._refused_utime = utime
        if not line.startswith((self._key, self._other_key)):
            return None
        counts = _counts(line)
        if line.startswith(self._other_key):
            self._other_counts = counts
            return None
        if counts is None:
            return WheelRefusal.MALFORMED
        self._note_zero(counts, utime)
        first, second = counts
        left, right = (second, first) if self._swap_channels else (first, second)
        return [WheelCounts(utime, left, right, COUNTER_BITS)]

    def _note_zero(self, counts: tuple[int, int], utime: int) -> None:
        if any(counts):
            self._zero_since = self._other_counts = None
            return
        self._zero_until = utime
        if self._zero_since is None:
            self._zero_since = utime
            self._ask_other_at = utime + ASK_OTHER_US


def _counts(line: bytes) -> tuple[int, int] | None:
    """Of both channels, None where the line is not of that form."""
    match = _REPLY.fullmatch(line)
    if match is None:
        return None
    first, second = int(match[1]), int(match[2])
    return (first, second) if _fits(first) and _fits(second) else None


def _fits(count: int) -> bool:
    return -(1 << (COUNTER_BITS - 1)) <= count < 1 << (COUNTER_BITS - 1)
