"""Pose graphs of relative poses, solved exactly: the cost of `rbcd` without its relaxation.

    min  sum kappa |z_j - z_i z_ij|^2 + tau |p_j - p_i - z_i t_ij|^2,   z_k = exp(i theta_k)

It starts from the chordal relaxation (Carlone et al., ICRA 2015): rotations by one linear solve as
if they were any complex numbers, then positions by another. Then Newton's method, whose Hessian
costs no more here than that of Gauss and Newton. Poses in the order of time make the systems a band
(`symmetric`); loops in space are sparse.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drslamd.slam import headway, se2
from drslamd.slam.optimizer.closures.symmetric import Factor, Symmetric, elimination_order
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.se2 import Array

NEWTON_BELOW = 0.3
"""Relative gain of a step below which the next one is Newton's; far from the minimum his Hessian
may be indefinite, that of Gauss and Newton never is."""
KEEP_BELOW = 1e-3
"""Relative gain of a step below which the next one takes the same factor, while each then expects
so much less than the one before."""
HOLD = 1e8
"""How much stiffer than an edge the gauge is where its pose shall count as known."""
LINEAR_TOLERANCE = 1e-9
"""Expected relative gain that is enough where a step is not Newton's."""
LEAST_DAMPING = 1e-6
"""Relative to the diagonal."""
MOST_DAMPING = 1e6
"""Beyond it no step helps."""


@dataclass(frozen=True)
class PoseGraphSolution:
    """Poses (n, 3), angles wrapped, and how they were reached."""

    poses: Array
    cost: float
    steps: int
    converged: bool


@dataclass(frozen=True)
class _Point:
    """Cost and what its derivatives need at some poses.

    Attributes:
        theta: (n,); place: (n,) complex.
        arm: (m,) z_i t_ij; error: (m,) of positions; turn: (m,) of angles.
    """

    theta: Array
    place: Array
    arm: Array
    error: Array
    turn: Array
    cost: float


class PoseGraphSolver:
    """Edges between `count` poses that are all connected."""

    def __init__(self, edges: ComplexFactors, count: int, gauge: int = 0) -> None:
        """
        Args:
            gauge: the pose that is held, which only `joint_covariance` shows.
        """
        self._order = elimination_order(edges.i, edges.j, count)
        self._place = np.argsort(self._order)
        i, j = self._place[edges.i], self._place[edges.j]
        self._edges, self._count = replace(edges, i=i, j=j), count
        x_i, x_j = 3 * i, 3 * j
        y_i, t_i, y_j, t_j = x_i + 1, x_i + 2, x_j + 1, x_j + 2
        held = 3 * self._place[gauge] + np.arange(3)
        row = [x_i, y_i, x_j, y_j, x_j, y_j, t_i, t_i, x_j, y_j, t_i, t_j, t_j, held]
        column = [x_i, y_i, x_j, y_j, x_i, y_i, x_i, y_i, t_i, t_i, t_i, t_j, t_i, held]
        self._system = Symmetric(3 * count, np.concatenate(row), np.concatenate(column))
        self._angle = np.angle(edges.turn)
        self._gauge = np.array([edges.tau.mean(), edges.tau.mean(), edges.kappa.mean()])

    def solve(
        self, start: Array | None = None, most: int = 50, tolerance: float = 1e-6
    ) -> PoseGraphSolution:
        """Minimise from `start` (n, 3), or from the chordal relaxation.

        Args:
            tolerance: expected relative gain of a step of Newton's after which no other one is
                taken; as his method squares its error, what is missing then is far smaller.
        """
        point = self._point(self.chordal_start() if start is None else start)
        newton, damping, steps, converged = start is not None, 0.0, 0, False
        factor: Factor | None = None
        before = np.inf
        while steps < most and not converged and damping < MOST_DAMPING:
            steps += 1
            headway.mark()
            kept = factor is not None
            factor = factor or self._factor(point, newton, damping)
            trial, expected = self._stepped(point, factor) if factor else (point, 0.0)
            rises = not trial.cost <= point.cost * (1 + 1e-9) + 1e-12
            if factor is None or rises or expected < -1e-12:
                # an old factor, then Newton's Hessian (which a sparse factor does not tell to be
                # indefinite), then too little damping is to blame
                if not kept:
                    damping = damping if newton else max(10 * damping, LEAST_DAMPING)
                    newton = False
                factor = None
                continue
            enough = tolerance if newton and not kept else LINEAR_TOLERANCE
            converged = expected <= enough * trial.cost + 1e-12
            gain = (point.cost - trial.cost) / (point.cost + 1e-12)
            slow = kept and expected > KEEP_BELOW * before
            if expected > KEEP_BELOW * trial.cost or not newton or slow:
                factor = None
            newton, before = gain <= NEWTON_BELOW, expected
            point, damping = trial, damping / 10 if damping > LEAST_DAMPING else 0.0
        poses = np.stack([point.place.real, point.place.imag, se2.wrap(point.theta)], axis=-1)
        return PoseGraphSolution(poses[self._place], point.cost, steps, converged)

    def _stepped(self, point: _Point, factor: Factor) -> tuple[_Point, float]:
        """The point after a full step, and by how much the cost was expected to fall."""
        gradient = self._gradient(point)
        step = -factor.solve(gradient)
        moved = step.reshape(-1, 3)
        place = point.place + moved[:, 0] + 1j * moved[:, 1]
        return self._at(point.theta + moved[:, 2], place), -float(gradient @ step)

    def chordal_start(self) -> Array:
        """(n, 3): rotations that minimise the first sum as free complex numbers, the first held,
        then positions that minimise the second one."""
        edges, count = self._edges, self._count
        i, j, first = edges.i, edges.j, np.zeros(1, dtype=np.int64)
        poses = Symmetric(count, np.concatenate([i, j, j, first]), np.concatenate([i, j, i, first]))
        stiff = self._gauge[2:]
        joint = -edges.kappa * edges.turn
        factor = poses.factor(np.concatenate([edges.kappa, edges.kappa, joint, stiff]))
        if factor is None:
            raise AssertionError("rotations of a connected graph are determined")
        right = np.zeros(count, dtype=complex)
        right[0] = stiff[0]
        theta = np.angle(factor.solve(right))
        factor = poses.factor(np.concatenate([edges.tau, edges.tau, -edges.tau, self._gauge[:1]]))
        if factor is None:
            raise AssertionError("positions of a connected graph are determined")
        pull = edges.tau * np.exp(1j * theta[i]) * edges.shift
        x, y = (
            factor.solve(_accumulated(j, part, count) - _accumulated(i, part, count))
            for part in (pull.real, pull.imag)
        )
        return np.column_stack([x, y, theta])[self._place]

    def gains(self, poses: Array, wanted: list[int]) -> Array:
        """(m, 3, 3 k) G = W J H^-1: how x, y, theta of k poses follow what each edge measures,
        while the gauge is held.

        Args:
            poses: (n, 3), of least cost.
        """
        point, edges = self._point(poses), self._edges
        factor = self._factor(point, newton=False, damping=0.0, hold=HOLD)
        if factor is None:
            raise AssertionError("the poses of a connected graph are determined")
        unit = np.zeros((3 * self._count, 3 * len(wanted)))
        at = 3 * self._place[wanted][:, None] + np.arange(3)
        unit[at.ravel(), np.arange(at.size)] = 1
        moved = factor.solve(unit).reshape(self._count, 3, -1)
        place, theta = moved[:, 0] + 1j * moved[:, 1], moved[:, 2]
        # (the error of an edge is told in the frame of its first pose)
        lever = 1j * (point.place[edges.j] - point.place[edges.i])
        turned = place[edges.j] - place[edges.i] - lever[:, None] * theta[edges.i]
        turned *= (edges.tau * np.exp(-1j * point.theta[edges.i]))[:, None]
        turn = edges.kappa[:, None] * (theta[edges.j] - theta[edges.i])
        return np.stack([turned.real, turned.imag, turn], axis=1)

    def cost(self, poses: Array) -> float:
        """Of poses (n, 3)."""
        return self._point(poses).cost

    def _point(self, poses: Array) -> _Point:
        """At poses (n, 3), as others number them."""
        x, y, theta = poses[self._order].T
        return self._at(theta, x + 1j * y)

    def _at(self, theta: Array, place: Array) -> _Point:
        edges = self._edges
        arm = np.exp(1j * theta)[edges.i] * edges.shift
        error = place[edges.j] - place[edges.i] - arm
        turn = theta[edges.j] - theta[edges.i] - self._angle
        squared = error.real**2 + error.imag**2
        # |exp(i a) - exp(i b)|^2 = 4 sin^2((a - b) / 2); 2 - 2 cos would lose half of the digits
        cost = edges.tau @ squared + 4 * (edges.kappa @ np.sin(turn / 2) ** 2)
        return _Point(theta, place, arm, error, turn, float(cost))

    def _gradient(self, point: _Point) -> Array:
        """(3 n,) half the gradient."""
        edges, count = self._edges, self._count
        pull = edges.tau * point.error
        twist = edges.kappa * np.sin(point.turn)
        lever = pull.real * point.arm.imag - pull.imag * point.arm.real
        out = np.empty((count, 3))
        out[:, 0] = _accumulated(edges.j, pull.real, count) - _accumulated(
            edges.i, pull.real, count
        )
        out[:, 1] = _accumulated(edges.j, pull.imag, count) - _accumulated(
            edges.i, pull.imag, count
        )
        out[:, 2] = _accumulated(edges.j, twist, count) + _accumulated(
            edges.i, lever - twist, count
        )
        return out.ravel()

    def _factor(
        self, point: _Point, newton: bool, damping: float, hold: float = 1.0
    ) -> Factor | None:
        """Half the Hessian, factorised; that of Gauss and Newton takes errors in frame i."""
        tau, kappa = self._edges.tau, self._edges.kappa
        if newton:
            arm, stiff = point.arm, kappa * np.cos(point.turn)
            deform_track = arm.real * point.error.real + arm.imag * point.error.imag
        else:
            arm, stiff = point.arm + point.error, kappa * np.cos(point.turn / 2) ** 2
            deform_track = 0.0
        across, along = tau * arm.imag, tau * arm.real
        own = tau * (arm.real**2 + arm.imag**2 + deform_track) + stiff
        values = [
            tau,
            tau,
            tau,
            tau,
            -tau,
            -tau,
            -across,
            along,
            across,
            -along,
            own,
            stiff,
            -stiff,
            hold * self._gauge,
        ]
        return self._system.factor(np.concatenate(values), damping)


def _accumulated(at: Array, values: Array, count: int) -> Array:
    return np.bincount(at, values, count)
