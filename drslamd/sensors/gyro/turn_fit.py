"""How the turns that wheels tell go together with those of a gyro: by a factor, because of a track
that is not as configured, by the path, because one wheel is larger, and by time, because of a bias.

    wheels = ratio gyro + per_m path - bias s + noise

Least squares over seconds of driving. Where a robot drives at one speed only, nobody can tell path
from time: then it counts what is more likely from the start.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

RATIO_SIGMA: Final = 0.3
"""Of a track that nobody measured."""
PER_M_FACTOR: Final = 3.0
"""Times the sigma as configured: a wheel may be worn."""
PER_SECOND: Final = math.radians(0.1)
"""rad: what seconds of both are apart besides, for their stamps are not the same."""


class Second(NamedTuple):
    """What both said in about a second of driving: seconds, metres, and turns in rad."""

    start: int
    s: float
    path_m: float
    wheels: float
    gyro: float


@dataclass(frozen=True)
class TurnFit:
    """
    Attributes:
        ratio: turns of the wheels over those of the gyro.
        per_m: rad/m that the wheels turn too far.
        bias_radps: of the gyro.
        covariance: (3, 3) of these three.
    """

    ratio: float
    per_m: float
    bias_radps: float
    covariance: NDArray[np.float64]

    @property
    def bias_sigma(self) -> float:
        return float(np.sqrt(self.covariance[2, 2]))

    def apart(self, second: Second) -> float:
        """rad between both, but for what is known."""
        return second.wheels - self.ratio * second.gyro - self.per_m * second.path_m

    def sigma(self, gyro: float, path_m: float) -> float:
        """One sigma of that, rad, by what is not known well; `gyro` and `path_m` of all seconds."""
        way = np.array([gyro, path_m])
        return float(np.sqrt(way @ self.covariance[:2, :2] @ way))


def turn_fit(
    seconds: Sequence[Second], yaw_rad_per_sqrt_m: float, yaw_rad_per_m: float, bias_sigma: float
) -> TurnFit:
    """What seconds of driving say, and of none what is likely from the start.

    Args:
        yaw_rad_per_sqrt_m, yaw_rad_per_m: sigmas of the wheels, as configured.
        bias_sigma: of the gyro from the start, rad/s.
    """
    s, path, wheels, gyro = np.array([x[1:] for x in seconds]).reshape(-1, 4).T
    sigma = np.hypot(yaw_rad_per_sqrt_m * np.sqrt(path), PER_SECOND)
    rows = np.stack([gyro, path, -s], axis=-1) / sigma[:, None]
    believed = np.diag([RATIO_SIGMA, PER_M_FACTOR * yaw_rad_per_m, bias_sigma]) ** 2
    covariance = np.linalg.inv(rows.T @ rows + np.linalg.inv(believed))
    ratio, per_m, bias = covariance @ (rows.T @ ((wheels - gyro) / sigma))
    return TurnFit(1 + float(ratio), float(per_m), float(bias), covariance)
