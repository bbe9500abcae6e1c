"""The way of wheels between two stand-stills: when it began, when it ended, what it was."""

from __future__ import annotations

import math
from collections import deque
from enum import Enum
from typing import Final, NamedTuple

from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.sensors.samples import Motion

STILL_US: Final = 2 * SECOND_US
"""Whoever stands for so long has arrived."""
START_M: Final = 0.02
"""A wheel that rolled further within that time is pushed; less is a nudge."""
STILL_M: Final = 0.005
"""A wheel that rolled less stands."""
STEPS_TO_START, STEPS_TO_STAND = 3.5, 1.5
"""Likewise in counts, of wheels with coarse ones."""
APART_US: Final = 20 * MILLISECOND_US
"""Places are kept so far apart: about a hundred of them."""


class Way(NamedTuple):
    """As the wheels said.

    Attributes:
        distance_m: of the middle, forward; turn_rad: to the left.
        chord_m: from where it began to where it ended, straight; negative if backwards.
        track_m: by which the sides are told from that.
    """

    distance_m: float
    turn_rad: float
    chord_m: float
    track_m: float

    @property
    def left_m(self) -> float:
        return self.distance_m - self.turn_rad * self.track_m / 2

    @property
    def right_m(self) -> float:
        return self.distance_m + self.turn_rad * self.track_m / 2


class Phase(Enum):
    """Of a way."""

    STANDING = "stands"
    MOVING = "moves"
    ENDED = "stands again"
    BROKEN = "the wheels were not heard for a moment"


class _Place(NamedTuple):
    utime: int
    distance_m: float
    turn_rad: float
    x_m: float
    y_m: float


class WayWatch:
    """Follows motions until the way has ended.

    Args:
        track_m: of the wheels.
        step_m: what one of their counts stands for.
    """

    def __init__(self, track_m: float, step_m: float) -> None:
        self.phase = Phase.STANDING
        self._track_m = track_m
        self._start_m = max(START_M, STEPS_TO_START * step_m)
        self._still_m = max(STILL_M, STEPS_TO_STAND * step_m)
        self._now: _Place | None = None
        self._from: _Place | None = None
        self._lately: deque[_Place] = deque()

    def add(self, motion: Motion) -> None:
        """The next motion."""
        if self.phase in (Phase.ENDED, Phase.BROKEN):
            return
        if motion.gap or self._now is None:
            self._begin(motion)
            return
        now = self._now = _moved(self._now, motion)
        if now.utime - self._lately[-1].utime >= APART_US:
            self._lately.append(now)
        while len(self._lately) > 1 and now.utime - self._lately[1].utime >= STILL_US:
            self._lately.popleft()
        oldest = self._lately[0]
        if self.phase is Phase.STANDING and self._apart(oldest, now) > self._start_m:
            self.phase, self._from = Phase.MOVING, oldest
        elif self.phase is Phase.MOVING and now.utime - oldest.utime >= STILL_US:
            stands = all(self._apart(place, now) <= self._still_m for place in self._lately)
            self.phase = Phase.ENDED if stands else Phase.MOVING

    def way(self) -> Way:
        """Since it began; all zero before."""
        if self._from is None or self._now is None:
            return Way(0.0, 0.0, 0.0, self._track_m)
        start, now = self._from, self._now
        x, y = now.x_m - start.x_m, now.y_m - start.y_m
        ahead = x * math.cos(start.turn_rad) + y * math.sin(start.turn_rad)
        return Way(
            now.distance_m - start.distance_m,
            now.turn_rad - start.turn_rad,
            math.copysign(math.hypot(x, y), ahead),
            self._track_m,
        )

    def _begin(self, motion: Motion) -> None:
        """The first motion, or the first after a gap."""
        if self.phase is Phase.MOVING:
            self.phase = Phase.BROKEN
            return
        self._now = _Place(motion.utime, 0.0, 0.0, 0.0, 0.0)
        self._lately = deque([self._now])

    def _apart(self, one: _Place, other: _Place) -> float:
        """How far the wheel that rolled further has rolled, m."""
        middle = abs(other.distance_m - one.distance_m)
        return middle + abs(other.turn_rad - one.turn_rad) * self._track_m / 2


def _moved(place: _Place, motion: Motion) -> _Place:
    heading, half = place.turn_rad + motion.turn_rad / 2, motion.turn_rad / 2
    chord = motion.distance_m * (math.sin(half) / half if half else 1.0)
    return _Place(
        motion.utime,
        place.distance_m + motion.distance_m,
        place.turn_rad + motion.turn_rad,
        place.x_m + chord * math.cos(heading),
        place.y_m + chord * math.sin(heading),
    )
