"""The team's least-squares problem as plain arrays: what every optimiser of module 3 receives.

Poses ``w_T_k`` are numbered in the order of time over all robots. A factor names its two poses by
that number; what its error is say `factor_errors`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.calibration.range_scatter import SideBySide
from drslamd.slam.optimizer.sensor_priors import Calibration, Priors
from drslamd.slam.range_model import LINKTRACK, RangeModel
from drslamd.slam.se2 import Array, Index

TOO_LONG = 0.2
"""Of the cut: where sight is blocked for long a range that is too long by half a sigma counts for
little already, so that the shortest ones hold the solution."""
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

    @cached_property
    def _entries(self) -> Array:
        """(3, 3, m) the same, each entry of all factors side by side."""
        return np.ascontiguousarray(self.information.transpose(1, 2, 0))

    def weighed(self, errors: Array) -> Array:
        """(m, 3) W e of errors (m, 3)."""
        return np.asarray(np.einsum("dem,em->dm", self._entries, errors.T).T)

    def squares(self, errors: Array) -> Array:
        """(m,) e' W e of errors (m, 3)."""
        return np.asarray(np.einsum("md,md->m", errors, self.weighed(errors)))

    def cost(self, errors: Array) -> float:
        """Of errors (m, 3)."""
        return float(self.squares(errors).sum())


@dataclass(frozen=True)
class OdometryFactors(BetweenFactors):
    """Odometry between neighbouring keyframes.

    Attributes:
        robot: (m,) the robot whose calibration applies, as the problem numbers them.
        by_yaw: (m, 3) how `measured` moves with the constant yaw rate, per rad/m, over the way that
            was driven; its last column is how long that is.
        by_turn: (m, 3) likewise when turns are longer by a fraction.
    """

    robot: Index
    by_yaw: Array
    by_turn: Array

    def chosen(self, which: NDArray[np.bool_]) -> OdometryFactors:
        columns = (self.i, self.j, self.measured, self.covariance)
        of_robots = (self.robot, self.by_yaw, self.by_turn)
        return OdometryFactors(*(column[which] for column in (*columns, *of_robots)))


@dataclass(frozen=True)
class CarriedEnds:
    """Of ranges that odometry brought to other poses, whose ends move with its constants.

    Attributes:
        rows: (c,) which ranges, ascending.
        moves: (c, 2, 2, 2) m: how q_i and q_j (second axis) move with the yaw rate (per rad/m) and
            the scale of that robot (third axis).
    """

    rows: Index
    moves: Array

    @cached_property
    def shifts(self) -> Array:
        """(2, 2, c) the same as x + iy: of q_i and q_j, by yaw rate and scale."""
        return np.ascontiguousarray((self.moves @ [1, 1j]).transpose(1, 2, 0))

    @staticmethod
    def none() -> CarriedEnds:
        return CarriedEnds(np.zeros(0, dtype=np.int64), np.zeros((0, 2, 2, 2)))

    def chosen(self, which: NDArray[np.bool_]) -> CarriedEnds:
        """Those of the ranges `which` (m,)."""
        stay = which[self.rows]
        place = np.cumsum(which) - 1
        return CarriedEnds(place[self.rows[stay]], self.moves[stay])


@dataclass(frozen=True)
class RangeFactors:
    """m distances.

    Attributes:
        q_i, q_j: (m, 2) between which points, in the frames of poses i and j, m.
        measured, sigma: (m,) m.
        pair: (m,) the pair of robots whose bias applies, as the problem numbers them.
        robots: (m, 2) whose poses i and j are, as the problem numbers them.
        turned: (m, 2) by how much both robots stood turned against those poses, rad.
        carried: those of them whose points move with the constants of odometry.
    """

    i: Index
    j: Index
    q_i: Array
    q_j: Array
    measured: Array
    sigma: Array
    pair: Index
    robots: Index
    turned: Array
    carried: CarriedEnds = field(default_factory=CarriedEnds.none)

    def __len__(self) -> int:
        return len(self.i)

    def chosen(self, which: NDArray[np.bool_]) -> RangeFactors:
        if which.all():
            return self
        return RangeFactors(
            i=self.i[which],
            j=self.j[which],
            q_i=self.q_i[which],
            q_j=self.q_j[which],
            measured=self.measured[which],
            sigma=self.sigma[which],
            pair=self.pair[which],
            robots=self.robots[which],
            turned=self.turned[which],
            carried=self.carried.chosen(which),
        )

    @property
    def is_carried(self) -> NDArray[np.bool_]:
        """(m,)"""
        out = np.zeros(len(self), dtype=bool)
        out[self.carried.rows] = True
        return out

    def arms(self, calibration: Calibration) -> tuple[Array, Array]:
        """From the poses to the antennas, x + iy (m,) in the frames of i and j: yaw rate and scale
        taken out, each antenna where it really is."""
        (arm_i, arm_j), carried = (end.copy() for end in self._points), self.carried
        if len(carried.rows):
            for end, arm in enumerate((arm_i, arm_j)):
                robot = self.carriers[end]
                by_yaw, by_scale = carried.shifts[end]
                arm[carried.rows] -= (
                    calibration.yaw[robot] * by_yaw + calibration.scale[robot] * by_scale
                )
        if calibration.antenna.any():
            beside = calibration.antenna @ [1, 1j]
            for end, arm in enumerate((arm_i, arm_j)):
                arm += beside[self.robots[:, end]] * np.exp(1j * self.turned[:, end])
        return arm_i, arm_j

    @cached_property
    def carriers(self) -> Index:
        """(2, c) whose odometry has carried q_i and q_j of those that were."""
        return np.ascontiguousarray(self.robots[self.carried.rows].T)

    @cached_property
    def _points(self) -> tuple[Array, Array]:
        """(m,) q_i and q_j as x + iy."""
        return self.q_i @ [1, 1j], self.q_j @ [1, 1j]


@dataclass(frozen=True)
class Doubted:
    """Mountings that are unknowns of a problem: those of track and antenna, (robots,) each."""

    track: NDArray[np.bool_]
    antenna: NDArray[np.bool_]

    @staticmethod
    def none(robots: int) -> Doubted:
        return Doubted(np.zeros(robots, dtype=bool), np.zeros(robots, dtype=bool))

    def any(self) -> bool:
        return bool(self.track.any() or self.antenna.any())


@dataclass(frozen=True)
class Freed:
    """A stretch of odometry along which wheels may have stood or spun.

    Attributes:
        robot: whose, as the problem numbers them.
        links: (k,) rows of odometry, in the order of time.
        added: (k, 3, 3) what their covariances have for that beside the noise of odometry.
        stands: did its wheels stand, or spin?
        is_settled: is it known for sure where the robot went meanwhile?
        is_abrupt: did its wheels begin or end to do so at once, as no robot does?
    """

    robot: int
    links: Index
    added: Array
    stands: bool
    is_settled: bool = False
    is_abrupt: bool = False


@dataclass(frozen=True)
class Problem:
    """One connected group of robots.

    Attributes:
        robot_id, n: (k,) whose keyframe each pose is, and which; all else numbers robots from 0 on.
        initial: (k, 3) w_T_k.
        gauge: the pose that is held where `initial` has it.
        pairs: how many pairs of robots have ranges.
        range_sigma: of a range, as configured, m.
        doubted: whose mountings are unknowns; those of the others are as configured.
        model: of its ranges.
        freed: of what odometry says.
        told: the same with nothing freed, where something is.
        fitted: (robots,) keyframes until which all was as modelled not long ago; none where left
            out.
        blocked: (pairs,) between whom sight was blocked for long, nobody where left out: a signal
            that went around something is too long and never too short.
        width: (pairs,) of how many times their sigma ranges weigh, of their own where left out.
        half_track: (robots,) m, see `RobotModel.half_track_m`; nobody has sides where left out.
    """

    robot_id: Index
    n: Index
    initial: Array
    gauge: int
    pairs: int
    odometry: OdometryFactors
    closures: BetweenFactors
    ranges: RangeFactors
    priors: Priors
    doubted: Doubted
    range_sigma: float = 0.1
    model: RangeModel = LINKTRACK
    freed: tuple[Freed, ...] = ()
    told: Problem | None = None
    fitted: Array | None = None
    blocked: NDArray[np.bool_] | None = None
    width: Array | None = None
    half_track: Array | None = None

    @cached_property
    def widths(self) -> Array:
        """(pairs,) `width` of each."""
        return np.ones(self.pairs) if self.width is None else self.width

    @cached_property
    def weight(self) -> Array:
        """(n,) of ranges that are no outliers, 1/m^2."""
        return np.asarray((self.widths[self.ranges.pair] * self.ranges.sigma) ** -2.0)

    def cuts(self, threshold: Array, error: Array) -> Array:
        """(n,) sigmas beyond which each range loses weight.

        Args:
            threshold: (pairs,) of each pair; error: (n,) predicted minus measured.
        """
        cut = threshold[self.ranges.pair]
        if self.blocked is None:
            return cut
        return np.where((error < 0) & self.blocked[self.ranges.pair], TOO_LONG * cut, cut)

    @cached_property
    def ends(self) -> Index:
        """(2, all) both poses of odometry, closures and ranges, in this order."""
        factors = (self.odometry, self.closures, self.ranges)
        return np.concatenate([[f.i, f.j] for f in factors], axis=1)

    @cached_property
    def by_pair(self) -> SideBySide:
        """Its ranges."""
        return SideBySide.of(self.ranges.pair, self.pairs)
