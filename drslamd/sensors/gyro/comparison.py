"""Wheels and gyro of one robot side by side: do they tell of the same turns, and if not, who errs?

A second of driving is compared at a time, by what is known of both (`turn_fit`). What a gyro does
wrong looks the same whatever the wheels do: it says the same for ever, turns the other way, or
turns always by as much too much. What slips does so while it drives, and by as much as it drives.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from enum import Enum
from typing import Final

from drslamd.conventions import SECOND_US
from drslamd.sensors.gyro.turn_fit import PER_SECOND, Second, turn_fit

SPAN_S: Final = 8
"""Seconds in which a fault shows."""
MEMORY_S: Final = 60
"""Seconds of driving from which it is learned how wheels and gyro go together."""
TURNED: Final = math.radians(12)
"""So much must be turned, in all, before signs can be compared."""
TURNED_SIZE: Final = math.radians(60)
"""Likewise, before sizes can."""
SIZES: Final = (0.5, 2.0)
"""Turns of the wheels over those of the gyro: a track that nobody measured is wrong by less."""
FEWEST_S: Final = 5
"""So many seconds must contradict each other before a bias is one."""
BIAS: Final = (math.radians(0.3), math.radians(4.0))
"""rad/s: less is no bias that matters, more is most often no bias but a wheel."""
BIAS_SIGMAS: Final = 3.0
LONG_S: Final = 30
"""Seconds after which wheels that slip all the time must have done so by their ways ..."""
MANY: Final = 25
"""... if they slipped in so many of them; else the gyro says nothing that makes sense."""
PASSES: Final = math.radians(0.5), 2.0
"""A bias that may be so large, with so many sigmas, passes no trial."""
SIGMAS: Final = 4.0
MOST_SPUN: Final = 0.3
"""Of a way: wheels of which one stands or is blocked contradict a gyro by more."""
LEAST: Final = math.radians(1.5)
"""rad: a contradiction is above this and above so many sigmas of the wheels."""
LIKELY, CLEARLY = 1.5, 20.0
"""Squares that are left by one explanation over those by another: what is likely before anything
is measured stays so up to the first, and something else must be better by the second."""


class GyroFault(Enum):
    """What can be wrong with a gyro; the value ends a sentence about it."""

    ABSENT = "says nothing any more"
    STUCK = "says the same for ever"
    INVERTED = "turns the other way"
    SCALED = "says turns of another size"
    BIASED = "says turns that are none"


class Comparison:
    """The last seconds of driving.

    Args:
        yaw_rad_per_m, yaw_rad_per_sqrt_m: sigmas of the wheels, as configured.
        half_track_m: from the middle to a wheel.

    Attributes:
        known: how both go together, by the seconds before those that are looked at.
        slips: seconds in which the wheels said another turn than the gyro; last_slip: when.
        spun_m: by how much the way of the newest second is too long, where a wheel spun in it.
    """

    def __init__(
        self, yaw_rad_per_m: float, yaw_rad_per_sqrt_m: float, half_track_m: float
    ) -> None:
        self._half_track_m = half_track_m
        self._per_m, self._per_sqrt_m = yaw_rad_per_m, yaw_rad_per_sqrt_m
        self._seconds: deque[Second] = deque(maxlen=SPAN_S)
        self._memory: deque[Second] = deque(maxlen=MEMORY_S)
        self._slipped: deque[Second | None] = deque(maxlen=LONG_S)
        self._now: Second | None = None
        self._nothing = turn_fit([], yaw_rad_per_sqrt_m, yaw_rad_per_m, 1.0)
        self.known = self._nothing
        self.slips = 0
        self.spun_m = 0.0
        self.last_slip: int | None = None

    def add(self, utime: int, s: float, path_m: float, wheels: float, gyro: float) -> bool:
        """One motion of `s` seconds that ended at `utime`; is a second complete by it?"""
        now = self._now or Second(utime - round(s * SECOND_US), 0.0, 0.0, 0.0, 0.0)
        now = Second(
            now.start, now.s + s, now.path_m + path_m, now.wheels + wheels, now.gyro + gyro
        )
        self._now = None if now.s >= 1 else now
        if now.s >= 1:
            self._seconds.append(now)
        return now.s >= 1

    def forget(self) -> None:
        """What comes is compared anew."""
        self._seconds.clear()
        self._memory.clear()
        self._slipped.clear()
        self._now, self.known = None, self._nothing

    def since(self) -> int:
        """When what is looked at began."""
        return self._seconds[0].start

    def try_out(self, bias_sigma: float) -> GyroFault | None:
        """Learn of the newest second, of a gyro that is on trial; what is wrong with it?

        Args:
            bias_sigma: of the gyro, rad/s.
        """
        self._memory.append(self._seconds[-1])
        return self._sign() or self._learned(bias_sigma)

    def watch(self, bias_sigma: float, *, is_live: bool = True) -> GyroFault | None:
        """Look at the newest second, of a gyro that is in use; what is wrong with it?

        A slip is counted; else it is learned of, too.

        Args:
            is_live: is the gyro known not to be stuck? Else a slip may be none.
        """
        if self._is_biased():
            return GyroFault.BIASED
        newest = self._seconds[-1]
        is_slip = self._contradicts([newest])
        self.spun_m = self._spun_m(newest) if is_slip and is_live else 0.0
        self._slipped.append(newest if is_slip else None)
        if is_slip:
            if is_live:
                self.slips += 1
                self.last_slip = newest.start
            return GyroFault.SCALED if self._is_senseless() else None
        self._memory.append(newest)
        return self._learned(bias_sigma)

    def is_passed(self) -> bool:
        """Has enough been turned to know that both tell of the same turns?"""
        turned = sum(abs(x.wheels) for x in self._memory)
        if turned <= TURNED or len(self._memory) < FEWEST_S:
            return False
        if not SIZES[0] < self.known.ratio < SIZES[1]:
            return False
        may_be = abs(self.known.bias_radps) + PASSES[1] * self.known.bias_sigma
        return may_be < PASSES[0] and not self._contradicts(self._seconds)

    def _learned(self, bias_sigma: float) -> GyroFault | None:
        """Learn how both go together; what is wrong with that?"""
        if len(self._memory) < FEWEST_S:
            return None
        found = turn_fit(self._memory, self._per_sqrt_m, self._per_m, bias_sigma)
        turned = sum(abs(x.wheels) for x in self._memory)
        if turned > TURNED_SIZE and not SIZES[0] < found.ratio < SIZES[1]:
            return GyroFault.SCALED
        sigmas = BIAS_SIGMAS * found.bias_sigma
        if abs(found.bias_radps) > max(BIAS[0], sigmas):
            return GyroFault.BIASED
        self.known = found
        return None

    def _sign(self) -> GyroFault | None:
        """Do both turn the same way?"""
        squared = sum(x.wheels**2 for x in self._memory)
        product = sum(x.wheels * x.gyro for x in self._memory)
        turned = sum(abs(x.wheels) for x in self._memory)
        return GyroFault.INVERTED if turned > TURNED and product < -squared / 4 else None

    def _contradicts(self, seconds: Sequence[Second]) -> bool:
        """Do both tell of other turns than the wheels' noise allows?"""
        path, turn = sum(x.path_m for x in seconds), sum(x.gyro for x in seconds)
        noise = math.hypot(self._per_sqrt_m * math.sqrt(path), PER_SECOND)
        allowed = max(LEAST, SIGMAS * math.hypot(noise, self.known.sigma(turn, path)))
        return abs(sum(map(self.known.apart, seconds))) > allowed

    def _is_biased(self) -> bool:
        """Is what both are apart rather a matter of time than of driving?

        Where speed does not tell, a little is taken for a bias, for a gyro that is wrongly let go
        costs less than one that is wrongly kept.
        """
        of = list(self._seconds)[-FEWEST_S:]
        if len(of) < FEWEST_S or not self._contradicts(of):
            return False
        apart = [self.known.apart(x) for x in of]
        rate, by_time = _fitted(apart, [x.s for x in of])
        by_path = self._left_by_path(of, apart)
        spread = math.sqrt(by_time / len(of))
        if abs(rate) < BIAS[0] or spread > max(abs(rate) / 2, math.radians(0.4)):
            return False
        noise = sum(self._per_sqrt_m**2 * x.path_m + PER_SECOND**2 for x in of)
        is_small = abs(rate) < BIAS[1] and by_time < LIKELY * by_path + noise
        return is_small or CLEARLY * (by_time + noise) < by_path

    def _spun_m(self, second: Second) -> float:
        """A wheel that loses its hold turns too far, and the middle goes half of that too far."""
        excess = abs(self.known.apart(second)) * self._half_track_m
        return excess if excess < MOST_SPUN * second.path_m else 0.0

    def _left_by_path(self, seconds: Sequence[Second], apart: Sequence[float]) -> float:
        """Squares that are left of what both are apart, but for the way of one wheel or of both."""
        levers = (-self._half_track_m, 0.0, self._half_track_m)
        ways = [[abs(x.path_m + lever * x.gyro) for x in seconds] for lever in levers]
        return min(_fitted(apart, way)[1] for way in ways)

    def _is_senseless(self) -> bool:
        """Do both contradict each other nearly always, and the way of no wheel explains it?"""
        slips = [second for second in self._slipped if second is not None]
        if len(slips) < MANY:
            return False
        apart = [self.known.apart(second) for second in slips]
        return self._left_by_path(slips, apart) > sum(a * a for a in apart) / 2


def _fitted(apart: Sequence[float], by: Sequence[float]) -> tuple[float, float]:
    """The slope of what grows with `by`, and the squares that are left."""
    slope = sum(a * b for a, b in zip(apart, by, strict=True)) / max(sum(b * b for b in by), 1e-12)
    return slope, sum((a - slope * b) ** 2 for a, b in zip(apart, by, strict=True))
