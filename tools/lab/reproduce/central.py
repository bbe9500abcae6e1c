"""The rival of table III: centralised UWB SLAM that is told the true start poses.

All ranges and all odometry in one least-squares problem, solved in one place, every robot held at
its true first pose. White noise and nothing else: no bias, no scale, no robust cost, which is what
"conventional" means there.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import spsolve

from drslamd.slam import se2
from drslamd.slam.optimizer.factor_errors import pose_errors
from drslamd.slam.optimizer.factors import chain_links
from drslamd.slam.optimizer.problem import BetweenFactors
from lab.recordings.recording import Array
from lab.reproduce.dpgo import chain
from lab.reproduce.experiment import GRID_S, POSE_TIMES, Trial
from lab.reproduce.paper_column import SIGMA_R
from lab.score import metrics

STEPS = 50
SETTLED = 1e-5
"""m and rad; a smaller step ends it."""
HELD = 1e4
"""Inverse sigma of the known start poses: 0.1 mm and 0.1 mrad."""


@dataclass
class Rows:
    """Whitened errors and their sparse Jacobian, block by block."""

    errors: list[Array] = field(default_factory=list)
    places: list[tuple[Array, Array]] = field(default_factory=list)
    values: list[Array] = field(default_factory=list)
    count: int = 0

    def add(self, errors: Array, *blocks: tuple[Array, Array]) -> None:
        """Errors (m, d) and, for each pose that they depend on, its rows (m,) and (m, d, 3)."""
        m, d = errors.shape
        row = self.count + np.arange(m * d).reshape(m, d, 1)
        for pose, block in blocks:
            column = 3 * pose[:, None, None] + np.arange(3)
            every = np.broadcast_arrays(row, column, block)
            self.places.append((every[0].ravel(), every[1].ravel()))
            self.values.append(every[2].ravel())
        self.errors.append(errors.ravel())
        self.count += m * d

    def together(self, unknowns: int) -> tuple[Array, csc_array]:
        row, column = (np.concatenate(p) for p in zip(*self.places, strict=True))
        slope = coo_array((np.concatenate(self.values), (row, column)), (self.count, unknowns))
        return np.concatenate(self.errors), csc_array(slope)


@dataclass(frozen=True)
class Measured:
    """Pose k of robot r is number times * r + k.

    Attributes:
        start: numbers of the first poses and where they truly are (robots, 3).
        odometry: edges; whiten (m, 3, 3) their whitening.
        i, j, ranges: (n,) of the latest range at each pose time.
    """

    start: tuple[Array, Array]
    odometry: BetweenFactors
    whiten: Array
    i: Array
    j: Array
    ranges: Array


def solve(trial: Trial) -> dict[int, Array]:
    """Poses (n, 3) of each robot at the pose times, in the frame of the truth."""
    data, size = measured(trial), len(POSE_TIMES)
    reckoned = [
        metrics.compose(trial.truth[r][:1], metrics.relative(o[:1], o))
        for r, o in sorted(trial.odometry.items())
    ]
    poses = np.concatenate(reckoned)
    damping = 1e-6
    error, slope = _linearised(data, poses)
    for _ in range(STEPS):
        hessian = slope.T @ slope
        lifted = csc_array(hessian + diags_array(damping * hessian.diagonal()))
        step = -spsolve(lifted, slope.T @ error)
        tried = poses + step.reshape(-1, 3)
        new_error, new_slope = _linearised(data, tried)
        if new_error @ new_error <= error @ error:
            poses, error, slope, damping = tried, new_error, new_slope, damping / 10
            if np.abs(step).max() < SETTLED:
                break
        else:
            damping *= 100
    return {r: poses[r * size : (r + 1) * size] for r in sorted(trial.odometry)}


def measured(trial: Trial) -> Measured:
    """A trial's odometry between pose times, and the ranges at them."""
    size, robots = len(POSE_TIMES), sorted(trial.odometry)
    links = [chain_links(chain(trial.odometry[r], r), calibrated=False) for r in robots]
    odometry = BetweenFactors(
        np.concatenate([size * r + e.i for r, e in zip(robots, links, strict=True)]),
        np.concatenate([size * r + e.j for r, e in zip(robots, links, strict=True)]),
        np.concatenate([e.measured for e in links]),
        np.concatenate([e.covariance for e in links]),
    )
    whiten = np.swapaxes(np.linalg.cholesky(odometry.information), 1, 2)
    i, j, ranges = [], [], []
    for (a, b), data in trial.pairs.items():
        at = np.searchsorted(data.t, POSE_TIMES + GRID_S / 2) - 1
        i.append(size * a + np.arange(size))
        j.append(size * b + np.arange(size))
        ranges.append(data.ranges[at])
    start = np.array([size * r for r in robots]), np.array([trial.truth[r][0] for r in robots])
    ends = np.concatenate(i), np.concatenate(j)
    return Measured(start, odometry, whiten, *ends, np.concatenate(ranges))


def _linearised(data: Measured, poses: Array) -> tuple[Array, csc_array]:
    rows = Rows()
    first, where = data.start
    off = poses[first] - where
    off[:, 2] = se2.wrap(off[:, 2])
    rows.add(HELD * off, (first, HELD * np.broadcast_to(np.eye(3), (len(first), 3, 3))))
    e = data.odometry
    by_i, by_j = _link_slopes(poses, e)
    error = np.einsum("mij,mj->mi", data.whiten, pose_errors(poses, e, e.measured))
    rows.add(error, (e.i, data.whiten @ by_i), (e.j, data.whiten @ by_j))
    sight = poses[data.j, :2] - poses[data.i, :2]
    distance = np.maximum(np.hypot(*sight.T), 1e-6)
    u = np.zeros((len(sight), 1, 3))
    u[:, 0, :2] = sight / distance[:, None] / SIGMA_R
    rows.add((distance - data.ranges)[:, None] / SIGMA_R, (data.i, -u), (data.j, u))
    return rows.together(poses.size)


def _link_slopes(poses: Array, edges: BetweenFactors) -> tuple[Array, Array]:
    """(m, 3, 3) of the errors of relative poses by pose i and by pose j."""
    theta = poses[edges.i, 2]
    cos, sin = np.cos(theta), np.sin(theta)
    seen = se2.rotate(-theta, poses[edges.j, :2] - poses[edges.i, :2])
    by_i, by_j = np.zeros((2, len(theta), 3, 3))
    by_j[:, 0, 0], by_j[:, 0, 1], by_j[:, 1, 0], by_j[:, 1, 1] = cos, sin, -sin, cos
    by_j[:, 2, 2] = 1
    by_i[:, :2, :2] = -by_j[:, :2, :2]
    by_i[:, 0, 2], by_i[:, 1, 2], by_i[:, 2, 2] = seen[:, 1], -seen[:, 0], -1
    return by_i, by_j
