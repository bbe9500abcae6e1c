"""Two sides that report one after the other, brought to a common time.

A sample of odometry needs both sides at one instant. Each value of the first side waits for the
next one of the second side, which together with the one before encloses it in time; the second
side is interpolated to the time of the first. Rates and phases of the two may be any, as long as
each side speaks once in `MAX_APART_US`.

The error of the straight line between two readings stays where it is made: it is at most
a T^2 / 8 for a wheel that accelerates by a within T (1 mm at 1 m/s2 and 100 ms), and the next pair
begins at readings again, so it never adds up.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Final, NamedTuple

from drslamd.conventions import SECOND_US
from drslamd.sensors.wheels.wrapping import difference_around

MAX_APART_US: Final = SECOND_US
"""Between two values of the second side, if what lies between them is to be known. A base that
speaks more rarely is taken for a silent one."""


class Side(Enum):
    FIRST = "first"
    SECOND = "second"


class Pair(NamedTuple):
    """Both sides at `utime` (us)."""

    utime: int
    first: float
    second: float


Interpolate = Callable[[float, float, float], float]
"""(before, after, fraction of the way from one to the other) to the value between."""


def linear(before: float, after: float, fraction: float) -> float:
    return before + (after - before) * fraction


def wrapping(values: Callable[[], int]) -> Interpolate:
    """Interpolation between readings of a counter that goes around after so many values."""

    def between(before: float, after: float, fraction: float) -> float:
        moved = difference_around(int(after), int(before), values())
        return (int(before) + round(moved * fraction)) % values()

    return between


class SidePairing:
    """Holds one value of the first side and one of the second.

    Attributes:
        unpaired: values of the first side that found no partner in time.
        last_utime: when each side spoke last; a side that never did is absent.
    """

    def __init__(self, interpolate: Interpolate) -> None:
        self._interpolate = interpolate
        self.last_utime: dict[Side, int] = {}
        self._waiting: tuple[int, float] | None = None
        self._before: tuple[int, float] | None = None
        self.unpaired = 0

    def add(self, side: Side, utime: int, value: float) -> Pair | None:
        """Take one value measured at `utime` (us); values of one side come in order of time."""
        self.last_utime[side] = utime
        if side is Side.FIRST:
            self.unpaired += self._waiting is not None
            self._waiting = (utime, value)
            return None
        before, self._before = self._before, (utime, value)
        waiting, self._waiting = self._waiting, None
        if waiting is None:
            return None
        pair = self._pair(waiting, before, (utime, value))
        self.unpaired += pair is None
        return pair

    def _pair(
        self,
        waiting: tuple[int, float],
        before: tuple[int, float] | None,
        after: tuple[int, float],
    ) -> Pair | None:
        utime, first = waiting
        if utime == after[0]:
            return Pair(utime, first, after[1])
        if before is None or not before[0] <= utime <= after[0]:
            return None
        if after[0] - before[0] > MAX_APART_US:
            return None
        fraction = (utime - before[0]) / (after[0] - before[0])
        return Pair(utime, first, self._interpolate(before[1], after[1], fraction))
