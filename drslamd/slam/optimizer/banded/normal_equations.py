"""Normal equations of the team's problem: a band in the order of time, and a border beside it.

Closures and ranges join poses of the same time and odometry joins neighbouring times, so with all
poses of all robots in the order of time J' W J is banded. The border takes the unknowns that touch
everything: the bias of each pair, that of strong signals, scale and yaw rate of each robot, and the
few poses that reach far (a robot that stands still while others drive about has one pose for all
that time).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.optimizer.problem import (
    Calibration,
    Index,
    PoseEdges,
    Problem,
    corrected,
    near_range_shape,
    pose_errors,
    range_errors,
)
from drslamd.slam.se2 import Array

GAUGE_SIGMA = 1e-5
"""The gauge pose is held to 10 um and 10 urad: far below all noise, far above rounding."""
ROBUST_SIGMAS = 2.5
"""Scale of Cauchy's cost on ranges: a burst of 0.5 m weighs 1/50 of a good range."""


@dataclass(frozen=True)
class Layout:
    """Where each unknown stands: the band first, then the border.

    Attributes:
        poses: (k, 3) numbers of the unknowns of each pose.
        bias, scale, yaw: numbers of the unknowns of each pair and robot; near_bias: of the team.
        band, border: how many unknowns are in each.
        width: diagonals of the band, the main one included.
    """

    poses: Index
    bias: Index
    scale: Index
    yaw: Index
    near_bias: Index
    band: int
    border: int
    width: int

    @staticmethod
    def of(problem: Problem) -> Layout:
        count, priors = len(problem.initial), problem.priors
        edges = (problem.links, problem.closures, problem.ranges)
        i = np.concatenate([e.i for e in edges])
        j = np.concatenate([e.j for e in edges])
        apart = border_poses(i, j, narrow=8 + 4 * len(priors.scale))
        inside = np.ones(count, dtype=bool)
        inside[apart] = False
        place = np.where(inside, np.cumsum(inside) - 1, 0)
        place[apart] = count - len(apart) + np.arange(len(apart))
        both = inside[i] & inside[j]
        reach = int(np.abs(place[i] - place[j])[both].max(initial=0))
        sizes = [len(p) for p in (priors.bias, priors.scale, priors.yaw, priors.near_bias)]
        numbers = 3 * count + np.arange(sum(sizes))
        bias, scale, yaw, near_bias = np.split(numbers, np.cumsum(sizes)[:-1])
        return Layout(
            3 * place[:, None] + np.arange(3), bias, scale, yaw, near_bias,
            3 * (count - len(apart)), 3 * len(apart) + sum(sizes), 3 * reach + 3,
        )  # fmt: skip

    def calibration(self, unknowns: Array) -> Calibration:
        """The part of a vector over all unknowns that belongs to the sensors."""
        return Calibration(
            *(unknowns[k] for k in (self.bias, self.scale, self.yaw, self.near_bias))
        )


def border_poses(i: Index, j: Index, narrow: int) -> Index:
    """The poses that are taken out of the band.

    Every pose that is taken out costs three columns of the border, every pose that the longest
    edge spans costs three diagonals of the band; the smallest number is chosen that is enough
    for both.

    Args:
        i, j: (m,) the two poses of each edge.
        narrow: a reach that needs no attention.
    """
    reach = np.abs(i - j)
    while True:
        far = reach > narrow
        apart = vertex_cover(i[far], j[far], narrow + 1)
        if len(apart) <= narrow:
            return apart
        narrow *= 2


def vertex_cover(i: Index, j: Index, most: int) -> Index:
    """Up to `most` poses that take part in all edges, or in as many as can be."""
    chosen: list[int] = []
    while len(i) and len(chosen) < most:
        pose = int(np.argmax(np.bincount(np.concatenate([i, j]))))
        chosen.append(pose)
        left = (i != pose) & (j != pose)
        i, j = i[left], j[left]
    return np.array(sorted(chosen), dtype=np.int64)


@dataclass
class System:
    """Lower band (w, n), border (n, b), corner (b, b), gradient (n + b,) and cost at some point."""

    band: Array
    border: Array
    corner: Array
    gradient: Array
    cost: float

    @staticmethod
    def empty(layout: Layout) -> System:
        n, b = layout.band, layout.border
        return System(
            np.zeros((layout.width, n)), np.zeros((n, b)), np.zeros((b, b)), np.zeros(n + b), 0.0
        )

    def add_gaussian_prior(self, unknowns: Index, error: Array, stiffness: Array | float) -> None:
        """Add independent priors."""
        stiffness = np.broadcast_to(stiffness, error.shape)
        inside = unknowns < len(self.border)
        self.band[0, unknowns[inside]] += stiffness[inside]
        outside = unknowns[~inside] - len(self.border)
        self.corner[outside, outside] += stiffness[~inside]
        self.gradient[unknowns] += stiffness * error
        self.cost += float(np.sum(stiffness * error**2))

    def add_cauchy_prior(self, unknowns: Index, error: Array, sigma: Array) -> None:
        """Add independent priors with the tails of Cauchy's: log(1 + (e / sigma)^2) by its weight.

        Where little is measured the unknown stays near zero; where much is, the prior gives way.
        """
        scaled = (error / sigma) ** 2
        self.add_gaussian_prior(unknowns, error, 1 / (sigma**2 * (1 + scaled)))
        self.cost += float(np.sum(np.log1p(scaled) - scaled / (1 + scaled)))


class _Assembly:
    """Where the blocks of one set of edges go in the system; the same in every iteration."""

    def __init__(self, layout: Layout, unknowns: Index) -> None:
        """
        Args:
            unknowns: (m, c) on which each edge depends.
        """
        n, b = layout.band, layout.border
        row, column = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
        self._unknowns = unknowns.ravel()
        self._in_band = (row >= column) & (row < n)
        self._in_border = (row < n) & (column >= n)
        self._in_corner = (row >= n) & (column >= n)
        self._band = ((row - column) * n + column)[self._in_band]
        self._border = (row * b + column - n)[self._in_border]
        self._corner = ((row - n) * b + column - n)[self._in_corner]

    def add(self, system: System, error: Array, jacobian: Array, information: Array) -> None:
        """Add J' W J, J' W e and e' W e.

        Args:
            error: (m, d); jacobian: (m, d, c); information: (m, d, d).
        """
        weighted = np.swapaxes(information @ jacobian, 1, 2)
        blocks = weighted @ jacobian
        system.band += _sums(self._band, blocks[self._in_band], system.band)
        system.border += _sums(self._border, blocks[self._in_border], system.border)
        system.corner += _sums(self._corner, blocks[self._in_corner], system.corner)
        gradient = (weighted @ error[..., None]).ravel()
        system.gradient += _sums(self._unknowns, gradient, system.gradient)
        system.cost += float(np.vdot(error, information @ error[..., None]))


def _sums(at: Index, values: Array, like: Array) -> Array:
    return np.bincount(at, values, like.size).reshape(like.shape)


class Equations:
    """The normal equations of one problem, at any point."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self.layout = layout = Layout.of(problem)
        links, closures, ranges, poses = (
            problem.links, problem.closures, problem.ranges, layout.poses,
        )  # fmt: skip
        sensors = np.stack([layout.scale[links.robot], layout.yaw[links.robot]], axis=-1)
        self._links = _Assembly(layout, np.hstack([poses[links.i], poses[links.j], sensors]))
        self._closures = _Assembly(layout, np.hstack([poses[closures.i], poses[closures.j]]))
        shared = np.tile(layout.near_bias, (len(ranges), 1))
        self._ranges = _Assembly(
            layout,
            np.column_stack([poses[ranges.i], poses[ranges.j], layout.bias[ranges.pair], shared]),
        )

    def at(self, poses: Array, calibration: Calibration) -> System:
        """Sum of J' W J and J' W e over all edges and priors."""
        system = System.empty(self.layout)
        self._add_links(system, poses, calibration)
        self._add_closures(system, poses)
        self._add_ranges(system, poses, calibration)
        layout, priors = self.layout, self._problem.priors
        system.add_cauchy_prior(layout.bias, calibration.bias, priors.bias)
        system.add_cauchy_prior(layout.scale, calibration.scale, priors.scale)
        system.add_gaussian_prior(layout.yaw, calibration.yaw, priors.yaw**-2.0)
        system.add_gaussian_prior(layout.near_bias, calibration.near_bias, priors.near_bias**-2.0)
        gauge = self._problem.gauge
        moved = poses[gauge] - self._problem.initial[gauge]
        system.add_gaussian_prior(layout.poses[gauge], moved, GAUGE_SIGMA**-2)
        return system

    def _add_links(self, system: System, poses: Array, calibration: Calibration) -> None:
        links = self._problem.links
        error = pose_errors(poses, links, corrected(links, calibration))
        x, y = links.measured[:, 0], links.measured[:, 1]
        jacobian = np.zeros((len(links), 3, 8))
        jacobian[:, :, :6] = _pose_jacobians(poses, links)
        jacobian[:, 0, 6], jacobian[:, 1, 6] = x, y
        jacobian[:, 0, 7] = -links.path / 2 * y
        jacobian[:, 1, 7] = links.path / 2 * x
        jacobian[:, 2, 7] = links.path
        self._links.add(system, error, jacobian, links.information)

    def _add_closures(self, system: System, poses: Array) -> None:
        closures = self._problem.closures
        error = pose_errors(poses, closures, closures.measured)
        self._closures.add(system, error, _pose_jacobians(poses, closures), closures.information)

    def _add_ranges(self, system: System, poses: Array, calibration: Calibration) -> None:
        ranges = self._problem.ranges
        error, sight, arm_i, arm_j = range_errors(poses, ranges, calibration)
        jacobian = np.ones((len(ranges), 1, 8))
        jacobian[:, 0, 0:2] = -sight
        jacobian[:, 0, 2] = sight[:, 0] * arm_i[:, 1] - sight[:, 1] * arm_i[:, 0]
        jacobian[:, 0, 3:5] = sight
        jacobian[:, 0, 5] = sight[:, 1] * arm_j[:, 0] - sight[:, 0] * arm_j[:, 1]
        jacobian[:, 0, 7] = near_range_shape(ranges.measured)
        # Cauchy's cost c^2 log(1 + (e / c)^2) by its weight; e and c in sigmas
        scaled = (error / (ROBUST_SIGMAS * ranges.sigma)) ** 2
        weight = 1 / (1 + scaled)
        information = (weight / ranges.sigma**2)[:, None, None]
        self._ranges.add(system, error[:, None], jacobian, information)
        robust = float(np.sum(ROBUST_SIGMAS**2 * np.log1p(scaled)))
        system.cost += robust - float(np.sum(weight * (error / ranges.sigma) ** 2))


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
