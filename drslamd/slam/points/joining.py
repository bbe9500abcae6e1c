"""How two robots lie to each other, by things that stand and that both have passed.

    a_T_b P_b = P_a  for each of them,   r_i = | p_a,i - a_T_b p_b,i | + bias

Two such things are enough; with one, ranges between the robots say how they are turned about it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drslamd.slam import range_model, se2
from drslamd.slam.graph.tables import KeyframeTable
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.points.point_tracker import Sensors
from drslamd.slam.relative_pose.solver import EXCLUDED_CHI2
from drslamd.slam.relative_pose.window_noise import moments, odometry_covariance, way_twists
from drslamd.slam.relocation.minima import distinct_poses, gauss_newton_step
from drslamd.slam.se2 import Array

MOST = 6
"""Minima that are judged."""
STARTS = 24
STEPS, JUDGED_STEPS = 20, 6
LONGEST = 1.0
"""m, rad: what one step may do."""
MERGE_M, MERGE_RAD = 0.3, 0.15
"""Minima that are nearer are one."""
POOR_FIT = 4.0
"""So many sigmas above its mean chi-squared no longer explains what was measured."""
MAX_SIGMA_M, MAX_SIGMA_RAD = 0.5, np.radians(8.0)
"""What is vaguer is not said yet."""


@dataclass(frozen=True)
class Common:
    """What two robots have in common, each seen from its own last keyframe.

    Attributes:
        a_places, b_places: (p, 2) of p things; a_spreads, b_spreads: (p, 2, 2).
        t: (k,) s of the ranges between them; range_m: (k,).
        poses: (2, k, 3) of both; points: (2, k) of their antennas, x + iy.
    """

    a_places: Array
    b_places: Array
    a_spreads: Array
    b_spreads: Array
    t: Array
    range_m: Array
    poses: Array
    points: Array


class Joined(NamedTuple):
    """Between the last keyframes of both: a_T_b (3,) and its covariance (3, 3).

    Attributes:
        a, b: their keyframes of late.
    """

    a: KeyframeTable
    b: KeyframeTable
    a_T_b: Array
    covariance: Array

    @property
    def a_n(self) -> int:
        return int(self.a.n[-1])

    @property
    def b_n(self) -> int:
        return int(self.b.n[-1])

    def earlier(self, other: Joined) -> Array:
        """(3,) what it says of keyframes of an earlier answer, or of its own if they are gone."""
        ends = (self.a, other.a_n), (self.b, other.b_n)
        at = [table.find(np.array([float(n)])) for table, n in ends]
        if not all(there.all() for _, there in at):
            return self.a_T_b
        a_T_then, b_T_then = (
            se2.between(table.poses[-1], table.poses[rows[0]])
            for (table, _), (rows, _) in zip(ends, at, strict=True)
        )
        return se2.compose(se2.inverse(a_T_then), se2.compose(self.a_T_b, b_T_then))


def joined(
    common: Common,
    noises: tuple[OdometryNoise, OdometryNoise],
    keyframes: tuple[KeyframeTable, KeyframeTable],
    sensors: Sensors,
) -> Joined | str:
    """How b lies to a, or why that is not said.

    Args:
        noises: of both odometries; keyframes: of late, of both.
    """
    problem = _Problem(common, noises, sensors)
    x = problem.descended(problem.starts())
    judged = [
        problem.judged(row)
        for row in distinct_poses(x[np.argsort(problem.cost(x))], MERGE_M, MERGE_RAD)[:MOST]
    ]
    judged.sort(key=lambda one: one.chi2)
    first = judged[0]
    freedom = len(common.t) + 2 * len(common.a_places) - 3
    if not first.chi2 <= freedom + POOR_FIT * np.sqrt(2 * freedom):
        return "they do not fit each other"
    rivals = [one.x for one in judged if one.chi2 < first.chi2 + EXCLUDED_CHI2]
    if len(distinct_poses(np.array(rivals), MERGE_M, MERGE_RAD)) > 1:
        return "ambiguous"
    sigma_m = np.sqrt(np.linalg.eigvalsh(first.covariance[:2, :2])[-1])
    if sigma_m > MAX_SIGMA_M or np.sqrt(first.covariance[2, 2]) > MAX_SIGMA_RAD:
        return "not enough motion"
    return Joined(*keyframes, first.x, first.covariance)


class _Judged(NamedTuple):
    x: Array
    covariance: Array
    chi2: float


class _Problem:
    """Unknown is a_T_b (3,)."""

    def __init__(
        self, common: Common, noises: tuple[OdometryNoise, OdometryNoise], sensors: Sensors
    ) -> None:
        self._c, self._noise, self._model = common, sensors.noise, sensors.model
        self._count = np.array([len(common.t)])
        before = np.repeat(self._count, 2)
        antenna = self._model.antenna_sigma_m
        self._twists = way_twists(common.poses, noises, before, antenna)
        sigma, bias = self._noise.sigma, self._noise.bias_sigma
        self._of_ranges = self._model.covariance(common.t, common.range_m, sigma, bias)
        self._wide = np.hypot(sigma, bias)
        self._a, self._b = common.a_places @ [1, 1j], common.b_places @ [1, 1j]

    def starts(self) -> Array:
        """(m, 3) turned about the things that both know."""
        theta = np.arange(STARTS) * 2 * np.pi / STARTS
        if len(self._a) > 1:
            arms = self._a - self._a.mean(), self._b - self._b.mean()
            theta = np.angle([np.sum(arms[0] * np.conj(arms[1]))])
        at = self._a.mean() - np.exp(1j * theta) * self._b.mean()
        return np.column_stack([at.real, at.imag, theta])

    def _of_points(self, x: Array) -> tuple[Array, Array, Array]:
        """Of things: (m, 2 p) residuals, (m, 2 p, 3) derivatives, (m, 2 p, 2 p) their noise."""
        turned = np.exp(1j * x[:, 2])[:, None] * self._b
        off = (x[:, 0] + 1j * x[:, 1])[:, None] + turned - self._a
        m, p = off.shape
        e = np.stack([off.real, off.imag], axis=-1).reshape(m, 2 * p)
        j = np.zeros((m, p, 2, 3))
        j[..., 0, 0] = j[..., 1, 1] = 1.0
        j[..., 0, 2], j[..., 1, 2] = -turned.imag, turned.real
        noise = np.zeros((m, p, 2, p, 2))
        cos, sin = np.cos(x[:, 2]), np.sin(x[:, 2])
        turn = np.array([[cos, -sin], [sin, cos]]).transpose(2, 0, 1)[:, None]
        each = self._c.a_spreads + turn @ self._c.b_spreads @ np.swapaxes(turn, -1, -2)
        for k in range(p):
            noise[:, k, :, k] = each[:, k]
        return e, j.reshape(m, 2 * p, 3), noise.reshape(m, 2 * p, 2 * p)

    def _of_sights(self, x: Array) -> tuple[Array, Array, Array]:
        """Of ranges: (m, k) residuals, (m, k, 3) derivatives, (m, k) lines of sight."""
        turned = np.exp(1j * x[:, 2])[:, None] * self._c.points[1]
        sight = (x[:, 0] + 1j * x[:, 1])[:, None] + turned - self._c.points[0]
        e, u = range_model.residuals(sight, self._c.range_m)
        by_turn = (np.conj(u) * 1j * turned).real
        return e, np.stack([u.real, u.imag, by_turn], axis=-1), u

    def cost(self, x: Array) -> Array:
        """(m,) as if all ranges were independent."""
        e, _, noise = self._of_points(x)
        squares = np.einsum("mi,mi->m", e, np.linalg.solve(noise, e[..., None])[..., 0])
        sights, _, _ = self._of_sights(x)
        c2 = self._model.cauchy_sigmas**2
        return np.asarray(squares + c2 * np.log1p((sights / self._wide) ** 2 / c2).sum(axis=1))

    def descended(self, x: Array) -> Array:
        """Gauss-Newton's steps from (m, 3), damped and bounded."""
        c2 = self._model.cauchy_sigmas**2
        for _ in range(STEPS):
            e, j, noise = self._of_points(x)
            weighed = np.linalg.solve(noise, np.concatenate([j, e[..., None]], axis=2))
            both = np.swapaxes(j, 1, 2) @ weighed
            sights, by, _ = self._of_sights(x)
            w = 1 / (1 + (sights / self._wide) ** 2 / c2) / self._wide**2
            normal = both[:, :, :3] + np.einsum("mki,mk,mkj->mij", by, w, by)
            g = both[:, :, 3] + np.einsum("mki,mk->mi", by, w * sights)
            x = gauss_newton_step(x, normal, g, LONGEST)
        return x

    def judged(self, x: Array) -> _Judged:
        """A minimum (3,) under the noise of all together."""
        for _ in range(JUDGED_STEPS):
            e, j, noise = (part[0] for part in self._of_points(x[None]))
            weighed = np.linalg.solve(noise, np.column_stack([j, e]))
            normal, g = j.T @ weighed[:, :3], j.T @ weighed[:, 3]
            chi2 = float(e @ weighed[:, 3])
            if len(self._c.t):
                sights, by, u = (part[0] for part in self._of_sights(x[None]))
                seen = np.linalg.solve(self._noise_of(sights, u, x), np.column_stack([by, sights]))
                normal, g = normal + by.T @ seen[:, :3], g + by.T @ seen[:, 3]
                chi2 += float(sights @ seen[:, 3])
            spread = np.linalg.inv(normal + 1e-9 * np.eye(3))
            step = -spread @ g
            x = x + step * min(1.0, LONGEST / (float(np.abs(step).max()) + 1e-12))
        x[2] = float(se2.wrap(x[2]))
        return _Judged(x, spread, chi2)

    def _noise_of(self, e: Array, u: Array, x: Array) -> Array:
        """(k, k) of the residuals of ranges."""
        directions = np.stack([u, u * np.exp(-1j * x[2])])[None]
        moment = moments(self._c.points[None], directions)
        lower = odometry_covariance(self._twists[None], moment, self._count)[0]
        beyond = np.maximum(e**2 - (self._model.cauchy_sigmas * self._wide) ** 2, 0.0)
        both = np.tril(lower) + np.tril(lower, -1).T
        return np.asarray(both + self._of_ranges + np.diag(beyond))
