"""Ports whose bytes carry their own times are read together, in rounds, and not for every frame.

What wakes a process up costs it more than what it reads then. A device that stamps what it sends
loses nothing when its bytes wait for the next round: the shortest delay of late says what its clock
reads (`sensors.device_clock`), and rounds come at ever other moments between its frames. A port
that was silent for a round is read as soon as it speaks again.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

PERIOD_S: Final = 0.047
"""No multiple or part of the periods at which devices send, so that some frames of each second are
read as they come."""

Read = Callable[[], None]


class ReadingRound:
    """Of one process."""

    def __init__(self, is_urgent: Callable[[], bool]) -> None:
        """
        Args:
            is_urgent: does somebody want everything at once now?
        """
        self._is_urgent = is_urgent
        self._waiting: list[Read] = []
        self._timer: asyncio.TimerHandle | None = None

    def has_time(self) -> bool:
        """May a port wait for the next round?"""
        return not self._is_urgent()

    def join(self, read: Read) -> None:
        """Let it be called once, in the next round."""
        self._waiting.append(read)
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(PERIOD_S, self._go)

    def leave(self, read: Read) -> None:
        """It may not be called any more."""
        if read in self._waiting:
            self._waiting.remove(read)
        if not self._waiting and self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _go(self) -> None:
        self._timer, reads, self._waiting = None, self._waiting, []
        for read in reads:
            read()
