"""Where a robot is again after wheels that lost its way: found anew, as when it first met the team.

A counter that stuck for seconds leaves two pieces of a path that odometry measured well and a gap
between them. Descending from a solution that was bent across that gap ends in a mirror as often as
not. So the piece after the gap is laid down as a whole: three unknowns, among partners whose places
do not hang on it, from starts all around.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.slam import se2
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem, corrected
from drslamd.slam.range_model import LEAST_DISTANCE_M
from drslamd.slam.se2 import Array, Index

HEADINGS, BEARINGS = 16, 12
"""Starts: how the piece is turned, and where from its first partner it begins."""
STEPS = 12
DAMPING = 1e-3
"""m^-2 and rad^-2 of information that a step has at least."""
FEWEST = 8
"""Ranges that can lay a piece down."""
FITS = 2.0
"""Mean square of the ranges of a piece, in sigmas; as modelled it is 0.2 to 1."""
CLIPPED = 9.0
"""Square that counts at most, so that a burst alone is no misfit."""
GRACE = 10
"""Steps of the keyframes' grid: a gap is tried so much longer each time."""
MOST_TRIES = 12
LASTS = 250
"""Steps of the grid after a gap whose ranges lay a piece down; what follows is odometry."""
REACH_MPS, REACH_M = 0.7, 0.5
"""How far a robot may have come in a gap: sigma, by its length and beyond."""
APART_M, APART_RAD = 1.0, 0.5
"""Another place of a piece is as far from the best one."""


class Piece(NamedTuple):
    """The end of a robot's path, laid down anew.

    Attributes:
        places: (p,) of its poses; poses: (p, 3) in w.
        before: the place of the last pose before the gap.
        other: (p, 3) the next best way to lay it down.
        margin: by how much that costs more.
    """

    places: Index
    poses: Array
    before: int
    other: Array
    margin: float


def piece(problem: Problem, point: Point, robot: int, since: int) -> Piece | None:
    """The longest end of a path that fits ranges as a whole; None where there is none.

    Args:
        point: a solution in which that robot's odometry counts for little since the gap began.
        robot: as the problem numbers them; since: its keyframe at the last moment before the gap.
    """
    names = np.unique(problem.robot)
    mine = np.flatnonzero(problem.robot == names[robot])
    mine = mine[np.argsort(problem.n[mine], kind="stable")]
    n = problem.n[mine]
    before = int(np.searchsorted(n, since, side="right")) - 1
    if before < 0:
        return None
    way = _reckoned(problem, point, mine)
    sights = _Sights.of(problem, point, mine, robot)
    first = before + 1
    for _ in range(MOST_TRIES):
        if first >= len(mine):
            return None
        rows = (sights.place >= first) & (n[sights.place] <= n[first] + LASTS)
        if np.count_nonzero(rows) < FEWEST or not np.isfinite(way[first:]).all():
            return None
        local = se2.between(way[first], way)
        last, gap_s = point.poses[mine[before], :2], (n[first] - n[before]) / 10
        found = _laid(sights.chosen(rows), local, last, REACH_M + REACH_MPS * gap_s)
        if found is not None:
            best, other, margin = found
            poses, others = (se2.compose(start, local[first:]) for start in (best, other))
            return Piece(mine[first:], poses, int(mine[before]), others, margin)
        first = max(first + 1, int(np.searchsorted(n, n[first] + GRACE)))
    return None


class _Sights(NamedTuple):
    """Ranges of one robot.

    Attributes:
        place: (m,) rows of its path; arm: (m,) its antenna in the body frame there, x + iy.
        other: (m,) where the antenna of the partner is in w; metres: (m,) between both.
        sigma: (m,)
    """

    place: Index
    arm: Array
    other: Array
    metres: Array
    sigma: Array

    @staticmethod
    def of(problem: Problem, point: Point, mine: Index, robot: int) -> _Sights:
        ranges, sight, model = problem.ranges, point.sight, problem.model
        is_i, is_j = ranges.robots[:, 0] == robot, ranges.robots[:, 1] == robot
        rows = np.flatnonzero(is_i | is_j)
        ends = np.stack([ranges.i, ranges.j])[:, rows]
        at_i = is_i[rows]
        own, peer = np.where(at_i, ends[0], ends[1]), np.where(at_i, ends[1], ends[0])
        arms = np.stack([sight.arm_i, sight.arm_j])[:, rows]
        own_arm, peer_arm = np.where(at_i, arms[0], arms[1]), np.where(at_i, arms[1], arms[0])
        xy = point.poses[:, 0] + 1j * point.poses[:, 1]
        known = point.calibration
        bias = known.bias[ranges.pair[rows]]
        bias = bias + known.near_bias * model.near_range_shape(ranges.measured[rows])
        order = np.full(len(problem.robot), -1)
        order[mine] = np.arange(len(mine))
        return _Sights(
            place=order[own],
            arm=own_arm * np.exp(-1j * point.poses[own, 2]),
            other=xy[peer] + peer_arm,
            metres=ranges.measured[rows] - bias,
            sigma=ranges.sigma[rows],
        )

    def chosen(self, rows: NDArray[np.bool_]) -> _Sights:
        return _Sights(*(column[rows] for column in self))


def _reckoned(problem: Problem, point: Point, mine: Index) -> Array:
    """(p, 3) odometry of one path, as calibrated; NaN after a break."""
    odometry = problem.odometry
    links = corrected(odometry, point.calibration)
    after = np.full(len(problem.robot), -1)
    after[odometry.j] = np.arange(len(odometry))
    way = np.full((len(mine), 3), np.nan)
    way[0] = 0.0
    for k in range(1, len(mine)):
        link = after[mine[k]]
        if link >= 0 and odometry.i[link] == mine[k - 1]:
            way[k] = se2.compose(way[k - 1], links[link])
    return way


def _laid(
    sights: _Sights, local: Array, last: Array, reach_m: float
) -> tuple[Array, Array, float] | None:
    """The best and the next best pose (3,) of the beginning of a piece, and what the latter costs
    more; None where nothing fits.

    Args:
        local: (p, 3) the path from there.
        last: (2,) where the robot was before; reach_m: sigma of how far it can have come.
    """
    place = local[sights.place]
    body = place[:, 0] + 1j * place[:, 1] + np.exp(1j * place[:, 2]) * sights.arm
    theta = np.repeat(np.arange(HEADINGS) * (2 * np.pi / HEADINGS), BEARINGS)
    bearing = np.tile(np.exp(2j * np.pi * np.arange(BEARINGS) / BEARINGS), HEADINGS)
    z = sights.other[0] + sights.metres[0] * bearing - np.exp(1j * theta) * body[0]
    origin = complex(last[0], last[1])
    for _ in range(STEPS):
        turned = np.exp(1j * theta)[:, None] * body
        sight = z[:, None] + turned - sights.other
        distance = np.maximum(np.abs(sight), LEAST_DISTANCE_M)
        error, u = (distance - sights.metres) / sights.sigma, sight / distance
        weight = 1 / (1 + error**2 / CLIPPED)
        j = np.stack([u.real, u.imag, (np.conj(u) * 1j * turned).real], axis=-1)
        j /= sights.sigma[:, None]
        weighed = j * weight[..., None]
        far = z - origin
        h = np.swapaxes(weighed, 1, 2) @ j + DAMPING * np.eye(3)
        g = (weighed * error[..., None]).sum(axis=1)
        g[:, 0] += far.real / reach_m**2
        g[:, 1] += far.imag / reach_m**2
        h[:, [0, 1], [0, 1]] += reach_m**-2
        step = np.linalg.solve(h, -g[..., None])[..., 0]
        step *= np.minimum(1.0, 1.0 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-9))
        z, theta = z + step[:, 0] + 1j * step[:, 1], theta + step[:, 2]
    sight = z[:, None] + np.exp(1j * theta)[:, None] * body - sights.other
    squares = ((np.abs(sight) - sights.metres) / sights.sigma) ** 2
    cost = (CLIPPED * np.log1p(squares / CLIPPED)).sum(axis=1) + np.abs(
        z - origin
    ) ** 2 / reach_m**2
    best = int(np.argmin(cost))
    if np.minimum(squares[best], CLIPPED).mean() > FITS:
        return None
    turn = np.abs(se2.wrap(theta - theta[best]))
    apart = (np.abs(z - z[best]) > APART_M) | (turn > APART_RAD)
    others = np.where(apart, cost, np.inf)
    other = int(np.argmin(others))
    starts = np.stack([z.real, z.imag, theta], axis=-1)
    return starts[best], starts[other], float(others[other] - cost[best])
