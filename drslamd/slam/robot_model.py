"""What the team must know of one robot's sensors to use what it measured."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from drslamd.conventions import grid_index
from drslamd.sensors.samples import Motion
from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.se2 import Array

MOST_ANTENNA_M = 5.001
"""As far from the middle of a robot as the configuration allows, and a millimetre for rounding."""

PLAIN, BY_GYRO = 8, 14
"""How many numbers tell of a robot without a gyro, and with one."""
SPLIT = 2**16
"""A sample of the grid has more digits than a 32-bit float, and travels as two of them."""


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
        """As they travel: four sigmas of odometry, the antenna's place, half of the track; and
        where a gyro gives the heading its two sigmas and the samples since and until when."""
        antenna = self.antenna_x_m, self.antenna_y_m, self.antenna_z_m
        plain = (*self.noise.by_wheels, *antenna, self.half_track_m)
        gyro = self.noise.gyro
        if gyro is None:
            return plain
        samples = (*divmod(gyro.since, SPLIT), *divmod(gyro.until, SPLIT))
        return (*plain, gyro.yaw_rad_per_sqrt_s, gyro.yaw_rad_per_s, *samples)

    @staticmethod
    def of_numbers(numbers: tuple[float, ...]) -> RobotModel:
        """What `numbers` gave."""
        gyro = None
        if len(numbers) > PLAIN:
            since_high, since, until_high, until = (int(v) for v in numbers[PLAIN + 2 :])
            span = since_high * SPLIT + since, until_high * SPLIT + until
            gyro = GyroNoise(numbers[PLAIN], numbers[PLAIN + 1], *span)
        scale, yaw, shift, turn = numbers[:4]
        return RobotModel(OdometryNoise(scale, yaw, shift, turn, gyro), *numbers[4:PLAIN])


def with_gyro(model: RobotModel, motion: Motion) -> RobotModel:
    """The model after one more motion: who gave its turn, and since when a gyro does."""
    gyro, now = model.noise.gyro, motion.gyro
    if gyro is None and now is None:
        return model
    n = grid_index(motion.utime)
    if now is not None and (gyro is None or not gyro.is_in_use):
        gyro = GyroNoise(now.yaw_rad_per_sqrt_s, now.yaw_rad_per_s, n + 1)
    elif now is not None and gyro is not None:
        gyro = replace(
            gyro, yaw_rad_per_sqrt_s=now.yaw_rad_per_sqrt_s, yaw_rad_per_s=now.yaw_rad_per_s
        )
    elif gyro is not None and gyro.is_in_use and not motion.gap:
        wrong = motion.gyro_wrong_since
        until = n - 1 if wrong is None else grid_index(wrong)
        gyro = replace(gyro, until=max(gyro.since, until))
    if gyro == model.noise.gyro:
        return model
    return replace(model, noise=replace(model.noise, gyro=gyro))


UNTOLD = RobotModel(OdometryNoise(0.10, math.radians(0.15), 0.01, math.radians(0.5)))
"""Until a robot has said what it is like: the defaults of the configuration."""
