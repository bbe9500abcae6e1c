"""Counters of fixed width: how far did it go from one reading to the next?"""

from __future__ import annotations


def wrapped_difference(new: int, old: int, bits: int) -> int:
    """`new - old` modulo 2 ** bits, taken from the half range around zero.

    Right whenever the true difference lies in [-2 ** (bits - 1), 2 ** (bits - 1)); signed and
    unsigned readings may be given alike.
    """
    half = 1 << (bits - 1)
    return (new - old + half) % (1 << bits) - half
