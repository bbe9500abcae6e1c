"""Algorithm 1 and its refinement as the paper prints them: one seed, white noise, no verdict."""

from __future__ import annotations

import numpy as np

from drslamd.slam import range_model, se2
from drslamd.slam.relative_pose.descent import LEAST_DAMPING
from drslamd.slam.relative_pose.estimate import Hypothesis, RelativePoseEstimate, Verdict
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.se2 import Array

FEWEST = 4
"""Ranges; three unknowns and one to contradict them."""
PRIOR = 1e-4
"""Information, 1/m^2 and 1/rad^2, added to what a window says: no verdict keeps windows back that
say nothing, and a covariance of 100 m can still be sent."""
ROWS_AT_ONCE = 16
"""Measurements that are summed before grid points that already lost are left out."""
MOST_ITERATIONS = 100
SETTLED = 1e-6
"""m and rad: a smaller step is the last one."""
HOPELESS_DAMPING = 1e9
"""Where even this does not lower the cost, no step does."""


def solve(window: Window, range_sigma: float, delta: float) -> RelativePoseEstimate:
    """Coarse search, then eq. (1) from its best point; covariance sigma_r^2 (J' J)^-1.

    Args:
        window: tau measurements at 10 Hz.
        range_sigma: m.
        delta: step of the inclusive grid -w .. w, w = ceil(pi / delta).
    """
    if len(window) < FEWEST:
        return RelativePoseEstimate(Verdict.TOO_FEW)
    a, b, ranges = window.a_points, window.b_points, window.ranges
    pose = least_squares(a, b, ranges, coarse_search(a, b, ranges, delta))
    e, j = (value[0] for value in linear(pose[None], a, b, ranges))
    information = j.T @ j / range_sigma**2 + PRIOR * np.eye(3)
    chi2 = float(e @ e) / range_sigma**2
    pose = np.append(pose[:2], se2.wrap(pose[2]))
    only = Hypothesis(pose, np.linalg.inv(information), chi2)
    return RelativePoseEstimate(Verdict.UNIQUE, (only,))


def coarse_search(a: Array, b: Array, ranges: Array, delta: float) -> Array:
    """Algorithm 1: the point of the search set with the smallest sum of squared residuals.

    Args:
        a, b: (n, 2) points in their frames, m.
        ranges: (n,) m, the last one at the reference time.

    Returns:
        a_T_b (3,).
    """
    w = int(np.ceil(np.pi / delta))
    angles = np.arange(-w, w + 1) * delta
    phi, theta = (x.ravel() for x in np.meshgrid(angles, angles, indexing="ij"))
    r = float(ranges[-1])
    poses = np.stack([r * np.cos(phi), r * np.sin(phi), theta], axis=-1)  # eq. (2), line 4
    cost = np.zeros(len(poses))
    alive = np.arange(len(poses))
    for rows in np.array_split(np.arange(len(ranges)), max(1, len(ranges) // ROWS_AT_ONCE)):
        e = window_residuals(poses[alive], a[rows], b[rows], ranges[rows])
        cost[alive] += np.sum(e * e, axis=1)  # line 7
        if rows[-1] + 1 < len(ranges):
            champion = window_residuals(poses[alive[np.argmin(cost[alive])]][None], a, b, ranges)
            bound = float(np.sum(champion * champion))
        else:
            bound = float(cost[alive].min())
        # lines 8 and 9: a grid point that already lost is not summed further
        alive = alive[cost[alive] <= bound * (1 + 1e-12)]
    return np.asarray(poses[alive[np.argmin(cost[alive])]])  # lines 10 to 12


def window_residuals(poses: Array, a: Array, b: Array, ranges: Array) -> Array:
    """(k, n) eq. (1) at poses (k, 3), m."""
    return range_model.residuals(_sight(poses, a, b)[0], ranges)[0]


def linear(poses: Array, a: Array, b: Array, ranges: Array) -> tuple[Array, Array]:
    """Eq. (1) at poses (k, 3): residuals (k, n), and their derivatives (k, n, 3) by the pose."""
    sight, turned = _sight(poses, a, b)
    e, u = range_model.residuals(sight, ranges)
    by_theta = u.imag * turned.real - u.real * turned.imag
    return e, np.stack([u.real, u.imag, by_theta], axis=-1)


def _sight(poses: Array, a: Array, b: Array) -> tuple[Array, Array]:
    """From a's points to b's, and b's points turned into frame a: (k, n) each, x + iy."""
    turned = np.exp(1j * poses[:, 2:]) * (b[:, 0] + 1j * b[:, 1])
    place = poses[:, :1] + 1j * poses[:, 1:2]
    return turned + place - (a[:, 0] + 1j * a[:, 1]), turned


def least_squares(a: Array, b: Array, ranges: Array, pose: Array) -> Array:
    """Levenberg-Marquardt on eq. (1) from one pose (3,)."""
    damping = 1e-3
    e, j = (value[0] for value in linear(pose[None], a, b, ranges))
    for _ in range(MOST_ITERATIONS):
        hessian = j.T @ j
        lifted = hessian + np.diag(max(damping, LEAST_DAMPING) * np.diag(hessian) + 1e-12)
        step = -np.linalg.solve(lifted, j.T @ e)
        trial = pose + step
        new_e, new_j = (value[0] for value in linear(trial[None], a, b, ranges))
        if new_e @ new_e <= e @ e:
            pose, e, j, damping = trial, new_e, new_j, damping / 5
            if np.abs(step).max() < SETTLED:
                break
        else:
            damping *= 8
            if damping > HOPELESS_DAMPING:
                break
    return pose
