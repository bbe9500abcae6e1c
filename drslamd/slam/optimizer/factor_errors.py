"""Errors of factors, defined here once, so that every optimiser minimises the same cost:

odometry   e = [R_i' (p_j - p_i), theta_j - theta_i] - measured, corrected by scale and yaw rate
closure    the same, without correction
range      e = d + bias + near_bias exp(-d / L) - r,   d = |p_j + R_j q_j - p_i - R_i q_i|
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drslamd.slam import range_model, se2
from drslamd.slam.optimizer.problem import BetweenFactors, OdometryFactors, RangeFactors
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.range_model import RangeModel
from drslamd.slam.se2 import Array


def pose_errors(poses: Array, factors: BetweenFactors, measured: Array) -> Array:
    """(m, 3) predicted minus measured relative poses, in frame i."""
    i, j = poses[factors.i].T, poses[factors.j].T
    cos, sin, x, y = np.cos(i[2]), np.sin(i[2]), j[0] - i[0], j[1] - i[1]
    error = np.empty((3, len(factors)))
    error[0], error[1] = cos * x + sin * y, cos * y - sin * x
    error[2] = j[2] - i[2]
    error -= measured.T
    error[2] = se2.wrap(error[2])
    return np.asarray(error.T)


def corrected(odometry: OdometryFactors, calibration: Calibration) -> Array:
    """(m, 3) odometry with scale, yaw rate and turn taken out; what turns move of a way is as much
    longer or shorter as the way."""
    scale, yaw, turn = (
        constant[odometry.robot]
        for constant in (calibration.scale, calibration.yaw, calibration.turn)
    )
    measured = odometry.measured.T
    out = measured - yaw * odometry.by_yaw.T + turn * by_turn(odometry, calibration).T
    out[:2] -= scale * measured[:2]
    return np.asarray(out.T)


def by_turn(odometry: OdometryFactors, calibration: Calibration) -> Array:
    """(m, 3) how `corrected` moves when turns are longer by a fraction."""
    out = odometry.by_turn.copy()
    out[:, :2] *= 1 - calibration.scale[odometry.robot, None]
    return np.asarray(out)


def by_scale(odometry: OdometryFactors, calibration: Calibration) -> Array:
    """(m, 2) how places of `corrected` move when ways are shorter by a fraction, times -1."""
    turn = calibration.turn[odometry.robot, None]
    return np.asarray(odometry.measured[:, :2] + turn * odometry.by_turn[:, :2])


class RangeErrors(NamedTuple):
    """Of m ranges, as complex numbers x + iy.

    Attributes:
        error: (m,) predicted minus measured, m.
        direction: (m,) unit line of sight from i to j in w.
        arm_i, arm_j: (m,) from the poses to the antennas in w.
        shape: (m,) how the error grows with the near-range bias (`RangeModel.near_range_shape`).
        slope: (m,) and with the distance, a little less or more than one by that bias.
    """

    error: Array
    direction: Array
    arm_i: Array
    arm_j: Array
    shape: Array
    slope: Array

    @property
    def along(self) -> Array:
        """(m,) how the error grows with what moves end j, x + iy in w."""
        return self.slope * self.direction


def range_errors(
    poses: Array, ranges: RangeFactors, calibration: Calibration, model: RangeModel
) -> RangeErrors:
    """Of all ranges."""
    turn = np.exp(1j * poses[:, 2])
    arm_i, arm_j = (
        turn[k] * arm for k, arm in zip((ranges.i, ranges.j), ranges.arms(calibration), strict=True)
    )
    place = poses[:, 0] + 1j * poses[:, 1]
    sight = place[ranges.j] + arm_j - place[ranges.i] - arm_i
    error, direction = range_model.residuals(sight, ranges.measured)  # eq. (1)
    shape = model.near_range_shape(error + ranges.measured)
    near = calibration.near_bias * shape
    error += calibration.bias[ranges.pair]
    error += near
    return RangeErrors(error, direction, arm_i, arm_j, shape, 1 - near / model.near_reach_m)
