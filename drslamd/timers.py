"""What a robot does by the clock: actions, each with its period."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

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


@dataclass
class _Round:
    """An action, its period and when it is due, us; None before the first look."""

    action: Action
    period: int
    due: int | None = None


class Timers:
    """Actions that come round.

    Attributes:
        next: when the next one is due, us.
    """

    def __init__(self, periods: Mapping[Action, int], pauses: Collection[Action] = ()) -> None:
        """
        Args:
            periods: us, in the order in which actions of one moment are taken.
            pauses: after one of these the others of that moment wait until the robot is woken
                again, which it wants to be at once: so sensors are read in between.
        """
        self._rounds = [_Round(action, period) for action, period in periods.items()]
        self._pauses = frozenset(pauses)
        self._first = 0
        """Which round is looked at first: the one behind a pause, so that none waits for ever."""
        self.next = 0
        self._hurried: Action | None = None

    def hurry(self, action: Action, utime: int) -> None:
        """Let an action that has not come to its end go on at once, beside its rounds."""
        self._hurried, self.next = action, min(self.next, utime)

    def take_due(self, utime: int) -> list[Action]:
        """The actions whose time has come, up to a pause, behind which the next look begins; each
        is then due again after its period."""
        taken: list[Action] = []
        hurried, self._hurried = self._hurried, None
        first, self._first = self._first, 0
        for place, each in enumerate(self._rounds[first:], first):
            if taken and taken[-1] in self._pauses:
                self._first = place if self._is_any_due(utime, place) else 0
                break
            due = utime if each.due is None else each.due
            if utime >= due:
                # after a stall the timer starts afresh instead of catching up in a burst
                due = (utime if utime - due > each.period else due) + each.period
                taken.append(each.action)
            each.due = due
        dues = [utime if each.due is None else each.due for each in self._rounds]
        self.next = max(utime, min(dues))
        return taken if hurried is None or hurried in taken else [*taken, hurried]

    def _is_any_due(self, utime: int, first: int) -> bool:
        return any(each.due is None or each.due <= utime for each in self._rounds[first:])
