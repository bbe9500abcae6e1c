"""The team's least-squares problem as plain arrays: what every optimiser of module 3 receives.

Poses ``w_T_k`` are numbered in the order of time over all robots. A factor names its two poses by
that number. Errors are defined here once, so that every optimiser minimises the same cost:

    odometry   e = [R_i' (p_j - p_i), theta_j - theta_i] - measured, corrected by scale and yaw rate
    closure    the same, without correction
    range      e = |p_j + R_j q_j - p_i - R_i q_i| + bias + near_bias exp(-r / L) - r
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drslamd.slam import range_model, se2
from drslamd.slam.range_model import LINKTRACK, RangeModel
from drslamd.slam.se2 import Array, Index

RIDGE = 1e-10
"""Added to correlations before they are inverted; nobody knows his correlations so well."""


@dataclass(frozen=True)
class BetweenFactors:
    """m relative poses i_T_j with covariances (m, 3, 3) of x, y, theta in frame i."""

    i: Index
    j: Index
    measured: Array
    covariance: Array

    def __len__(self) -> int:
        return len(self.i)

    def chosen(self, which: NDArray[np.bool_]) -> BetweenFactors:
        columns = (self.i, self.j, self.measured, self.covariance)
        return BetweenFactors(*(column[which] for column in columns))

    @staticmethod
    def none() -> BetweenFactors:
        """Of no poses."""
        at = np.zeros(0, dtype=np.int64)
        return BetweenFactors(at, at, np.zeros((0, 3)), np.zeros((0, 3, 3)))

    @staticmethod
    def joined(parts: Iterable[BetweenFactors]) -> BetweenFactors:
        """All factors of all parts, at least one."""
        columns = ((e.i, e.j, e.measured, e.covariance) for e in parts)
        return BetweenFactors(*(np.concatenate(column) for column in zip(*columns, strict=True)))

    @cached_property
    def information(self) -> Array:
        """(m, 3, 3) inverse covariances, positive definite whatever rounding did to them."""
        sigma = np.sqrt(np.einsum("kii->ki", self.covariance))
        scale = sigma[:, :, None] * sigma[:, None, :]
        inverse = np.linalg.inv(self.covariance / scale + RIDGE * np.eye(3)) / scale
        return np.asarray((inverse + np.swapaxes(inverse, 1, 2)) / 2)


@dataclass(frozen=True)
class OdometryFactors(BetweenFactors):
    """Odometry between neighbouring keyframes.

    Attributes:
        robot: (m,) the robot whose calibration applies, as the problem numbers them.
        by_yaw: (m, 3) how `measured` moves with the constant yaw rate, per rad/m, over the way that
            was driven; its last column is how long that is.
    """

    robot: Index
    by_yaw: Array


@dataclass(frozen=True)
class CarriedEnds:
    """Of ranges that odometry brought to other poses, whose ends move with its constants.

    Attributes:
        rows: (c,) which ranges, ascending.
        robots: (c, 2) whose poses i and j are, as the problem numbers them.
        moves: (c, 2, 2, 2) m: how q_i and q_j (second axis) move with the yaw rate (per rad/m) and
            the scale of that robot (third axis).
    """

    rows: Index
    robots: Index
    moves: Array

    @staticmethod
    def none() -> CarriedEnds:
        empty = np.zeros(0, dtype=np.int64)
        return CarriedEnds(empty, empty.reshape(0, 2), np.zeros((0, 2, 2, 2)))

    def chosen(self, which: NDArray[np.bool_]) -> CarriedEnds:
        """Those of the ranges `which` (m,)."""
        stay = which[self.rows]
        place = np.cumsum(which) - 1
        return CarriedEnds(place[self.rows[stay]], self.robots[stay], self.moves[stay])


@dataclass(frozen=True)
class RangeFactors:
    """m distances.

    Attributes:
        q_i, q_j: (m, 2) between which points, in the frames of poses i and j, m.
        measured, sigma: (m,) m.
        pair: (m,) the pair of robots whose bias applies, as the problem numbers them.
        carried: those of them whose points move with the constants of odometry.
    """

    i: Index
    j: Index
    q_i: Array
    q_j: Array
    measured: Array
    sigma: Array
    pair: Index
    carried: CarriedEnds = field(default_factory=CarriedEnds.none)

    def __len__(self) -> int:
        return len(self.i)

    def chosen(self, which: NDArray[np.bool_]) -> RangeFactors:
        return RangeFactors(
            i=self.i[which],
            j=self.j[which],
            q_i=self.q_i[which],
            q_j=self.q_j[which],
            measured=self.measured[which],
            sigma=self.sigma[which],
            pair=self.pair[which],
            carried=self.carried.chosen(which),
        )

    @property
    def is_carried(self) -> NDArray[np.bool_]:
        """(m,)"""
        out = np.zeros(len(self), dtype=bool)
        out[self.carried.rows] = True
        return out

    def arms(self, calibration: Calibration) -> tuple[Array, Array]:
        """q_i and q_j (m, 2), yaw rate and scale taken out."""
        ends, carried = np.stack([self.q_i, self.q_j]), self.carried
        constants = np.stack([calibration.yaw, calibration.scale], axis=-1)[carried.robots]
        moved = (constants[..., None] * carried.moves).sum(axis=2)
        ends[:, carried.rows] -= np.swapaxes(moved, 0, 1)
        return ends[0], ends[1]


@dataclass(frozen=True)
class Priors:
    """Sigmas of the sensors' constants before anything is measured.

    Attributes:
        bias: (pairs,) m, half widths of Cauchy's distribution (or sigmas of Gauss's).
        scale: (robots,) fraction, likewise.
        yaw: (robots,) rad/m.
        near_bias: (1,) m, for the whole team: its modules are of one kind, and the near-range bias
            follows the power that is received.
        has_cauchy_tails: have biases and scales?
    """

    bias: Array
    scale: Array
    yaw: Array
    near_bias: Array
    has_cauchy_tails: bool = True

    def stiffness(self, values: Array, widths: Array) -> Array:
        """Information that priors of these widths hold values with: the weight of their cost."""
        if not self.has_cauchy_tails:
            return np.asarray(widths**-2.0)
        return np.asarray(1 / (widths**2 * (1 + (values / widths) ** 2)))


@dataclass(frozen=True)
class Problem:
    """One connected group of robots.

    Attributes:
        robot, n: (k,) whose keyframe each pose is, and which.
        initial: (k, 3) w_T_k.
        gauge: the pose that is held where `initial` has it.
        model: of its ranges.
    """

    robot: Index
    n: Index
    initial: Array
    gauge: int
    odometry: OdometryFactors
    closures: BetweenFactors
    ranges: RangeFactors
    priors: Priors
    model: RangeModel = LINKTRACK


@dataclass(frozen=True)
class Calibration:
    """What an optimiser learned about the sensors, in the numbering of `Priors`."""

    bias: Array
    scale: Array
    yaw: Array
    near_bias: Array

    @staticmethod
    def zero(priors: Priors) -> Calibration:
        sigmas = (priors.bias, priors.scale, priors.yaw, priors.near_bias)
        return Calibration(*(np.zeros(len(sigma)) for sigma in sigmas))

    def plus(self, step: Calibration) -> Calibration:
        return Calibration(
            bias=self.bias + step.bias,
            scale=self.scale + step.scale,
            yaw=self.yaw + step.yaw,
            near_bias=self.near_bias + step.near_bias,
        )


@dataclass(frozen=True)
class Solution:
    """Poses (k, 3) in the order of the problem, and how they were reached.

    Attributes:
        covariances: marginals (3, 3) of x, y, theta in w, for the poses that were asked for.
        spread: sigmas of the calibration, priors included, where marginals were asked for.
    """

    poses: Array
    calibration: Calibration
    cost: float
    iterations: int
    converged: bool
    covariances: dict[int, Array] = field(default_factory=dict)
    spread: Calibration | None = None


def pose_errors(poses: Array, factors: BetweenFactors, measured: Array) -> Array:
    """(m, 3) predicted minus measured relative poses, in frame i."""
    error = se2.between(poses[factors.i], poses[factors.j]) - measured
    error[:, 2] = se2.wrap(error[:, 2])
    return error


def corrected(odometry: OdometryFactors, calibration: Calibration) -> Array:
    """(m, 3) odometry with scale and yaw rate taken out."""
    scale, yaw = calibration.scale[odometry.robot], calibration.yaw[odometry.robot]
    out = odometry.measured - yaw[:, None] * odometry.by_yaw
    out[:, :2] -= scale[:, None] * odometry.measured[:, :2]
    return np.asarray(out)


def range_errors(
    poses: Array, ranges: RangeFactors, calibration: Calibration, model: RangeModel
) -> tuple[Array, Array, Array, Array]:
    """Errors (m,), unit line of sight from i to j in w (m,), and both arms in w (m,); x + iy."""
    arm_i, arm_j = (
        np.exp(1j * poses[k, 2]) * (q[:, 0] + 1j * q[:, 1])
        for k, q in zip((ranges.i, ranges.j), ranges.arms(calibration), strict=True)
    )
    place = poses[:, 0] + 1j * poses[:, 1]
    sight = place[ranges.j] + arm_j - place[ranges.i] - arm_i
    error, direction = range_model.residuals(sight, ranges.measured)  # eq. (1)
    error += calibration.bias[ranges.pair]
    error += calibration.near_bias * model.near_range_shape(ranges.measured)
    return error, direction, arm_i, arm_j
