"""The turn of a robot whose base has a gyro: by the gyro, while it can be believed.

A gyro is on trial first: the wheels give the turn until both have told of the same turns. Then it
gives the turn. While the wheels stand, so does the robot: its heading is held, and what the gyro
says is its bias. A gyro that is found wrong is on trial again, and what it turned since it went
wrong is given back: the heading is then that of the wheels, as if there had been no gyro.

While a gyro is in use its bias is left as it is, for what is left of it counts as constant; only
when it is another one, that is taken out, and the gyro counts as another from then on.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Final, NamedTuple

from drslamd.conventions import SECOND_US
from drslamd.sensors.gyro.comparison import SPAN_S, Comparison, GyroFault
from drslamd.sensors.gyro.heading_track import GyroSample, HeadingTrack
from drslamd.sensors.gyro.rest import GyroAtRest
from drslamd.sensors.samples import GyroSigmas, Motion

STILL_US: Final = 3 * SECOND_US // 10
"""Wheels that did not move for so long stand."""
ABSENT_US: Final = SECOND_US
SHOWN_US: Final = 10 * SECOND_US
"""So long is a slip spoken of, and a fault that nothing shows any more."""
STUCK_US, STUCK_READINGS = 5 * SECOND_US, 15
"""A gyro that says the same for so long, in more than so many readings ..."""
STUCK_APART: Final = math.radians(3)
"""... while the wheels turned otherwise by so much, is stuck."""
LIVE_READINGS: Final = 5
"""A gyro that said the same in more may be about to be found stuck."""
UNTOLD_BIAS: Final = math.radians(0.5)
"""rad/s: one sigma of the bias of a gyro that was not seen at rest, in case it is broken."""
FAR: Final = math.radians(0.5)
"""rad/s: so much of a bias is worth a word, though it is taken out."""
MOST_REMEMBERED: Final = 2_000
"""Motions: more than any base sends in `SPAN_S`, and then some."""
MOST_BACK: Final = 3.0
"""rad that are given back at once: a step of odometry holds 3.2."""


class _Step(NamedTuple):
    utime: int
    wheels: float
    used: float


class GyroHeading:
    """Of one robot.

    Args:
        sigmas: of its gyro; wheels_yaw: sigmas of the wheels' yaw, rad/m and rad/sqrt(m).
        half_track_m: from the middle to a wheel.
        is_reversed: does the gyro count turns to the right?

    Attributes:
        track: of the gyro; comparison: with the wheels; rest: what it says while they stand.
        is_in_use: does it give the turns?
        faults: how often each was found.
    """

    def __init__(
        self,
        sigmas: GyroSigmas,
        wheels_yaw: tuple[float, float],
        half_track_m: float,
        *,
        is_reversed: bool = False,
    ) -> None:
        self.track = HeadingTrack(-1.0 if is_reversed else 1.0)
        self.comparison = Comparison(*wheels_yaw, half_track_m)
        self.rest = GyroAtRest(sigmas)
        self.is_in_use = False
        self.faults: dict[GyroFault, int] = dict.fromkeys(GyroFault, 0)
        self._last: tuple[int, float] | None = None
        self._utime: int | None = None
        self._steps: deque[_Step] = deque(maxlen=MOST_REMEMBERED)
        self._still_since: int | None = None
        self._apart_equal = 0.0
        self._spun_m = 0.0
        self._shown: tuple[GyroFault, int] | None = None

    @property
    def is_there(self) -> bool:
        """Did it ever say anything?"""
        return self.track.newest is not None

    def add(self, sample: GyroSample) -> None:
        """Take one reading; before the motion of the same time."""
        self.track.add(sample)

    def turned(self, motion: Motion) -> Motion:
        """The motion, with the turn that is believed."""
        now, before, self._utime = self.track.at(motion.utime), self._utime, motion.utime
        last, self._last = self._last, now
        if motion.gap or before is None or motion.utime <= before:
            self._still_since = None
            self.rest.end()
            return motion
        if now is None or last is None or last[0] != now[0]:
            return self._without(motion)
        s = (motion.utime - before) / SECOND_US
        if self._stands(motion, before):
            self._rest(motion.utime, *now)
            return replace(motion, turn_rad=0.0, gyro=self._stated())
        self.rest.end()
        turn = now[1] - last[1] - self.rest.bias_radps * s
        used = turn if self.is_in_use else motion.turn_rad
        self._remember(_Step(motion.utime, motion.turn_rad, used))
        fault = self._fault(motion, s, turn)
        if fault is not None:
            return self._given_back(motion, *fault)
        distance = self._shortened(motion.distance_m)
        return replace(motion, distance_m=distance, turn_rad=used, gyro=self._stated())

    def _shortened(self, distance: float) -> float:
        """Without what wheels spun in the second before."""
        spun = min(self._spun_m, abs(distance) / 2)
        self._spun_m -= spun
        return distance - math.copysign(spun, distance)

    def fault(self, utime: int) -> GyroFault | None:
        """What is wrong with the gyro, or was a moment ago."""
        newest, rolled = self.track.newest, self._utime
        if newest is not None and rolled is not None and rolled - newest > ABSENT_US:
            return GyroFault.ABSENT
        if self._shown is not None and utime - self._shown[1] < SHOWN_US:
            return self._shown[0]
        return GyroFault.BIASED if abs(self.rest.bias_radps) > FAR else None

    def counters(self) -> dict[str, int]:
        """Everything that is counted, by flat names."""
        faults = {f"gyro.faults.{fault.name}": count for fault, count in self.faults.items()}
        return {
            "gyro.refused": self.track.refused,
            "gyro.broken": self.track.broken,
            "gyro.slips": self.comparison.slips,
            **{name: count for name, count in faults.items() if count},
        }

    def slips(self, utime: int) -> bool:
        """Did the wheels slip a moment ago?"""
        last = self.comparison.last_slip
        return last is not None and utime - last < SHOWN_US

    def _stated(self) -> GyroSigmas | None:
        return self.rest.told if self.is_in_use else None

    def _without(self, motion: Motion) -> Motion:
        """The gyro says nothing of this motion."""
        self.rest.end()
        if self.is_in_use:
            self._drop(GyroFault.ABSENT, motion.utime)
        return motion

    def _remember(self, step: _Step) -> None:
        self._steps.append(step)
        while self._steps[0].utime < step.utime - (SPAN_S + 2) * SECOND_US:
            self._steps.popleft()

    def _stands(self, motion: Motion, before: int) -> bool:
        if motion.distance_m or motion.turn_rad:
            self._still_since = None
            return False
        self._still_since = before if self._still_since is None else self._still_since
        return motion.utime - self._still_since > STILL_US

    def _rest(self, utime: int, stretch: int, angle: float) -> None:
        """The robot stands: what its gyro says is bias."""
        if not self.rest.add(utime, stretch, angle, is_in_use=self.is_in_use):
            return
        # another bias than was known
        if self.is_in_use:
            self._drop(GyroFault.BIASED, utime)
        self.comparison.forget()

    def _fault(self, motion: Motion, s: float, turn: float) -> tuple[GyroFault, int] | None:
        """What is found wrong with the gyro now, and since when it was."""
        track, comparison = self.track, self.comparison
        apart = motion.turn_rad - turn
        self._apart_equal = self._apart_equal + apart if track.equal else 0.0
        is_long = motion.utime - track.equal_since > STUCK_US and track.equal > STUCK_READINGS
        if track.equal and is_long and abs(self._apart_equal) > STUCK_APART:
            return GyroFault.STUCK, track.equal_since
        path = abs(motion.distance_m)
        if not comparison.add(motion.utime, s, path, motion.turn_rad, turn):
            return None
        sigma = self.rest.told.yaw_rad_per_s if self.rest.is_known else UNTOLD_BIAS
        if self.is_in_use:
            fault = comparison.watch(sigma, is_live=track.equal < LIVE_READINGS)
            self._spun_m += comparison.spun_m
        else:
            fault = comparison.try_out(sigma)
        if fault is not None:
            return fault, comparison.since()
        self.is_in_use = self.is_in_use or comparison.is_passed()
        return None

    def _given_back(self, motion: Motion, fault: GyroFault, since: int) -> Motion:
        """The motion, and what the gyro turned wrongly since then."""
        used = self._steps[-1].used
        back = sum(step.wheels - step.used for step in self._steps if step.utime > since)
        was_in_use = self.is_in_use
        self._drop(fault, motion.utime)
        if fault is GyroFault.BIASED:
            self.rest.doubt()
        if not was_in_use:
            return motion
        back = max(-MOST_BACK, min(MOST_BACK, math.remainder(back, 2 * math.pi)))
        # (of this motion, too, it gives back what the gyro had turned)
        return replace(motion, turn_rad=used + back, gyro_wrong_since=since)

    def _drop(self, fault: GyroFault, utime: int) -> None:
        is_news = self.is_in_use or self.fault(utime) is not fault
        self.faults[fault] += is_news
        self.is_in_use = False
        self._shown = (fault, utime)
        self.comparison.forget()
        self._apart_equal = self._spun_m = 0.0
