"""Where the way behind a lapse may lie: everywhere that ranges allow, not only near by.

A stretch that is freed leaves what came after it loose: a stiff way that only ranges place, as
windows of module 1 are, and with as many wrong valleys. So all places within reach are starts here;
those whose ranges fit nearly as well as the best are solved with the whole team, and the cheapest
is taken. While another is hardly worse nobody knows which it is.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from drslamd.slam import se2
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Freed, Problem
from drslamd.slam.relocation.minima import distinct_poses, gauss_newton_step
from drslamd.slam.se2 import Array, Index

HEADINGS = 12
"""Of starts at each place."""
GRID = np.array([(x, y) for x in range(-3, 4) for y in range(-3, 4) if x * x + y * y <= 10])
"""Places of starts, in sigmas of where the robot may have come."""
LEAST_M, LEAST_RAD = 0.1, 0.05
"""What wheels that spin leave unknown beside their way."""
FIRST_STEPS, STEPS, CARRIED = 3, 10, 24
"""Steps of all starts, and of the best of them after that."""
LONGEST = 1.0
"""m and rad of a step."""
APART_M, APART_RAD = 0.3, 0.3
"""Places that are nearer are one."""
NEARLY, MOST = 15.0, 2
"""How much worse ranges alone may be of a place that is tried, and how many are beside the best."""
RIVAL = 12.0
"""By so much of the whole cost another place must be worse, or it may be that one."""
FEWEST = 4
"""Ranges since; three are what a place costs."""


class PlacedWay(NamedTuple):
    """The solution, and is there no other nearly as good?"""

    point: Point
    is_clear: bool


def best_placed(
    equations: Equations, point: Point, freed: Freed, most: int, tolerance: float
) -> PlacedWay:
    """The cheapest solution with the way behind a stretch wherever it fits.

    Args:
        point: one solution.
        most, tolerance: of others, see `descend`.
    """
    problem = equations.problem
    way = _Way.behind(problem, point, freed)
    if way is None:
        return PlacedWay(point, is_clear=False)
    found = [point]
    for move in way.minima():
        near = Equations(replace(problem, initial=way.moved(point, move)), like=equations)
        found.append(descend(near, point.calibration, most, tolerance))
    cost = np.array([equations.cost(one, point.threshold) for one in found])
    best = found[int(cost.argmin())]
    others = [one for one, c in zip(found, cost, strict=True) if c < cost.min() + RIVAL]
    apart = [one.poses[way.after[-1]] for one in (best, *others)]
    return PlacedWay(best, is_clear=len(distinct_poses(np.array(apart), APART_M, APART_RAD)) == 1)


class _Way(NamedTuple):
    """A stiff way of one robot, and ranges to it; places are x + iy in w.

    Attributes:
        inside, after: poses within the stretch and behind it, in the order of time.
        before: (3,) the last pose before it.
        begin: where the way begins; likely: where it should, and how much it should be turned, as
            wheels have it; unsure: (2,) sigmas of that, m and rad.
        antenna, seen: (k,) of the robot and of others; range_m: (k,) how far they are apart as
            measured, as certain as sigma_m (k,).
        middle: of the antennas.
        tail: sigmas beyond which a range loses weight.
    """

    inside: Index
    after: Index
    before: Array
    begin: complex
    likely: tuple[complex, float]
    unsure: Array
    antenna: Array
    seen: Array
    range_m: Array
    sigma_m: Array
    middle: complex
    tail: float

    @staticmethod
    def behind(problem: Problem, point: Point, freed: Freed) -> _Way | None:
        """None where too little was measured since."""
        odometry, ranges, links = problem.odometry, problem.ranges, freed.links
        first, last = odometry.i[links[0]], odometry.j[links[-1]]
        is_mine = odometry.robot == freed.robot
        every = np.unique(np.append(odometry.i[is_mine], odometry.j[is_mine]))
        every = every[np.argsort(problem.n[every], kind="stable")]
        n = problem.n[every]
        after = every[n >= problem.n[last]]
        of_i, of_j = np.isin(ranges.i, after), np.isin(ranges.j, after)
        which = of_i != of_j
        if np.count_nonzero(which) < FEWEST or len(after) < 2:
            return None
        sight, place = point.sight, point.poses[:, 0] + 1j * point.poses[:, 1]
        end_i = (place[ranges.i] + sight.arm_i)[which]
        end_j = (place[ranges.j] + sight.arm_j)[which]
        antenna = np.where(of_i[which], end_i, end_j)
        likely = point.poses[first]
        for step in odometry.measured[links]:
            likely = se2.compose(likely, step)
        variance = np.einsum("kii->i", freed.added)
        return _Way(
            inside=every[(n > problem.n[first]) & (n < problem.n[last])],
            after=after,
            before=point.poses[first],
            begin=complex(place[last]),
            likely=(complex(*likely[:2]), float(likely[2] - point.poses[last, 2])),
            unsure=np.sqrt([variance[:2].sum() / 2 + LEAST_M**2, variance[2] + LEAST_RAD**2]),
            antenna=antenna,
            seen=np.where(of_i[which], end_j, end_i),
            range_m=np.abs(end_j - end_i) - sight.error[which],
            sigma_m=ranges.sigma[which],
            middle=complex(antenna.mean()),
            tail=problem.model.cauchy_sigmas,
        )

    def minima(self) -> Array:
        """(m, 3) how the way may be moved and turned about its middle, best first, and not left
        where it is."""
        theta = np.arange(HEADINGS) * 2 * np.pi / HEADINGS
        where = self.likely[0] + (GRID * self.unsure[0]) @ [1, 1j]
        # each start has the beginning of the way at one of these places
        at = where[:, None] - self.middle - np.exp(1j * theta) * (self.begin - self.middle)
        x = np.column_stack([at.real.ravel(), at.imag.ravel(), np.tile(theta, len(where))])
        x = self._descended(x, FIRST_STEPS)
        x = x[np.argsort(self._cost(x), kind="stable")[:CARRIED]]
        x = self._descended(x, STEPS)
        cost = self._cost(x)
        order = np.argsort(cost, kind="stable")
        x = x[order][cost[order] < cost.min() + NEARLY]
        x[:, 2] = np.angle(np.exp(1j * x[:, 2]))
        here = np.zeros((1, 3))
        apart = distinct_poses(np.concatenate([here, x]), APART_M, APART_RAD)
        return np.asarray(apart[1 : MOST + 2])

    def moved(self, point: Point, move: Array) -> Array:
        """(k, 3) all poses, with the way behind the stretch where it may be."""
        poses, turn = point.poses.copy(), np.exp(1j * move[2])
        place = poses[self.after, 0] + 1j * poses[self.after, 1]
        place = self.middle + complex(*move[:2]) + turn * (place - self.middle)
        poses[self.after, 0], poses[self.after, 1] = place.real, place.imag
        poses[self.after, 2] += move[2]
        share = (np.arange(len(self.inside)) + 1)[:, None] / (len(self.inside) + 1)
        poses[self.inside] = self.before + share * (poses[self.after[0]] - self.before)
        return np.asarray(poses)

    def _linear(self, x: Array) -> tuple[Array, Array]:
        """Residuals of ranges (m, k) in sigmas and their derivatives (m, k, 3)."""
        arm = np.exp(1j * x[:, 2])[:, None] * (self.antenna - self.middle)
        sight = self.middle + (x[:, 0] + 1j * x[:, 1])[:, None] + arm - self.seen
        distance = np.maximum(np.abs(sight), 1e-6)
        u = sight / distance
        j = np.stack([u.real, u.imag, (np.conj(u) * 1j * arm).real], axis=-1)
        return (distance - self.range_m) / self.sigma_m, j / self.sigma_m[:, None]

    def _by_wheels(self, x: Array) -> tuple[Array, Array]:
        """The same of the place and the turn of the beginning, (m, 3) and (m, 3, 3)."""
        place, turn = self.likely
        arm = np.exp(1j * x[:, 2]) * (self.begin - self.middle)
        off = self.middle + x[:, 0] + 1j * x[:, 1] + arm - place
        e = np.stack([off.real, off.imag, np.angle(np.exp(1j * (x[:, 2] - turn)))], axis=-1)
        j = np.tile(np.eye(3), (len(x), 1, 1))
        j[:, 0, 2], j[:, 1, 2] = -arm.imag, arm.real
        sigmas = self.unsure[[0, 0, 1]]
        return e / sigmas, j / sigmas[:, None]

    def _cost(self, x: Array) -> Array:
        """(m,)"""
        e, prior = self._linear(x)[0], self._by_wheels(x)[0]
        of_ranges = self.tail**2 * np.log1p((e / self.tail) ** 2).sum(axis=1)
        return np.asarray(of_ranges + (prior**2).sum(axis=1))

    def _descended(self, x: Array, steps: int) -> Array:
        for _ in range(steps):
            (e, j), (prior, by) = self._linear(x), self._by_wheels(x)
            weighted = j / (1 + (e / self.tail) ** 2)[..., None]
            normal = np.einsum("mki,mkj->mij", weighted, j) + np.swapaxes(by, 1, 2) @ by
            gradient = np.einsum("mki,mk->mi", weighted, e) + np.einsum("mki,mk->mi", by, prior)
            x = gauss_newton_step(x, normal, gradient, LONGEST)
        return x
