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
        half_track_m: from its middle to its wheels; 0 where its odometry has no sides.
    """

    noise: OdometryNoise
    antenna_x_m: float = 0.0
    antenna_y_m: float = 0.0
    antenna_z_m: float = 0.0
    half_track_m: float = 0.0

    @property
    def antenna(self) -> Array:
        """(2,) in the body frame, m."""
        return np.array([self.antenna_x_m, self.antenna_y_m])

    def is_plausible(self) -> bool:
        """Could a configuration say this?"""
        places = (self.antenna_x_m, self.antenna_y_m, self.antenna_z_m)
        has_places = all(abs(v) <= MOST_ANTENNA_M for v in places)
        return self.noise.is_plausible() and has_places and 0 <= self.half_track_m <= MOST_ANTENNA_M

    def numbers(self) -> tuple[float, ...]:
        """Eight, as they travel: sigmas of odometry, the antenna's place, half of the track."""
        antenna = self.antenna_x_m, self.antenna_y_m, self.antenna_z_m
        return (*astuple(self.noise), *antenna, self.half_track_m)

    @staticmethod
    def of_numbers(numbers: tuple[float, ...]) -> RobotModel:
        """What `numbers` gave."""
        return RobotModel(OdometryNoise(*numbers[:4]), *numbers[4:])


UNTOLD = RobotModel(OdometryNoise(0.10, math.radians(0.15), 0.01, math.radians(0.5)))
"""Until a robot has said what it is like: the defaults of the configuration."""
