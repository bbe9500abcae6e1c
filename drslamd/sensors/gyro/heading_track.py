"""Readings of a gyro, angles or rates, as one angle that counts on."""

from __future__ import annotations

import math
from typing import Final, Union

from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.sensors.samples import GyroAngle, GyroRate

GyroSample = Union[GyroAngle, GyroRate]

LONGEST_US: Final = 300 * MILLISECOND_US
"""Between two readings; over more, the angle is not known."""
MOST_RADPS: Final = 4 * math.pi
"""Nothing that rolls turns faster."""


def _is_jump(turn: float, elapsed_us: int) -> bool:
    """Did an angle begin anew?"""
    return abs(turn) > MOST_RADPS * elapsed_us / SECOND_US


class HeadingTrack:
    """
    Args:
        sign: -1 of a gyro that counts turns to the right.

    Attributes:
        refused: readings that are no numbers, absurd, or out of order.
        broken: how often the angle was lost.
        equal: readings in a row that said the same turn as the one before them, to the bit;
            equal_since: when that turn began.
    """

    def __init__(self, sign: float = 1.0) -> None:
        self._sign = sign
        self.refused = self.broken = self.equal = 0
        self.equal_since = 0
        self.newest: int | None = None
        self._kind: type[GyroSample] | None = None
        self._raw = 0.0
        self._angle, self._radps = 0.0, 0.0

    def add(self, sample: GyroSample) -> None:
        """Take one reading, newer than the one before."""
        value = self._sign * (sample.radps if isinstance(sample, GyroRate) else sample.angle_rad)
        before = self.newest
        if not math.isfinite(value) or (before is not None and sample.utime <= before):
            self.refused += 1
            return
        is_new = before is None or type(sample) is not self._kind
        elapsed_us = None if is_new or before is None else sample.utime - before
        self._kind = type(sample)
        if isinstance(sample, GyroRate):
            if abs(value) > MOST_RADPS:
                self.refused += 1
                return
            turn = 0.0 if elapsed_us is None else (value + self._raw) / 2 * elapsed_us / SECOND_US
            said, had = value, self._raw
        else:
            turn = 0.0 if elapsed_us is None else math.remainder(value - self._raw, 2 * math.pi)
            said, had = turn, self._radps * (elapsed_us or 0) / SECOND_US
        self.newest, self._raw = sample.utime, value
        if elapsed_us is None or elapsed_us > LONGEST_US or _is_jump(turn, elapsed_us):
            self.broken += 1
            self._radps, self.equal = 0.0, 0
            return
        self._radps = value if isinstance(sample, GyroRate) else turn * SECOND_US / elapsed_us
        self._angle += turn
        is_equal = abs(said - had) < 1e-9
        self.equal_since = self.equal_since if is_equal else sample.utime - elapsed_us
        self.equal = self.equal + 1 if is_equal else 0

    def at(self, utime: int) -> tuple[int, float] | None:
        """Which unbroken stretch it is, and the angle at `utime`; None while nothing is said."""
        if self.newest is None or not -LONGEST_US <= utime - self.newest <= LONGEST_US:
            return None
        return self.broken, self._angle + self._radps * (utime - self.newest) / SECOND_US
