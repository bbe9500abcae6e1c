"""Module 3, default: the team's graph solved exactly, because ordered by time it is a band.

Closures and ranges join poses of the same time and odometry joins neighbouring times. With all
poses of all robots in the order of time the Gauss-Newton Hessian is banded (half-bandwidth about
3 R for R robots), so one banded Cholesky factorisation solves it exactly in linear time. The few
calibration unknowns (bias of each pair, scale and yaw rate of each robot) touch everything; they
form a border that is eliminated by its Schur complement. The factorisation also yields the
marginal covariances of the poses that are asked for.

The cost of a step grows with the cube of the number of robots; up to about a dozen robots in one
connected group it stays below the cost of linearising.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from drslamd.slam import se2
from drslamd.slam.problem import (
    Calibration,
    Index,
    PoseEdges,
    Problem,
    Solution,
    corrected,
    pose_errors,
    range_errors,
)
from drslamd.slam.se2 import Array

GAUGE_SIGMA = 1e-5
"""The gauge pose is held to 10 um and 10 urad: far below all noise, far above rounding."""
ROBUST_SIGMAS = 2.5
"""Scale of Cauchy's cost on ranges: a burst of 0.5 m weighs 1/50 of a good range."""


@dataclass
class _System:
    """Normal equations: band (w + 1, n), border (n, b), corner (b, b) and right-hand sides."""

    band: Array
    border: Array
    corner: Array
    pose_gradient: Array
    border_gradient: Array
    cost: float


class _Scatter:
    """Where the blocks of one set of edges go in the normal equations; the same in every step."""

    def __init__(self, i: Index, j: Index, columns: Index, size: int, border: int) -> None:
        """
        Args:
            i, j: (m,) the two poses of each edge.
            columns: (m, c) the border unknowns that it depends on.
            size, border: numbers of unknowns.
        """
        self._size, self._border = size, border
        self.rows = np.concatenate(
            [3 * i[:, None] + np.arange(3), 3 * j[:, None] + np.arange(3)], 1
        )
        row, column = self.rows[:, :, None], self.rows[:, None, :]
        self.lower = np.broadcast_to(row >= column, (len(i), 6, 6))
        self.band = ((row - column) * size + column)[self.lower]
        self.cross = (self.rows[:, :, None] * border + columns[:, None, :]).ravel()
        self.corner = (columns[:, :, None] * border + columns[:, None, :]).ravel()
        self.columns = columns.ravel()

    def add(
        self, system: _System, error: Array, jacobian: Array, information: Array, by_border: Array
    ) -> None:
        """Add J' W J and J' W e.

        Args:
            error: (m, d); jacobian: (m, d, 6); information: (m, d, d).
            by_border: (m, d, c) derivatives by the border unknowns.
        """
        weighted = information @ jacobian
        blocks = np.swapaxes(jacobian, 1, 2) @ weighted
        system.band += _sums(self.band, blocks[self.lower], system.band)
        weighted_t = np.swapaxes(weighted, 1, 2)
        gradient = weighted_t @ error[..., None]
        system.pose_gradient += _sums(self.rows.ravel(), gradient.ravel(), system.pose_gradient)
        held = information @ error[..., None]
        system.cost += float(np.vdot(error, held))
        if not by_border.shape[2]:
            return
        system.border += _sums(self.cross, (weighted_t @ by_border).ravel(), system.border)
        border_t = np.swapaxes(by_border, 1, 2)
        corner = border_t @ information @ by_border
        system.corner += _sums(self.corner, corner.ravel(), system.corner)
        gradient = (border_t @ held).ravel()
        system.border_gradient += _sums(self.columns, gradient, system.border_gradient)


def _sums(at: Array, values: Array, like: Array) -> Array:
    return np.bincount(at, values, like.size).reshape(like.shape)


def solve(
    problem: Problem,
    start: Calibration | None = None,
    marginals: tuple[int, ...] = (),
    most: int = 30,
    tolerance: float = 5e-4,
) -> Solution:
    """Levenberg-Marquardt to convergence.

    Args:
        problem: one connected group; every pose must be held by edges.
        start: calibration to start from (zero when left out).
        marginals: poses whose covariance is wanted.
        most: bound on iterations.
        tolerance: largest step, m and rad, after which the solution counts as reached; the
            default is far below every noise, and the next solve goes on from there.
    """
    equations = _Equations(problem)
    poses = problem.initial.copy()
    calibration = start or Calibration.zero(problem.priors)
    system = equations.at(poses, calibration)
    damping, steps, converged = 1e-6, 0, False
    while steps < most and not converged and damping < 1e6:
        steps += 1
        pose_step, border_step = _step(system, damping)
        trial = poses + pose_step.reshape(-1, 3)
        trial_calibration = _moved(calibration, border_step)
        new = equations.at(trial, trial_calibration)
        if new.cost > system.cost * (1 + 1e-12):
            damping *= 10
            continue
        converged = bool(
            np.abs(pose_step).max() < tolerance or system.cost - new.cost < 1e-9 * (1 + new.cost)
        )
        poses, calibration, system, damping = trial, trial_calibration, new, damping / 10
    poses[:, 2] = se2.wrap(poses[:, 2])
    covariances = _marginals(system, marginals) if marginals else {}
    return Solution(poses, calibration, system.cost, steps, converged, covariances)


def _moved(calibration: Calibration, step: Array) -> Calibration:
    pairs, robots = len(calibration.bias), len(calibration.scale)
    bias, scale, yaw = np.split(step, [pairs, pairs + robots])
    return Calibration(calibration.bias + bias, calibration.scale + scale, calibration.yaw + yaw)


# ---- linearisation -----------------------------------------------------------------------------


class _Equations:
    """The normal equations of one problem, at any point."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        links, closures, ranges = problem.links, problem.closures, problem.ranges
        edges = (links, closures, ranges)
        reach = max((int(np.abs(e.i - e.j).max()) for e in edges if len(e)), default=0)
        self._pairs, self._robots = len(problem.priors.bias), len(problem.priors.scale)
        self._width = 3 * reach + 3
        size, border = 3 * len(problem.initial), self._pairs + 2 * self._robots
        self._size, self._border = size, border
        scale = self._pairs + links.robot
        calibrated = np.stack([scale, scale + self._robots], axis=-1)
        none = np.zeros((len(closures), 0), dtype=np.int64)
        self._links = _Scatter(links.i, links.j, calibrated, size, border)
        self._closures = _Scatter(closures.i, closures.j, none, size, border)
        self._ranges = _Scatter(ranges.i, ranges.j, ranges.pair[:, None], size, border)

    def at(self, poses: Array, calibration: Calibration) -> _System:
        """Sum of J' W J and J' W e over all edges and priors."""
        size, border = self._size, self._border
        system = _System(
            np.zeros((self._width, size)), np.zeros((size, border)), np.zeros((border, border)),
            np.zeros(size), np.zeros(border), 0.0,
        )  # fmt: skip
        self._add_links(system, poses, calibration)
        self._add_closures(system, poses)
        self._add_ranges(system, poses, calibration.bias)
        self._add_priors(system, calibration)
        self._hold_gauge(system, poses)
        return system

    def _add_links(self, system: _System, poses: Array, calibration: Calibration) -> None:
        links = self._problem.links
        error = pose_errors(poses, links, corrected(links, calibration))
        x, y = links.measured[:, 0], links.measured[:, 1]
        by_calibration = np.zeros((len(links), 3, 2))
        by_calibration[:, 0, 0], by_calibration[:, 1, 0] = x, y
        by_calibration[:, 0, 1] = -links.path / 2 * y
        by_calibration[:, 1, 1] = links.path / 2 * x
        by_calibration[:, 2, 1] = links.path
        jacobian = _pose_jacobians(poses, links)
        self._links.add(system, error, jacobian, links.information, by_calibration)

    def _add_closures(self, system: _System, poses: Array) -> None:
        closures = self._problem.closures
        if not len(closures):
            return
        error = pose_errors(poses, closures, closures.measured)
        none = np.zeros((len(closures), 3, 0))
        jacobian = _pose_jacobians(poses, closures)
        self._closures.add(system, error, jacobian, closures.information, none)

    def _add_ranges(self, system: _System, poses: Array, bias: Array) -> None:
        ranges = self._problem.ranges
        if not len(ranges):
            return
        error, sight, arm_i, arm_j = range_errors(poses, ranges, bias)
        jacobian = np.empty((len(ranges), 1, 6))
        jacobian[:, 0, 0:2] = -sight
        jacobian[:, 0, 2] = -(sight[:, 1] * arm_i[:, 0] - sight[:, 0] * arm_i[:, 1])
        jacobian[:, 0, 3:5] = sight
        jacobian[:, 0, 5] = sight[:, 1] * arm_j[:, 0] - sight[:, 0] * arm_j[:, 1]
        # Cauchy's cost c^2 log(1 + (e / c)^2) by its weight; e and c in sigmas
        scaled = (error / (ROBUST_SIGMAS * ranges.sigma)) ** 2
        weight = 1 / (1 + scaled)
        information = (weight / ranges.sigma**2)[:, None, None]
        ones = np.ones((len(ranges), 1, 1))
        self._ranges.add(system, error[:, None], jacobian, information, ones)
        robust = float(np.sum(ROBUST_SIGMAS**2 * np.log1p(scaled)))
        system.cost += robust - float(np.sum(weight * (error / ranges.sigma) ** 2))

    def _add_priors(self, system: _System, calibration: Calibration) -> None:
        priors = self._problem.priors
        unknowns = np.concatenate([calibration.bias, calibration.scale, calibration.yaw])
        stiffness = 1 / np.concatenate([priors.bias, priors.scale, priors.yaw]) ** 2
        system.corner[np.diag_indices(self._border)] += stiffness
        system.border_gradient += stiffness * unknowns
        system.cost += float(unknowns @ (stiffness * unknowns))

    def _hold_gauge(self, system: _System, poses: Array) -> None:
        gauge = self._problem.gauge
        hold = 3 * gauge + np.arange(3)
        moved = poses[gauge] - self._problem.initial[gauge]
        system.band[0, hold] += GAUGE_SIGMA**-2
        system.pose_gradient[hold] += moved / GAUGE_SIGMA**2
        system.cost += float(moved @ moved) / GAUGE_SIGMA**2


def _pose_jacobians(poses: Array, edges: PoseEdges) -> Array:
    """(m, 3, 6): derivative of `pose_errors` by both poses of each edge."""
    theta = poses[edges.i, 2]
    cos, sin = np.cos(theta), np.sin(theta)
    d = poses[edges.j, :2] - poses[edges.i, :2]
    j = np.zeros((len(edges), 3, 6))
    j[:, 0, 0] = j[:, 1, 1] = -cos
    j[:, 0, 1], j[:, 1, 0] = -sin, sin
    j[:, 0, 2] = -sin * d[:, 0] + cos * d[:, 1]
    j[:, 1, 2] = -cos * d[:, 0] - sin * d[:, 1]
    j[:, :2, 3:5] = -j[:, :2, :2]
    j[:, 2, 2], j[:, 2, 5] = -1, 1
    return j


# ---- solution ----------------------------------------------------------------------------------


def _step(system: _System, damping: float) -> tuple[Array, Array]:
    """Steps of the poses (n,) and of the border (b,)."""
    band = system.band.copy()
    band[0] *= 1 + damping
    factor = cholesky_banded(band, lower=True, check_finite=False)
    right = np.column_stack([system.pose_gradient, system.border])
    solved = cho_solve_banded((factor, True), right, check_finite=False)
    if not system.border.shape[1]:
        return -solved[:, 0], np.zeros(0)
    schur = system.corner - system.border.T @ solved[:, 1:]
    gradient = system.border_gradient - system.border.T @ solved[:, 0]
    border_step = -np.linalg.solve(schur, gradient)
    return -solved[:, 0] - solved[:, 1:] @ border_step, border_step


def _marginals(system: _System, wanted: tuple[int, ...]) -> dict[int, Array]:
    """Blocks of the inverse of the whole system, border included."""
    factor = cholesky_banded(system.band, lower=True, check_finite=False)
    size, border = system.border.shape
    columns = np.concatenate([3 * k + np.arange(3) for k in wanted])
    unit = np.zeros((size, len(columns)))
    unit[columns, np.arange(len(columns))] = 1
    solved = cho_solve_banded(
        (factor, True), np.column_stack([unit, system.border]), check_finite=False
    )
    inverse = solved[columns, : len(columns)]
    if border:
        through = solved[columns, len(columns) :]
        schur = system.corner - system.border.T @ solved[:, len(columns) :]
        inverse = inverse + through @ np.linalg.solve(schur, through.T)
    return {k: inverse[3 * m : 3 * m + 3, 3 * m : 3 * m + 3] for m, k in enumerate(wanted)}
