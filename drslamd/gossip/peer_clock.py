"""How far a peer's clock is from ours, out of the messages themselves.

A message that left at s on the peer's clock and arrived at r on ours shows r - s = delay - offset
(offset: peer's clock minus ours). The smallest of many has almost no delay. The peer tells us the
smallest that it sees of our messages, offset + delay; half the difference of both is the offset
and half their sum is how wrong it can be. LinkTrack's `system_time` gives the same without the
network's delays: both robots know their own clock minus that of the radio system. It counts modulo
49.7 days and only where both modules are in one radio network; the messages tell.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.sensors.linktrack.linktrack_input import SYSTEM_TIME_PERIOD_US

WINDOW_S = 16
"""Over which the smallest delay is taken."""
DRIFT_US = 3_200
"""What clocks that drift apart by 200 ppm move in that time; either delay may be so old ..."""
AGEING = 10_000
"""... and what the peer said grows older until it says it anew: half of 200 ppm, as a divisor."""
ONE_WAY_UNCERTAINTY_US = 100 * MILLISECOND_US
"""What is claimed while the peer has not yet said how it hears us."""
RADIO_UNCERTAINTY_US = 3 * MILLISECOND_US
"""LinkTrack stamps in whole milliseconds, on both sides, plus the serial lines' least delay."""
RADIO_FRESH_US = 5 * SECOND_US

JUMP_US = 50 * MILLISECOND_US
"""Both ways together that much less than no time at all: one of both clocks has jumped, or stood
while its computer slept. Drift and all that is late here come to a third of it."""
LATE_US = 250 * MILLISECOND_US
"""Two messages in a row that much later than the fastest: is it the network, or did a clock jump?
Until that is known, all of it is claimed ..."""
VERY_LATE_US = SECOND_US
"""... and after one message that is so late, until the next one comes."""


@dataclass(frozen=True)
class Offset:
    """Peer's clock minus ours, and how wrong that may be, us."""

    us: int
    uncertainty_us: int
    source: str


class PeerClock:
    """One peer's clock against ours.

    Attributes:
        since: from when on our clock the offset holds: either clock jumped before, us.
        delay_us: our smallest (arrival here - stamp of the peer), to be told to the peer.
    """

    def __init__(self) -> None:
        self.since = 0
        self._smallest: deque[tuple[int, int]] = deque()
        """(second, smallest arrival - stamp in it), at most `WINDOW_S` of them."""
        self.delay_us: int | None = None
        self._last_two: deque[int] = deque(maxlen=2)
        self._arrived = 0
        self._echo: tuple[int, int] | None = None
        self._radio: tuple[int, int] | None = None

    def on_message(self, sent: int, arrived: int) -> None:
        """A message straight from the peer: its stamp, and its arrival on our clock."""
        second, value = arrived // SECOND_US, arrived - sent
        self._last_two.append(value)
        if self._smallest and self._smallest[-1][0] == second:
            value = min(value, self._smallest.pop()[1])
        self._smallest.append((second, value))
        while self._smallest[0][0] <= second - WINDOW_S:
            self._smallest.popleft()
        self.delay_us = min(value for _, value in self._smallest)
        self._arrived = arrived
        self._notice_jump()

    def echoed(self, echo: tuple[int, int] | None) -> None:
        """The peer's own smallest (arrival there - our stamp), and when it said so; None when it
        does not hear us."""
        self._echo = echo
        self._notice_jump()

    def begin_again(self, utime: int) -> None:
        """Our own clock may have jumped: nothing that was known holds any more."""
        self._smallest.clear()
        self.delay_us = None
        self._last_two.clear()
        self._echo = self._radio = None
        self.since = utime

    def _notice_jump(self) -> None:
        """Begin again with the last message where both ways take less than no time; what the peer
        said is older than the jump where they still do."""
        if not self._contradicts_itself():
            return
        self.since = self._arrived
        self.delay_us = self._last_two[-1]
        self._smallest = deque([(self._arrived // SECOND_US, self.delay_us)])
        if self._contradicts_itself():
            self._echo = None

    def _contradicts_itself(self) -> bool:
        incoming = self.delay_us
        return (
            self._echo is not None
            and incoming is not None
            and (self._echo[0] + incoming < -JUMP_US)
        )

    def radio(self, own_minus_system: int, peer_minus_system: int, utime: int) -> None:
        """Both clocks against LinkTrack's system_time, each modulo its period."""
        self._radio = (peer_minus_system - own_minus_system, utime)

    def offset(self, utime: int) -> Offset | None:
        """The best of what is known, or None before the first message."""
        incoming = self.delay_us
        if incoming is None:
            return None
        late = self._lateness(incoming)
        if self._echo is None:
            return Offset(-incoming, ONE_WAY_UNCERTAINTY_US + late, "one way")
        echo, said = self._echo
        radio = self._by_radio(-incoming, echo, utime)
        if radio is not None and not late:
            return Offset(radio, RADIO_UNCERTAINTY_US, "LinkTrack system_time")
        # both ways together take no less than no time: what is below that is as wrong as it says
        uncertainty = abs(echo + incoming) // 2 + DRIFT_US + max(0, utime - said) // AGEING
        uncertainty += late
        return Offset((echo - incoming) // 2, uncertainty, "messages")

    def _lateness(self, smallest: int) -> int:
        """How much later than the smallest the last messages came, where that is odd."""
        both = min(self._last_two) - smallest
        last = self._last_two[-1] - smallest
        return last if last >= VERY_LATE_US else both if both >= LATE_US else 0

    def _by_radio(self, least: int, most: int, utime: int) -> int | None:
        """The offset by system_time, if it lies where the messages say that it must."""
        if self._radio is None or utime - self._radio[1] >= RADIO_FRESH_US:
            return None
        difference = self._radio[0]
        periods = round(((least + most) // 2 - difference) / SYSTEM_TIME_PERIOD_US)
        offset = difference + periods * SYSTEM_TIME_PERIOD_US
        slack = DRIFT_US + RADIO_UNCERTAINTY_US
        return offset if least - slack <= offset <= most + slack else None
