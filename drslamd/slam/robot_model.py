"""What the team must know of one robot's sensors to use what it measured."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np

from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.se2 import Array

MOST_ANTENNA_M = 5.001
"""As far from the middle of a robot as the configuration allows, and a millimetre for rounding."""


@dataclass(frozen=True)
class RobotModel:
    """One robot.

    Attributes:
        noise: of its odometry.
        antenna_x_m, antenna_y_m: its antenna in the body frame.
        antenna_z_m: the antenna above the floor, or any level that the team shares.
    """

    noise: OdometryNoise
    antenna_x_m: float = 0.0
    antenna_y_m: float = 0.0
    antenna_z_m: float = 0.0

    @property
    def antenna(self) -> Array:
        """(2,) in the body frame, m."""
        return np.array([self.antenna_x_m, self.antenna_y_m])

    def is_plausible(self) -> bool:
        """Could a configuration say this?"""
        places = (self.antenna_x_m, self.antenna_y_m, self.antenna_z_m)
        return self.noise.is_plausible() and all(abs(v) <= MOST_ANTENNA_M for v in places)

    def numbers(self) -> tuple[float, ...]:
        """Seven numbers, as they travel: the sigmas of the odometry, then the antenna's place."""
        return (*astuple(self.noise), self.antenna_x_m, self.antenna_y_m, self.antenna_z_m)

    @staticmethod
    def of_numbers(numbers: tuple[float, ...]) -> RobotModel:
        """What `numbers` gave."""
        return RobotModel(OdometryNoise(*numbers[:4]), *numbers[4:])


UNTOLD = RobotModel(OdometryNoise(0.10, math.radians(0.15), 0.01, math.radians(0.5)))
"""Until a robot has said what it is like: the defaults of the configuration."""
