"""From what the wheels say to what the body did: differential drive.

Law of this file: no motion is ever invented. With l and r the paths of the left and the right
wheels since the last reading and b the track,

    distance = (l + r) / 2        turn = (r - l) / b

Counters give l and r as differences, so a lost message costs nothing; speeds are integrated over
the time between two messages (trapezoid), so silence costs the link. Whenever l and r cannot be
known the result is a `Motion` with ``gap``, which starts anew from the reading at hand:

start       the first reading;
source      counts after speeds, or the other way round;
jump        a counter moved faster than the base can, or the base turned faster than any does,
            and went on from there (a power cycle, a tracker that lost itself). One odd reading
            between good ones is refused instead, and nothing is lost;
restart     after a silence a counter is near zero that was not: a power cycle;
wrap        a silence in which a counter may have gone around unseen;
silence     speeds: longer than `MAX_SILENCE_US`. Counters: longer than `MAX_BRIDGE_US` with more
            path than `BRIDGE_PATH_M`: how long the path was is known, what shape it had is not.

Motions have strictly increasing times. Of readings with the same stamp the last one counts.

This is the border for numbers: every sample of every base passes `WheelBase.add`, which refuses
what is not finite, also where only a product is not, and what is finite but absurd. A `Motion` is
finite and no longer than the base can drive in its time.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple, Union

from drslamd.conventions import SECOND_US
from drslamd.sensors.samples import (
    Motion,
    Twist,
    WheelCounts,
    WheelReading,
    WheelSpeeds,
    WheelTurns,
)
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.wrapping import difference_around

MAX_SILENCE_US: Final = SECOND_US // 2
"""Speeds older than this say nothing about the present."""
MAX_BRIDGE_US: Final = 2 * SECOND_US
BRIDGE_PATH_M: Final = 0.5
"""Less than this per wheel stays close to one arc, however long the silence was."""
MAX_TURN_RADPS: Final = 2 * math.pi
"""No base that carries a radio spins faster than once a second (most: half of that)."""
STAMP_JITTER_US: Final = SECOND_US // 10
"""Stamps of arrival may bunch up by this much without a counter being suspected."""
NEAR_ZERO_M: Final = 0.05
"""How far wheels may have turned before the first reading after a power cycle."""
MAX_TURNED_M: Final = 0.05 * 2**23
"""Turns come as 32-bit floats. 419 km from zero their steps are 5 cm long, and further on they
would stand still while the base drives."""


class ReadingRefusal(Enum):
    """Why a sample gives no motion of its own."""

    NOT_FINITE = "a value that is not a finite number"
    TOO_FAR = "more turns than a 32-bit float can tell apart"
    OUT_OF_ORDER = "older than the one before"
    SAME_STAMP = "same time as the one before, replaces it"
    TOO_FAST = "a speed above max_speed_mps, or a turn of more than one round a second"
    JUMP = "a counter moved faster than max_speed_mps, or turned the base too fast"


class Gap(Enum):
    """Why a motion is not linked to the one before."""

    START = "the first reading"
    SOURCE = "another kind of sample"
    JUMP = "the counters went on from somewhere else"
    RESTART = "a counter started at zero again"
    WRAP = "a counter may have gone around unseen"
    SILENCE = "too long a silence"


@dataclass(frozen=True)
class DriveGeometry:
    """The base: distance between left and right wheels, its top speed, counts or turns per metre
    of path (1 for speeds), and which counters run backwards."""

    track_m: float
    max_speed_mps: float
    per_metre: float = 1.0
    reverse_left: bool = False
    reverse_right: bool = False


class _Position(NamedTuple):
    """Both counters; `values` is None when they do not go around."""

    utime: int
    left: float
    right: float
    values: int | None


class _Speed(NamedTuple):
    """Both ground speeds, m/s, positive forward."""

    utime: int
    left: float
    right: float


_Reading = Union[_Position, _Speed]


class _Path(NamedTuple):
    """What both wheels rolled, metres forward."""

    left_m: float
    right_m: float

    @property
    def longest_m(self) -> float:
        return max(abs(self.left_m), abs(self.right_m))


class WheelBase:
    """Turns samples of one source into motions of the body.

    Attributes:
        tally: samples; accepted ones gave a motion.
        gaps: accepted samples that were not linked to the one before, by reason.
        trouble: why the last sample gave no linked motion; None when it gave one.
    """

    def __init__(self, geometry: DriveGeometry) -> None:
        self._geometry = geometry
        self._left_sign = -1 if geometry.reverse_left else 1
        self._right_sign = -1 if geometry.reverse_right else 1
        self._last: _Reading | None = None
        self._suspect: _Position | None = None
        self.tally: Tally[ReadingRefusal] = Tally()
        self.gaps: Counter[Gap] = Counter()
        self.trouble: Gap | ReadingRefusal | None = None

    def add(self, sample: WheelReading) -> Motion | None:
        """The motion since the last one, or None when the sample was refused."""
        now = self._reading(sample)
        outcome = self._judge(now)
        self.trouble = None if isinstance(outcome, _Path) else outcome
        if isinstance(outcome, ReadingRefusal):
            self._refuse(outcome, now)
            return None
        self.tally.accepted += 1
        self._last, self._suspect = now, None
        if isinstance(outcome, Gap):
            self.gaps[outcome] += 1
            return Motion(now.utime, 0.0, 0.0, gap=True)
        distance = (outcome.left_m + outcome.right_m) / 2
        turn = (outcome.right_m - outcome.left_m) / self._geometry.track_m
        return Motion(now.utime, distance, turn)

    def _reading(self, sample: WheelReading) -> _Reading:
        if isinstance(sample, WheelCounts):
            return _Position(sample.utime, sample.left, sample.right, sample.values)
        if isinstance(sample, WheelTurns):
            return _Position(sample.utime, sample.left, sample.right, None)
        if isinstance(sample, WheelSpeeds):
            left, right = self._left_sign * sample.left_mps, self._right_sign * sample.right_mps
            return _Speed(sample.utime, left, right)
        return self._of_twist(sample)

    def _of_twist(self, twist: Twist) -> _Speed:
        half = twist.angular_radps * self._geometry.track_m / 2
        return _Speed(twist.utime, twist.linear_mps - half, twist.linear_mps + half)

    def _refuse(self, reason: ReadingRefusal, now: _Reading) -> None:
        self.tally.refuse(reason)
        if reason is ReadingRefusal.JUMP and isinstance(now, _Position):
            self._suspect = now
        if reason is ReadingRefusal.SAME_STAMP and isinstance(now, _Speed):
            self._last = now  # of counters the next difference holds what this one brought

    def _judge(self, now: _Reading) -> _Path | Gap | ReadingRefusal:
        last = self._last
        if not math.isfinite(now.left) or not math.isfinite(now.right):
            return ReadingRefusal.NOT_FINITE
        if isinstance(now, _Position) and self._is_too_far(now):
            return ReadingRefusal.TOO_FAR
        if isinstance(now, _Speed) and self._is_too_fast(_Path(now.left, now.right), SECOND_US):
            return ReadingRefusal.TOO_FAST
        if last is None:
            return Gap.START
        if now.utime <= last.utime:
            is_older = now.utime < last.utime
            return ReadingRefusal.OUT_OF_ORDER if is_older else ReadingRefusal.SAME_STAMP
        if isinstance(now, _Speed) and isinstance(last, _Speed):
            return _integrated(last, now)
        if isinstance(now, _Position) and isinstance(last, _Position):
            return self._difference(last, now)
        return Gap.SOURCE

    def _difference(self, last: _Position, now: _Position) -> _Path | Gap | ReadingRefusal:
        elapsed_us = now.utime - last.utime
        if self._may_have_wrapped(now.values, elapsed_us):
            return Gap.WRAP
        if elapsed_us > MAX_SILENCE_US and self._has_restarted(last, now):
            return Gap.RESTART
        path = self._path(last, now)
        if self._is_too_fast(path, elapsed_us + STAMP_JITTER_US):
            return Gap.JUMP if self._goes_on_from_suspect(now) else ReadingRefusal.JUMP
        if elapsed_us > MAX_BRIDGE_US and path.longest_m > BRIDGE_PATH_M:
            return Gap.SILENCE
        return path

    def _path(self, last: _Position, now: _Position) -> _Path:
        left = _moved(last.left, now.left, now.values) / self._geometry.per_metre
        right = _moved(last.right, now.right, now.values) / self._geometry.per_metre
        return _Path(self._left_sign * left, self._right_sign * right)

    def _is_too_far(self, now: _Position) -> bool:
        if now.values is not None:
            return False
        return max(abs(now.left), abs(now.right)) / self._geometry.per_metre > MAX_TURNED_M

    def _is_too_fast(self, path: _Path, elapsed_us: int) -> bool:
        elapsed_s = elapsed_us / SECOND_US
        turn = abs(path.right_m - path.left_m) / self._geometry.track_m
        return (
            path.longest_m > self._geometry.max_speed_mps * elapsed_s
            or turn > MAX_TURN_RADPS * elapsed_s
        )

    def _may_have_wrapped(self, values: int | None, elapsed_us: int) -> bool:
        """Could the base have rolled half the range of its counter?"""
        if values is None:
            return False
        half_range_m = values / 2 / self._geometry.per_metre
        return self._geometry.max_speed_mps * elapsed_us / SECOND_US >= half_range_m

    def _has_restarted(self, last: _Position, now: _Position) -> bool:
        """Is a counter near zero that was not?"""
        zero = last._replace(left=0, right=0)
        before, after = self._path(zero, last), self._path(zero, now)
        return any(abs(a) <= NEAR_ZERO_M < abs(b) for a, b in zip(after, before, strict=True))

    def _goes_on_from_suspect(self, now: _Position) -> bool:
        if self._suspect is None:
            return False
        elapsed_us = now.utime - self._suspect.utime + STAMP_JITTER_US
        return not self._is_too_fast(self._path(self._suspect, now), elapsed_us)


def _moved(last: float, now: float, values: int | None) -> float:
    return now - last if values is None else difference_around(int(now), int(last), values)


def _integrated(last: _Speed, now: _Speed) -> _Path | Gap:
    elapsed_us = now.utime - last.utime
    if elapsed_us > MAX_SILENCE_US:
        return Gap.SILENCE
    half_s = elapsed_us / SECOND_US / 2
    return _Path((last.left + now.left) * half_s, (last.right + now.right) * half_s)
