"""What a robot does by the clock: actions, each with its period."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.events import Effect

POLL_US = 10 * MILLISECOND_US
"""How finely the wheels that must be asked are asked; their driver knows its own rate."""
REPEAT_US = 100 * MILLISECOND_US
"""Between two looks for log entries that somebody lacks."""
TURN_US = 40 * MILLISECOND_US
"""The same where robots take turns, and wait for each other."""
SAVE_US = 60 * SECOND_US
"""Between two looks whether there is anything new to keep over a restart."""
PLACE_US = SECOND_US // 4
"""After a hole in odometry: between two looks at where ranges place us."""

Action = Callable[[int], list[Effect]]
"""Gets the time, us, and says what follows."""


class Timers:
    """Actions that come round.

    Attributes:
        next: when the next one is due, us.
    """

    def __init__(self, periods: Mapping[Action, int]) -> None:
        """
        Args:
            periods: us, in the order in which actions of one moment are taken.
        """
        self._periods = periods
        self._due: dict[Action, int] = {}
        self.next = 0

    def take_due(self, utime: int) -> list[Action]:
        """The actions whose time has come; each is then due again after its period."""
        taken = []
        for action, period in self._periods.items():
            due = self._due.setdefault(action, utime)
            if utime >= due:
                # after a stall the timer starts afresh instead of catching up in a burst
                is_late = utime - due > period
                self._due[action] = utime + period if is_late else due + period
                taken.append(action)
        self.next = min(self._due.values())
        return taken
