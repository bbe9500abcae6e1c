"""How far a peer's clock was from ours, over all the time that it was heard.

Clocks drift apart by up to 200 ppm, which is 0.7 s in an hour. Whoever puts a stamp of an hour ago
on another clock must know how far that was ahead then, not now.
"""

from __future__ import annotations

from typing import NamedTuple

from drslamd.conventions import SECOND_US

MOST = 512
"""Entries of one peer, 60 kB; when they are full every second one is dropped, so a day is covered
at one in five minutes."""
EVERY_US = 10 * SECOND_US


class ClockReading(NamedTuple):
    """At `utime` on our clock the peer's showed `ahead_us` more, give or take `uncertainty_us`."""

    utime: int
    ahead_us: int
    uncertainty_us: int


class ClockHistory:
    """One peer's clock against ours, at most one reading in `EVERY_US` at first, rarer later."""

    def __init__(self) -> None:
        self.readings: list[ClockReading] = []
        self._every_us = EVERY_US

    def add(self, new: ClockReading) -> None:
        """Take a reading; of one interval the surest counts."""
        known = self.readings
        if known and new.utime // self._every_us == known[-1].utime // self._every_us:
            if new.uncertainty_us <= known[-1].uncertainty_us:
                known[-1] = new
            return
        known.append(new)
        if len(known) > MOST:
            self._every_us *= 2
            self.readings = known[::2]
