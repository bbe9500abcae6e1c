"""The bias of a gyro, learned while the robot stands."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from drslamd.conventions import SECOND_US
from drslamd.sensors.samples import GyroSigmas

REST_US: Final = SECOND_US
"""So long must a robot stand before it is looked at what its gyro says."""
MOST_BIAS: Final = math.radians(10)
"""rad/s: more is no gyro at rest, but somebody who turns the robot."""
SIGMAS: Final = 5.0
"""Beyond so many it is another bias; two seconds must agree on it."""


class GyroAtRest:
    """
    Args:
        sigmas: of the gyro, before anything is learned.

    Attributes:
        bias_radps: that is taken out, rad/s.
        told: sigmas of what is left.
    """

    def __init__(self, sigmas: GyroSigmas) -> None:
        self._sigmas = sigmas
        self.bias_radps = 0.0
        self.told = sigmas
        self._began: tuple[int, int, float] | None = None
        self._rested_s = self._rested_turn = 0.0
        self._other: float | None = None

    @property
    def is_known(self) -> bool:
        """Was it seen at rest?"""
        return self._rested_s > 0

    def doubt(self) -> None:
        """What was seen at rest is worth nothing any more."""
        self._rested_s = self._rested_turn = 0.0

    def end(self) -> None:
        """The robot moves, or nothing is known of it."""
        self._began = self._other = None

    def add(self, utime: int, stretch: int, angle: float, *, is_in_use: bool) -> bool:
        """What the gyro says of a robot that stands; is it another bias than was known?

        Args:
            stretch, angle: of `HeadingTrack.at`.
            is_in_use: does the gyro give turns? Then what is left counts as constant, and a bias
                that is only known better stays what it is.
        """
        if self._began is None or self._began[1] != stretch:
            self._began = (utime, stretch, angle)
        since, _, first = self._began
        if utime - since < REST_US:
            return False
        self._began = (utime, stretch, angle)
        s = (utime - since) / SECOND_US
        rate = (angle - first) / s
        sigma = self._sigmas.yaw_rad_per_sqrt_s / math.sqrt(s)
        if abs(rate - self.bias_radps) > SIGMAS * math.hypot(self.told.yaw_rad_per_s, sigma):
            return self._is_other(s, rate, sigma)
        self._other = None
        self._rested_s += s
        self._rested_turn += s * rate
        if not is_in_use:
            self._settle()
        return False

    def _is_other(self, s: float, rate: float, sigma: float) -> bool:
        before, self._other = self._other, rate
        agree = before is not None and abs(rate - before) < SIGMAS * math.sqrt(2) * sigma
        if not agree or abs(rate) > MOST_BIAS:
            return False
        self._rested_s, self._rested_turn, self._other = s, s * rate, None
        self.bias_radps = rate
        self.told = replace(self._sigmas, yaw_rad_per_s=sigma)
        return True

    def _settle(self) -> None:
        """Take out what is known of the bias, where that is worth another constant."""
        measured = self._sigmas.yaw_rad_per_sqrt_s / math.sqrt(self._rested_s)
        if measured < self.told.yaw_rad_per_s / 2:
            self.bias_radps = self._rested_turn / self._rested_s
            self.told = replace(self._sigmas, yaw_rad_per_s=measured)
