"""The watchdog of systemd is fed only while all that must move does.

What must move: the loop, which asks here; the timers of the robot; the thread of the solvers; and
each reader for which bytes wait. A reader without bytes is not held against anybody, because a
device that is off is no reason to end a daemon. Neither is a disk that hangs: the next start would
hang on the same disk, while this one drives on and says it (`slow_disk`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Final, Protocol

from drslamd.io.ports.readiness import has_bytes
from drslamd.io.systemd import Notifier
from drslamd.io.worker import Worker

STUCK_S: Final = 4.0
"""Without headway. With the ten seconds of the unit file a hang is ended within fifteen."""
DISK_STUCK_S: Final = 8.0
"""A worn card takes seconds for a sync."""
PERIOD_S: Final = 10.0
"""Of systemd, where nobody says another one."""
LOOKS: Final = 6
"""In one period."""


class Reader(Protocol):
    """A port or a network.

    Attributes:
        reads: how often it has read since the start.
    """

    reads: int

    def descriptor(self) -> int:
        """What it reads from; -1 while there is nothing to read from."""


class _Watched:
    """A reader, and since when bytes wait for it."""

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self._reads = -1
        self._since = 0.0

    def stuck_s(self, now: float) -> float:
        """How long bytes have waited unread, s."""
        reads = self._reader.reads
        if reads != self._reads or not has_bytes(self._reader.descriptor()):
            self._reads, self._since = reads, now
        return now - self._since


class Watchdog:
    """Of one daemon."""

    def __init__(
        self,
        notifier: Notifier,
        solver: Worker,
        readers: Sequence[Reader],
        is_ticking: Callable[[], bool],
    ) -> None:
        """
        Args:
            is_ticking: is the robot woken when it wants to be?
        """
        self._notifier, self._solver, self._is_ticking = notifier, solver, is_ticking
        self._readers = [_Watched(reader) for reader in readers]
        self.stuck_s = STUCK_S

    @property
    def every_s(self) -> float:
        """Between two looks."""
        return (self._notifier.watchdog_s or PERIOD_S) / LOOKS

    def look(self) -> None:
        """Feed it, if everything moves."""
        now = time.monotonic()
        # each is asked each time: it learns of headway only then
        stuck = [self._solver.stuck_s(), *(reader.stuck_s(now) for reader in self._readers)]
        if self._is_ticking() and max(stuck) <= self.stuck_s:
            self._notifier.alive()


def slow_disk(disk: Worker) -> str:
    """What is said of a disk that does not answer; empty while it does."""
    seconds = disk.stuck_s()
    if seconds < DISK_STUCK_S:
        return ""
    return (
        f"the disk has not answered for {seconds:.0f} s: nothing can be kept over a restart; "
        "replace the card of daemon.state_dir"
    )
