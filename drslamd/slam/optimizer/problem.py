"""The team's least-squares problem as plain arrays: what every optimiser of module 3 receives.

Poses ``w_T_k`` are numbered in the order of time over all robots. An edge names its two poses by
that number. Errors are defined here once, so that every optimiser minimises the same cost:

    odometry   e = [R_i' (p_j - p_i), theta_j - theta_i] - measured, corrected by scale and yaw rate
    closure    the same, without correction
    range      e = |p_j + R_j q_j - p_i - R_i q_i| + bias + near_bias exp(-r / L) - r
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drslamd.slam import se2
from drslamd.slam.se2 import Array

Index = NDArray[np.int64]

NEAR_RANGE_M = 3.0
"""L: at this range a third is left of what receivers misjudge of strong signals. The LinkTrack
modules of the MURP recordings have -0.25 m below 1 m, -0.14 m at 2 to 4 m and -0.06 m beyond 6 m;
Decawave's note APS011 prints such a curve over received power."""
RIDGE = 1e-10
"""Added to correlations before they are inverted; nobody knows his correlations so well."""


@dataclass(frozen=True)
class PoseEdges:
    """m relative poses i_T_j with covariances (m, 3, 3) of x, y, theta in frame i."""

    i: Index
    j: Index
    measured: Array
    covariance: Array

    def __len__(self) -> int:
        return len(self.i)

    def chosen(self, which: NDArray[np.bool_]) -> PoseEdges:
        columns = (self.i, self.j, self.measured, self.covariance)
        return PoseEdges(*(column[which] for column in columns))

    @cached_property
    def information(self) -> Array:
        """(m, 3, 3) inverse covariances, positive definite whatever rounding did to them."""
        sigma = np.sqrt(np.einsum("kii->ki", self.covariance))
        scale = sigma[:, :, None] * sigma[:, None, :]
        inverse = np.linalg.inv(self.covariance / scale + RIDGE * np.eye(3)) / scale
        return np.asarray((inverse + np.swapaxes(inverse, 1, 2)) / 2)


@dataclass(frozen=True)
class Links(PoseEdges):
    """Odometry: `robot` (m,) numbers the robot whose calibration applies, `path` (m,) metres."""

    robot: Index
    path: Array


@dataclass(frozen=True)
class Ranges:
    """m distances between the points q_i on pose i and q_j on pose j (m, 2), body frames."""

    i: Index
    j: Index
    q_i: Array
    q_j: Array
    measured: Array
    sigma: Array
    pair: Index
    """(m,) numbers the pair of robots whose bias applies."""

    def __len__(self) -> int:
        return len(self.i)

    def chosen(self, which: NDArray[np.bool_]) -> Ranges:
        columns = (self.i, self.j, self.q_i, self.q_j, self.measured, self.sigma, self.pair)
        return Ranges(*(column[which] for column in columns))


@dataclass(frozen=True)
class Priors:
    """Sigmas of the calibration before anything is measured."""

    bias: Array
    """(pairs,) metres, of Cauchy's distribution: most modules are calibrated to a decimetre, some
    by half a metre not at all, and few trajectories fix a bias well."""
    scale: Array
    """(robots,) fraction, likewise."""
    yaw: Array
    """(robots,) rad/m."""
    near_bias: Array
    """(1,) metres, for the whole team: its modules are of one kind, and the bias follows the power
    that is received."""


@dataclass(frozen=True)
class Problem:
    """One connected group of robots.

    Attributes:
        robot, n: (k,) whose keyframe each pose is, and which.
        initial: (k, 3) w_T_k.
        gauge: the pose that is held where `initial` has it.
    """

    robot: Index
    n: Index
    initial: Array
    gauge: int
    links: Links
    closures: PoseEdges
    ranges: Ranges
    priors: Priors


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
            self.bias + step.bias, self.scale + step.scale, self.yaw + step.yaw,
            self.near_bias + step.near_bias,
        )  # fmt: skip


@dataclass(frozen=True)
class Solution:
    """Poses (k, 3) in the order of the problem, and how they were reached."""

    poses: Array
    calibration: Calibration
    cost: float
    iterations: int
    converged: bool
    covariances: dict[int, Array] = field(default_factory=dict)
    """Marginals (3, 3) of x, y, theta in w, for the poses that were asked for."""
    spread: Calibration | None = None
    """Sigmas of the calibration, priors included, where marginals were asked for."""


def pose_errors(poses: Array, edges: PoseEdges, measured: Array) -> Array:
    """(m, 3) predicted minus measured relative poses, in frame i."""
    error = se2.between(poses[edges.i], poses[edges.j]) - measured
    error[:, 2] = se2.wrap(error[:, 2])
    return error


def corrected(links: Links, calibration: Calibration) -> Array:
    """(m, 3) odometry with scale and yaw rate taken out; the bend acts over half of the link."""
    x, y, theta = links.measured.T
    keep = 1 - calibration.scale[links.robot]
    bend = calibration.yaw[links.robot] * links.path
    return np.stack([keep * x + bend / 2 * y, keep * y - bend / 2 * x, theta - bend], axis=-1)


def near_range_shape(ranges: Array) -> Array:
    """How much of the bias of strong signals is in ranges (n,) m: all of it in those of none."""
    return np.asarray(np.exp(-np.maximum(ranges, 0.0) / NEAR_RANGE_M))


def range_errors(
    poses: Array, ranges: Ranges, calibration: Calibration
) -> tuple[Array, Array, Array, Array]:
    """Errors (m,), unit line of sight from i to j in w (m, 2), and both arms in w (m, 2)."""
    arm_i = se2.rotate(poses[ranges.i, 2], ranges.q_i)
    arm_j = se2.rotate(poses[ranges.j, 2], ranges.q_j)
    sight = poses[ranges.j, :2] + arm_j - poses[ranges.i, :2] - arm_i
    distance = np.maximum(np.hypot(sight[:, 0], sight[:, 1]), 1e-6)
    error = distance + calibration.bias[ranges.pair] - ranges.measured
    error += calibration.near_bias * near_range_shape(ranges.measured)
    return error, sight / distance[:, None], arm_i, arm_j
