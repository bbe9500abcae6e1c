"""A way by odometry from a solved pose, step by step: `slam.pose_now` for fifty times a second."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from drslamd.conventions import GRID_HZ
from drslamd.near.packed import Packed, moved, times, turned
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.se2 import Array


class Leg:
    """Of one robot, since its last solved keyframe.

    Attributes:
        start: (3,) the solved pose, in w.
    """

    def __init__(
        self, start: Array, noise: OdometryNoise, level: float, correction: Correction
    ) -> None:
        """
        Args:
            level: how many times the sigma of odometry is what is configured.
            correction: of this robot's odometry.
        """
        self.start = start
        self._start: tuple[float, float, float] = tuple(start.tolist())
        self._noise, self._level, self._correction = noise, level, correction
        self._gyro = noise.gyro if noise.learns_gyro else None
        self._x = self._y = self._theta = 0.0
        self._sums, self._path_m = [0.0] * 6, 0.0
        self._end: tuple[float, float, float] = self._start

    @staticmethod
    def of(estimate: TeamEstimate, robot: int, noise: OdometryNoise) -> Leg:
        """Of a robot of a solution, from its last solved pose."""
        level = estimate.odometry_level.get(robot, 1.0)
        start = estimate.trajectories[robot].poses[-1]
        return Leg(start, estimate.noise_left(robot, noise), level, estimate.correction(robot))

    def go(self, before: Sequence[float], after: Sequence[float], s: float) -> None:
        """One step of odometry, between two poses (3,) o_T_i of it that are `s` seconds apart."""
        cos, sin = math.cos(before[2]), math.sin(before[2])
        x, y = after[0] - before[0], after[1] - before[1]
        x, y, theta = cos * x + sin * y, cos * y - sin * x, after[2] - before[2]
        scale, yaw, turn = self._correction
        bend = turn * theta - yaw * math.hypot(x, y)
        # as in `Correction.path`: half of what turned too little acts over the step
        heading = self._theta + bend / 2
        cos, sin = (1 - scale) * math.cos(heading), (1 - scale) * math.sin(heading)
        x, y = cos * x - sin * y, sin * x + cos * y
        # a gyro errs by time, but not while nothing moves (`GyroNoise.seconds`)
        length = math.hypot(x, y)
        weight = length if self._gyro is None else s if length or theta else 0.0
        self._path_m += length
        self._add(weight, self._x + x / 2, self._y + y / 2)
        self._x, self._y, self._theta = self._x + x, self._y + y, self._theta + theta + bend
        w_x, w_y, w_theta = self._start
        cos, sin = math.cos(w_theta), math.sin(w_theta)
        x, y = w_x + cos * self._x - sin * self._y, w_y + sin * self._x + cos * self._y
        self._end = x, y, w_theta + self._theta

    def _add(self, weight: float, middle_x: float, middle_y: float) -> None:
        """The terms of `noise.step_sums`, by path or by time."""
        sums = self._sums
        sums[0] += weight
        sums[1] += weight * middle_y
        sums[2] -= weight * middle_x
        sums[3] += weight * middle_y * middle_y
        sums[4] -= weight * middle_x * middle_y
        sums[5] += weight * middle_x * middle_x

    @property
    def end(self) -> tuple[float, float, float]:
        """x, y, theta in w where it leads; theta counts on."""
        return self._end

    @property
    def lever(self) -> tuple[float, float]:
        """From its start to its end, x and y in w."""
        return self._end[0] - self._start[0], self._end[1] - self._start[1]

    @property
    def added(self) -> Packed:
        """What it adds to the covariance in w: `noise.twist_covariance`, taken to its end."""
        noise, sums = self._noise, self._sums
        s, y, x_neg, yy, xy_neg, xx = sums
        random, rate = noise.yaw_rad_per_sqrt_m, noise.yaw_rad_per_m
        if self._gyro is not None:
            random, rate = self._gyro.yaw_rad_per_sqrt_s, self._gyro.yaw_rad_per_s
        turn, drawn = random**2, noise.translation_per_sqrt_m**2 * self._path_m
        wx, wy = noise.scale * self._x, noise.scale * self._y
        by, bx, bs = (rate * value for value in (y, x_neg, s))
        twist = (
            turn * yy + drawn + wx * wx + by * by,
            turn * xy_neg + wx * wy + by * bx,
            turn * y + by * bs,
            turn * xx + drawn + wy * wy + bx * bx,
            turn * x_neg + bx * bs,
            turn * s + bs * bs,
        )
        at_end = moved(twist, self._x, self._y)
        theta = self._start[2]
        return times(self._level**2, turned(at_end, math.cos(theta), -math.sin(theta)))

    def along(self, way: Array) -> None:
        """All steps of a way (k, 3), poses o_T_i of a track."""
        for before, after in pairwise(way.tolist()):
            self.go(before, after, 1 / GRID_HZ)
