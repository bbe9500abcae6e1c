"""Counters that go around: how far did it go from one reading to the next?"""

from __future__ import annotations


def difference_around(new: int, old: int, values: int) -> int:
    """`new - old` on a circle of so many values, taken from the half of it around zero.

    Right whenever the true difference lies in [-values / 2, values / 2); signed and unsigned
    readings may be given alike.
    """
    half = values // 2
    return (new - old + half) % values - half


def wrapped_difference(new: int, old: int, bits: int) -> int:
    """The same for a counter of so many bits."""
    return difference_around(new, old, 1 << bits)
