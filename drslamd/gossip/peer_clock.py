"""How far a peer's clock is from ours, out of the messages themselves.

A message that left at s on the peer's clock and arrived at r on ours shows r - s = delay - offset
(offset: peer's clock minus ours). The smallest of many has almost no delay. The peer tells us the
smallest that it sees of our messages, offset + delay; half the difference of both is the offset
and half their sum is how wrong it can be. LinkTrack's `system_time` gives the same without any
network: both robots know their own clock minus that of the radio system.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from drslamd.conventions import MILLISECOND_US, SECOND_US

BUCKETS = 16
"""Seconds over which the smallest delay is taken; clocks that drift apart by 200 ppm move 3 ms."""
ONE_WAY_UNCERTAINTY_US = 100 * MILLISECOND_US
"""What is claimed while the peer has not yet said how it hears us."""
RADIO_UNCERTAINTY_US = 3 * MILLISECOND_US
"""LinkTrack stamps in whole milliseconds, on both sides, plus the serial lines' least delay."""
RADIO_FRESH_US = 5 * SECOND_US


@dataclass(frozen=True)
class Offset:
    """Peer's clock minus ours, and how wrong that may be, us."""

    us: int
    uncertainty_us: int
    source: str


class PeerClock:
    """One peer's clock against ours."""

    def __init__(self) -> None:
        self._buckets: deque[tuple[int, int]] = deque(maxlen=BUCKETS)
        self._echo: int | None = None
        self._radio: tuple[int, int] | None = None

    def heard(self, sent: int, arrived: int) -> None:
        """A message straight from the peer: its stamp, and its arrival on our clock."""
        second, value = arrived // SECOND_US, arrived - sent
        if self._buckets and self._buckets[-1][0] == second:
            value = min(value, self._buckets.pop()[1])
        self._buckets.append((second, value))

    def echoed(self, delay_us: int) -> None:
        """The peer's own smallest (arrival there - our stamp)."""
        self._echo = delay_us

    def radio(self, own_minus_system: int, peer_minus_system: int, utime: int) -> None:
        """Both clocks against LinkTrack's system_time."""
        self._radio = (peer_minus_system - own_minus_system, utime)

    @property
    def delay_us(self) -> int | None:
        """Our smallest (arrival here - stamp of the peer), to be told to the peer."""
        return min((value for _, value in self._buckets), default=None)

    def offset(self, utime: int) -> Offset | None:
        """The best of what is known, or None before the first message."""
        found = []
        incoming = self.delay_us
        if incoming is not None and self._echo is not None:
            uncertainty = max(MILLISECOND_US, (self._echo + incoming) // 2)
            found.append(Offset((self._echo - incoming) // 2, uncertainty, "messages"))
        if self._radio is not None and utime - self._radio[1] < RADIO_FRESH_US:
            found.append(Offset(self._radio[0], RADIO_UNCERTAINTY_US, "LinkTrack system_time"))
        if not found and incoming is not None:
            found.append(Offset(-incoming, ONE_WAY_UNCERTAINTY_US, "one way"))
        return min(found, key=lambda o: o.uncertainty_us, default=None)
