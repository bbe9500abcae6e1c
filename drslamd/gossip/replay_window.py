"""Which messages of one start of a robot were seen: the defence against replays.

No message is taken twice, and no single one can push those that follow out of the window: a
counter that leaps ahead is taken by itself, and the window follows only when more messages came
from there. So a robot that comes back after a long silence is heard at once, and a message with
the last counter there is silences nobody.
"""

from __future__ import annotations

WINDOW = 1_024
"""Counters below the newest one that are remembered: a minute at 16 messages a second."""
FIRST_COUNTER = 1
FOLLOWS = 3
"""Messages within one `WINDOW` that take the window to where they are."""
MAX_LEAPS = 8
"""Messages ahead of the window that are remembered; one more, and it moves to the first of them."""


class ReplayWindow:
    """Which of the newest counter and the `WINDOW` below it were seen; asking changes nothing."""

    def __init__(self) -> None:
        self._newest = 0
        self._seen = 0
        """Bit k stands for the counter `_newest` - k."""
        self._ahead: list[int] = []
        """Counters beyond `_newest` + `WINDOW` that were seen, ascending."""

    def is_new(self, counter: int) -> bool:
        if counter > self._newest:
            return counter not in self._ahead
        age = self._newest - counter
        return counter >= FIRST_COUNTER and age <= WINDOW and not self._seen >> age & 1

    def commit(self, counter: int) -> None:
        """Remember a counter that `is_new`."""
        if counter <= self._newest:
            self._seen |= 1 << (self._newest - counter)
            return
        is_leap = counter > self._newest + WINDOW
        if is_leap:
            self._ahead = sorted([*self._ahead, counter])
        else:
            self._move(counter)
        together = [c for c in self._ahead if abs(c - counter) <= WINDOW]
        if len(together) + (not is_leap) >= FOLLOWS:
            self._move(max(together))
        elif len(self._ahead) > MAX_LEAPS:
            self._move(self._ahead[0])

    def _move(self, newest: int) -> None:
        """Let the window end at `newest`, with all in it that was seen."""
        shift = min(newest - self._newest, WINDOW + 1)
        self._seen = (self._seen << shift | 1) & ((1 << WINDOW + 1) - 1)
        self._newest = newest
        for counter in self._ahead:
            if 0 <= newest - counter <= WINDOW:
                self._seen |= 1 << (newest - counter)
        self._ahead = [counter for counter in self._ahead if counter > newest]
