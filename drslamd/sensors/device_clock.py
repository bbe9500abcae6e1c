"""When was it measured? The counter of a device, read on the clock of this host.

A device stamps what it sends with its own counter; the host sees the bytes later, by a delay that
is never negative. So the smallest (arrival - reading) of the last `WINDOW_US` is the best offset
between both clocks. With a drift d between them and a shortest delay in the window of s, the
result differs from the time of measurement by

    -d * WINDOW_US - one unit of the counter  <=  error  <=  s + one unit of the counter

which for 200 ppm and a millisecond counter is -1.8 ms .. s + 1 ms. Results are never later than the
arrival and never run backwards: the offset only falls to that of the reading at hand, whose result
is then its arrival.

A counter is believed once two readings in a row continue each other, at the start as well as after
a jump: a single damaged reading changes nothing, a device that was restarted costs one reading. At
the start it costs none: the second reading tells when the first was (`first_us`).
"""

from __future__ import annotations

from collections import deque
from typing import Final

from drslamd.conventions import SECOND_US
from drslamd.sensors.wheels.wrapping import wrapped_difference

BUCKET_US: Final = SECOND_US // 2
BUCKETS: Final = 8
WINDOW_US: Final = BUCKET_US * BUCKETS
"""Long enough to meet an undelayed reading, short enough for drift: 0.8 ms at 200 ppm."""

CONTINUITY_US: Final = 5 * SECOND_US
"""How far device and host may disagree on the time between two readings. A host that was held up
reads its backlog late by as much; a restarted device is off by its whole uptime."""


class _Track:
    """The readings of one uninterrupted run of a counter.

    Attributes:
        reading: the last one, with the turns of the counter since the first.
        offset_us: the smallest (arrival - reading) of the window.
    """

    def __init__(self, bits: int, unit_us: int, reading: int, arrival: int) -> None:
        self._bits = bits
        self._unit_us = unit_us
        self.reading = reading
        self._arrival = arrival
        # One (bucket, smallest offset) for each half second of device time: a host that was held
        # up and reads its backlog late must not lose what it knew before.
        self._offsets: deque[tuple[int, int]] = deque(maxlen=BUCKETS)
        self.offset_us = arrival - reading * unit_us
        self._keep(arrival)

    def host_time(self, reading: int | None = None) -> int:
        """Time of a reading, by default the last one, on the clock of the host."""
        return (self.reading if reading is None else reading) * self._unit_us + self.offset_us

    def step_to(self, reading: int, arrival: int) -> int:
        """Units from the last reading to this one, whole turns of the counter included."""
        expected = (arrival - self._arrival) // self._unit_us
        beyond = wrapped_difference(reading, self.reading + expected, self._bits)
        return expected + beyond

    def extend(self, reading: int, arrival: int) -> bool:
        """Take a reading that continues this run; False when it does not."""
        step = self.step_to(reading, arrival)
        step_us = step * self._unit_us
        if step_us <= 0 or abs(step_us - (arrival - self._arrival)) > CONTINUITY_US:
            return False
        self.reading += step
        self._arrival = arrival
        self._keep(arrival)
        return True

    def _keep(self, arrival: int) -> None:
        device_us = self.reading * self._unit_us
        bucket, offset = device_us // BUCKET_US, arrival - device_us
        offsets = self._offsets
        if offsets and offsets[-1][0] == bucket:
            offset = min(offset, offsets.pop()[1])
        gone = False
        while offsets and offsets[0][0] <= bucket - BUCKETS:
            offsets.popleft()
            gone = True
        offsets.append((bucket, offset))
        least = min(known for _, known in offsets) if gone else min(self.offset_us, offset)
        self.offset_us = least


class DeviceClock:
    """Maps the readings of a counter that wraps at 2 ** `bits` and counts `unit_us` to host time.

    Attributes:
        restarts: how often a believed counter was given up for another one.
        first_us: host time of the reading before the last, if it waited for the last to be
            believed; of the first that ever was believed, never of one after a restart.
    """

    def __init__(self, bits: int, unit_us: int) -> None:
        self._bits = bits
        self._unit_us = unit_us
        self._believed: _Track | None = None
        self._candidate: _Track | None = None
        self.restarts = 0
        self.first_us: int | None = None

    @property
    def offset_us(self) -> int | None:
        """Host time minus device time, microseconds, or None before anything is believed.

        Device time counts on over wraps, starting from the first reading: it equals the counter
        modulo 2 ** bits units.
        """
        return None if self._believed is None else self._believed.offset_us

    def to_host(self, reading: int, arrival: int) -> int | None:
        """Host time (us) of a `reading` that came at `arrival` (us).

        None while the reading continues neither the believed counter nor the reading before it.
        """
        self.first_us = None
        waited = self._candidate.reading if self._candidate else None
        track = self._extended(reading, arrival)
        if track is None:
            self._candidate = _Track(self._bits, self._unit_us, reading, arrival)
            return None
        if self._believed is None:
            self.first_us = track.host_time(waited)
        if track is not self._believed:
            self.restarts += self._believed is not None
            self._believed = track
        self._candidate = None
        return track.host_time()

    def _extended(self, reading: int, arrival: int) -> _Track | None:
        """The run that this reading continues."""
        for track in (self._believed, self._candidate):
            if track is not None and track.extend(reading, arrival):
                return track
        return None
