"""Where the counters of a DBC file go around: at a power of two, or where the file says they end.

Pulses of a wheel are often counted from 0 to 999 in ten bits. The file says so by its range, which
is as often made up. So it counts until a counter is seen beyond it: one that has more room passes
that border before it can be misread. A single reading beyond is taken for a mark of no value.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from cantools.database.can.signal import Signal

LEAST_VALUES: Final = 16
"""Fewer are the range of something else."""
_ROUNDING: Final = 1e-6
Ends = tuple[int, int]


class CounterRange:
    """Of the two counters of one base.

    Args:
        bits: how wide they are.
        ends: first and last value that the file names, None where it names none.
    """

    def __init__(self, bits: int, ends: Ends | None) -> None:
        self.bits, self._ends = bits, ends
        self._was_beyond: set[object] = set()

    @property
    def values(self) -> int:
        """How many different ones there are before they begin anew."""
        return 1 << self.bits if self._ends is None else self._ends[1] - self._ends[0] + 1

    @property
    def unused(self) -> int:
        """Numbers of so many bits that never come."""
        return (1 << self.bits) - self.values

    def takes(self, side: object, value: int) -> bool:
        """Is a reading of one side a value, as far as can be told?"""
        if self._ends is None or self._ends[0] <= value <= self._ends[1]:
            self._was_beyond.discard(side)
            return True
        if side not in self._was_beyond:
            self._was_beyond.add(side)
            return False
        self._ends = None
        return True


def named_ends(signals: list[Signal], bits: int, least: float) -> Ends | None:
    """The ends that the file names for both counters alike, where they are worth a try.

    Args:
        least: as many values as one sample may pass.
    """
    found = {_ends(signal) for signal in signals}
    if len(found) > 1:
        return None
    (ends,) = found
    if ends is None:
        return None
    values = ends[1] - ends[0] + 1
    # (one or two that lack at the end are marks, and cost no more than that at each turn)
    is_less = values < (1 << bits) - 2
    return ends if is_less and values >= max(LEAST_VALUES, least) else None


def _ends(signal: Signal) -> Ends | None:
    """As they are sent, with the sign of the factor."""
    if signal.minimum is None or signal.maximum is None or not signal.scale:
        return None
    try:
        size = abs(float(signal.scale))
        ends = sorted(
            (float(end) - float(signal.offset)) / size for end in (signal.minimum, signal.maximum)
        )
        low, high = (round(end) for end in ends)
    except (OverflowError, ValueError):
        return None
    is_whole = all(abs(end - round(end)) <= _ROUNDING * max(1.0, abs(end)) for end in ends)
    return (low, high) if is_whole and low < high else None
