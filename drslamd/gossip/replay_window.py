"""Which messages of one start of a robot were seen: the defence against replays."""

from __future__ import annotations

WINDOW = 1_024
"""Counters that a replay window remembers: a minute at 16 messages a second."""
FIRST_COUNTER = 1


class ReplayWindow:
    """Which of the last `WINDOW` counters were seen; asking changes nothing."""

    def __init__(self) -> None:
        self._newest = 0
        self._seen = 0
        """Bit k stands for the counter `_newest` - k."""

    def is_new(self, counter: int) -> bool:
        if counter > self._newest:
            return True
        age = self._newest - counter
        return counter >= FIRST_COUNTER and age < WINDOW and not self._seen >> age & 1

    def commit(self, counter: int) -> None:
        """Remember a counter that `is_new`."""
        if counter > self._newest:
            shift = min(counter - self._newest, WINDOW)
            self._seen = (self._seen << shift | 1) & ((1 << WINDOW) - 1)
            self._newest = counter
        else:
            self._seen |= 1 << (self._newest - counter)
