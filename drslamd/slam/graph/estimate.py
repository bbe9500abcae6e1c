"""What module 3 says: where everybody was, in the frame of the team."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from drslamd.conventions import Chain, Segment
from drslamd.slam import se2
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.se2 import Array, Index


@dataclass(frozen=True)
class Trajectory:
    """Solved keyframes of one chain: n (k,) ascending, w_T_k (k, 3)."""

    chain: Chain
    n: Array
    poses: Array


@dataclass(frozen=True)
class Lifted:
    """State of the relaxation on one robot.

    Attributes:
        n: (k,) its keyframes; rows: (k, 2 r) their lifted poses.
        anchor: (2 r,) the lifted pose that anchors the frame of the team; origin: (3,) where in
            that frame it is.
        carriers: (m,) keyframes that carry closures and are therefore public.
        weights: (m, 2) how stiffly closures hold rotation and position of these, 1 and 1/m^2.
        ends: how many closures were counted.
        quiet: how many moves were made on the very same keyframes and closures.
        gain: share of its cost that the last move brought, or would have.
        claimed_of: of what the covariance beside it was reckoned.
    """

    n: Array
    rows: Array
    anchor: Array
    origin: Array
    carriers: Array
    weights: Array
    ends: int
    quiet: int
    gain: float
    claimed_of: bytes = b""


MUCH_WORSE = 3.0
"""Times the configured sigma of odometry: as modelled it is below 2."""


LEAST_SCALE = 0.01
"""Floors and loads change wheels by so much, whatever was learned."""


PATIENCE = 3
"""Solutions in a row that did not converge: the first ones of a large team may need as many."""


class Learned(NamedTuple):
    """A constant of a sensor, and its sigma, all that is known counted (infinite: nothing is)."""

    value: float = 0.0
    sigma: float = float("inf")


class Lapse(NamedTuple):
    """A stretch along which wheels of a robot stood, or spun, while it drove: of its keyframes from
    `first` to `last`. Is it known for sure where it went meanwhile?"""

    robot: int
    first: int
    last: int
    stood: bool
    is_settled: bool = False


class PoseNow(NamedTuple):
    """Where a robot is: utime on its clock, w_T_a (3,), covariance (3, 3) of x, y, theta."""

    utime: int
    pose: Array
    covariance: Array


@dataclass(frozen=True)
class TeamEstimate:
    """The last solution, in the frame of segment `frame`.

    Attributes:
        trajectories: by robot.
        joint: (3 k, 3 k) covariance of x, y, theta of the last poses of the first k in the order of
            `everybody`; of the others nothing is claimed.
        bias_m: range bias of each pair, m, as the team's likeness holds it; bias_sigma_m: how wrong
            that may be.
        scale, yaw: of each robot's odometry, fraction and rad/m.
        gyro_rate: in place of that of the robots whose heading a gyro gives, rad/s.
        near_bias_m: of the team, at range 0 (`RangeModel.near_range_shape`).
        team_bias_m: what the biases of all pairs have in common.
        turn: by which fraction turns are longer than odometry says; antenna_m: where the antenna is
            beside its place, x and y; both of robots that are not mounted as configured.
        scatter: how many times the configured sigma the ranges of a pair scatter.
        odometry_level: how many times the sigma of a robot's odometry is what is configured, of
            late, as far as it must be feared; 1 where none is named.
        late_level: likewise, of the last seconds only.
        lapses: of everybody.
        fitted: by robot, the last keyframe of the last solution that was as modelled.
        contradicted: pairs whose ranges of late do not fit the rest.
        blocked: pairs of whose ranges many are too long.
        left_out: pairs of which there was no room for ranges (`near_pairs`).
        boldness: by how much variances of pairs a < b that were claimed of late were too small
            (`revisions`), where they were.
        narrower: times `joint`, variances of poses (a,) in w and of pairs a < b in each other,
            where sensors were seen to be better than configured.
        is_explained: is the model, with what was learned, one of what was measured?
        converged: is it good enough to be used?
        settled: is it the same from wherever it was begun?
        lifted: state of the relaxation, with `rbcd`.
        nodes: by number, the places of modules that no robot carries.
        left: those of modules that stand elsewhere since, nobody knows where.
        points: of which only the place is known: every node, parked robots, and mirrored ones.
        mirrored: robots whose odometry is the mirror image of their way (`mirror_images`), and what
            is the variance of the heading of its end.
        is_as_modelled: was it explained with odometry as it is configured, and sight that was free?
        in_vain: how many solutions in a row did not converge, this one the last.
        kept: what the solver keeps of it for the next one.
    """

    frame: Segment
    trajectories: dict[int, Trajectory]
    joint: Array = field(default_factory=lambda: np.zeros((0, 0)))
    bias_m: dict[tuple[int, int], Learned] = field(default_factory=dict)
    bias_sigma_m: dict[tuple[int, int], float] = field(default_factory=dict)
    scale: dict[int, Learned] = field(default_factory=dict)
    yaw: dict[int, Learned] = field(default_factory=dict)
    gyro_rate: dict[int, Learned] = field(default_factory=dict)
    near_bias_m: Learned = field(default_factory=Learned)
    team_bias_m: Learned = field(default_factory=Learned)
    turn: dict[int, Learned] = field(default_factory=dict)
    antenna_m: dict[int, tuple[Learned, Learned]] = field(default_factory=dict)
    scatter: dict[tuple[int, int], float] = field(default_factory=dict)
    odometry_level: dict[int, float] = field(default_factory=dict)
    late_level: dict[int, float] = field(default_factory=dict)
    lapses: tuple[Lapse, ...] = ()
    fitted: dict[int, int] = field(default_factory=dict)
    contradicted: frozenset[tuple[int, int]] = frozenset()
    blocked: frozenset[tuple[int, int]] = frozenset()
    left_out: int = 0
    boldness: dict[tuple[int, int], float] = field(default_factory=dict)
    narrower: dict[tuple[int, ...], float] = field(default_factory=dict)
    is_explained: bool = True
    cost: float = 0.0
    iterations: int = 0
    converged: bool = True
    settled: bool = True
    lifted: Lifted | None = None
    nodes: dict[int, Trajectory] = field(default_factory=dict)
    left: dict[int, Trajectory] = field(default_factory=dict)
    points: frozenset[int] = frozenset()
    mirrored: dict[int, float] = field(default_factory=dict)
    is_as_modelled: bool = True
    in_vain: int = 0
    kept: object = field(default=None, repr=False, compare=False)

    @property
    def leads_nowhere(self) -> bool:
        """Should one begin anew as well, as a newcomer does?"""
        return self.in_vain > 0 and self.in_vain % PATIENCE == 0

    @property
    def is_final(self) -> bool:
        """Would another solution of the same be no other?"""
        return self.converged and self.settled

    @property
    def everybody(self) -> dict[int, Trajectory]:
        """Robots, and after them what stands without one."""
        return {**self.trajectories, **self.nodes}

    @property
    def paths(self) -> dict[int, Trajectory]:
        """All that was solved."""
        return {**self.everybody, **self.left}

    def covariance(self, robot: int) -> Array | None:
        """(3, 3) of the last pose of a robot; None where nothing is known of it."""
        at = self._rows(robot)
        return None if at is None else np.asarray(self.joint[at, at])

    def told(self, robot: int) -> Array | None:
        """The same as sure as it was seen to be, see `narrower`; asked by the robot itself, which
        knows how far later solutions moved its pose (`revisions`)."""
        known = self.covariance(robot)
        return None if known is None else self.narrower.get((robot,), 1.0) * known

    def joint_of(self, a: int, b: int) -> Array | None:
        """(6, 6) of the last poses of two robots."""
        rows = self._rows(a), self._rows(b)
        if rows[0] is None or rows[1] is None:
            return None
        at = np.r_[rows[0], rows[1]]
        return np.asarray(self.joint[np.ix_(at, at)])

    def relative(self, a: int, b: int) -> tuple[Array, Array] | None:
        """a_T_b (3,) of the last poses of two robots, and its covariance (3, 3) in frame a."""
        _, poses, covariances = self.relatives([(a, b)])
        return (poses[0], covariances[0]) if len(poses) else None

    def relatives(self, pairs: list[tuple[int, int]]) -> tuple[list[tuple[int, int]], Array, Array]:
        """The same of many: those of the pairs of which something is claimed, a_T_b (k, 3) and
        covariances (k, 3, 3)."""
        everybody = self.everybody
        claimed = list(everybody)[: len(self.joint) // 3]
        place = {robot: 3 * k for k, robot in enumerate(claimed)}
        told = [(a, b) for a, b in pairs if a in place and b in place]
        if not told:
            return told, np.zeros((0, 3)), np.zeros((0, 3, 3))
        last = {robot: everybody[robot].poses[-1] for pair in told for robot in pair}
        w_T_a, w_T_b = (np.array([last[pair[end]] for pair in told]) for end in (0, 1))
        a_T_b = se2.between(w_T_a, w_T_b)
        a_T_b[:, 2] = se2.wrap(a_T_b[:, 2])
        first = np.array([[place[a], place[b]] for a, b in told])
        at = (first[:, :, None] + np.arange(3)).reshape(-1, 6)
        joint = self.joint[at[:, :, None], at[:, None, :]]
        cos, sin = np.cos(w_T_a[:, 2]), np.sin(w_T_a[:, 2])
        j = np.zeros((len(told), 3, 6))
        j[:, 0, 3] = j[:, 1, 4] = cos
        j[:, 0, 4], j[:, 1, 3] = sin, -sin
        j[:, :2, :2] = -j[:, :2, 3:5]
        j[:, 0, 2], j[:, 1, 2] = a_T_b[:, 1], -a_T_b[:, 0]
        j[:, 2, 2], j[:, 2, 5] = -1, 1
        bold = np.array([self.bold(a, b) for a, b in told])
        return told, a_T_b, bold[:, None, None] * (j @ joint @ np.swapaxes(j, 1, 2))

    def bold(self, a: int, b: int) -> float:
        """Times the covariance of a pair, see `boldness`."""
        return self.boldness.get((min(a, b), max(a, b)), 1.0)

    def narrow(self, a: int, b: int) -> float:
        """Likewise where a pair is told as sure as it was seen to be, see `narrower`."""
        pair = (min(a, b), max(a, b))
        return max(self.boldness.get(pair, 0.0), self.narrower.get(pair, 1.0))

    def out_of_sight(self, robot: int) -> frozenset[int]:
        """To whom sight of a robot was blocked."""
        return frozenset(b if a == robot else a for a, b in self.blocked if robot in (a, b))

    def is_slipping(self, robot: int) -> bool:
        """Was odometry of a robot much worse than configured in the last seconds?"""
        return self.late_level.get(robot, 1.0) >= MUCH_WORSE

    def has_worse_odometry(self, robot: int) -> bool:
        """Must so much be feared of it now?"""
        return self.odometry_level.get(robot, 1.0) >= MUCH_WORSE

    def correction(self, robot: int) -> Correction:
        """Of a robot's odometry."""
        parts = (self.scale, self.yaw, self.turn)
        return Correction(*(part.get(robot, Learned()).value for part in parts))

    def noise_left(self, robot: int, noise: OdometryNoise) -> OdometryNoise:
        """What is left of the noise of a robot's odometry where its scale was learned."""
        sigma = self.scale.get(robot, Learned()).sigma
        return replace(noise, scale=min(noise.scale, math.hypot(sigma, LEAST_SCALE)))

    def rows_of(self, number: int) -> Index:
        """(3,) where x, y, theta of the last pose of anybody are in `joint`.

        Raises:
            KeyError: nothing is claimed of it.
        """
        rows = self._rows(number)
        if rows is None:
            raise KeyError(number)
        return np.arange(rows.start, rows.stop)

    def _rows(self, robot: int) -> slice | None:
        robots = [*self.trajectories, *self.nodes]
        at = 3 * robots.index(robot) if robot in robots else len(self.joint)
        return slice(at, at + 3) if at < len(self.joint) else None
