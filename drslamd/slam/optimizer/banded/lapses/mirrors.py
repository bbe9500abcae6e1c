"""On which side of two others a robot drives whose wheels do not say so.

While a stretch lasts that is freed, ranges to two other robots leave two places each second, one on
either side of the line through both. A solution stays on the side on which it began, though the
robot crossed that line, or crosses it where the robot did not. But who drives goes on as it drove:
of all ways through the places of either side one bends least (Viterbi's search), and if with its
bends counted it costs less than the way that was come to, that is where the robot drove.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from drslamd.conventions import GRID_HZ
from drslamd.slam.optimizer.banded.lapses.stretches import UNKNOWN_M
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Freed, Problem
from drslamd.slam.se2 import Array, Index

BEND = 0.3
"""m/s and the square root of a second: by so much velocity changes, along and across."""
FEWEST = 3
"""Places within a stretch, of less no side can be told."""


def on_likelier_side(
    equations: Equations, point: Point, freed: Freed, most: int, tolerance: float
) -> Point:
    """The solution with the robot on that side of others on which its way bends less.

    Args:
        point: one solution.
        freed: a stretch that lasts until now.
        most, tolerance: of another, see `descend`.
    """
    problem = equations.problem
    way = _Way.along(problem, point, freed)
    if way is None:
        return point
    places, here = way.least_bent(), _places(point, way.poses)
    if not way.is_other_side(places, here):
        return point
    initial = point.poses.copy()
    initial[way.poses, 0], initial[way.poses, 1] = places.real, places.imag
    near = Equations(replace(problem, initial=initial), like=equations)
    other = descend(near, point.calibration, most, tolerance)
    before = equations.cost(point, point.threshold) + way.bends(here)
    after = equations.cost(other, point.threshold) + way.bends(_places(other, way.poses))
    return other if after < before else point


class _Way(NamedTuple):
    """The poses (k,) of a robot along a stretch; places are x + iy in w.

    Attributes:
        poses: as the problem numbers them.
        places: (2, k) where they may be, on either side of two others.
        misfit: (2, k) what ranges cost there.
        reach: (k,) m that the robot may have come since the pose before.
        seconds: (k,) since then.
        before: where it was at first; velocity: how it drove then, m/s.
    """

    poses: Index
    places: Array
    misfit: Array
    reach: Array
    seconds: Array
    before: complex
    velocity: complex

    @staticmethod
    def along(problem: Problem, point: Point, freed: Freed) -> _Way | None:
        """None where wheels spin, where the stretch is over, or has too few poses that two others
        see."""
        odometry, links = problem.odometry, freed.links
        mine = np.flatnonzero(odometry.robot == freed.robot)
        last = mine[np.argsort(problem.n[odometry.j[mine]], kind="stable")][-1]
        first = int(odometry.i[links[0]])
        came = mine[odometry.j[mine] == first]
        if not freed.stands or last != links[-1] or not len(came):
            return None
        poses = odometry.j[links]
        places, misfit = _either_side(problem, point, poses)
        if np.count_nonzero(places[0] != places[1]) < FEWEST:
            return None
        seconds = (problem.n[poses] - problem.n[odometry.i[links]]) / GRID_HZ
        start, earlier = _places(point, np.array([first, odometry.i[came[0]]]))
        lasted = (problem.n[first] - problem.n[odometry.i[came[0]]]) / GRID_HZ
        reach = np.sqrt(np.einsum("kii->k", freed.added[:, :2, :2]) / 2)
        return _Way(
            poses, places, misfit, reach, seconds, complex(start), complex(start - earlier) / lasted
        )

    def is_other_side(self, places: Array, here: Array) -> bool:
        """Is any of the places (k,) on another side than where the robot is in a solution?"""
        other = self.places.sum(axis=0) - places
        return bool((np.abs(here - places) > np.abs(here - other)).any())

    def least_bent(self) -> Array:
        """(k,) the cheapest way through the places of either side."""
        k = self.places.shape[1]
        cost = np.full((2, 2), np.inf)
        back = np.zeros((k, 2, 2), dtype=int)
        # cost[a, b]: of the best way whose last two places are on the sides a and b
        for b in range(2):
            step = self._step(0, self.before, self.places[b, 0], self.velocity)
            cost[:, b] = self.misfit[b, 0] + step
        for at in range(1, k):
            new = np.full((2, 2), np.inf)
            for b, c in product(range(2), range(2)):
                middle = self.places[b, at - 1]
                tried = []
                for a in range(2):
                    start = self.places[a, at - 2] if at > 1 else self.before
                    velocity = (middle - start) / self.seconds[at - 1]
                    step = self._step(at, middle, self.places[c, at], velocity)
                    tried.append(cost[a, b] + step)
                back[at, b, c] = int(np.argmin(tried))
                new[b, c] = min(tried) + self.misfit[c, at]
            cost = new
        sides = [int(cost.argmin()) % 2, int(cost.argmin()) // 2]
        for at in range(k - 1, 1, -1):
            sides.append(int(back[at, sides[-1], sides[-2]]))
        return np.asarray(self.places[sides[::-1], np.arange(k)])

    def _step(self, at: int, start: complex, end: complex, velocity: complex) -> float:
        """What it costs to come from one place to another, with the velocity before it."""
        change = (end - start) / self.seconds[at] - velocity
        bend = abs(change) ** 2 / (BEND**2 * self._between(at))
        return float(abs(end - start) ** 2 / self.reach[at] ** 2 + bend)

    def _between(self, at: int) -> float:
        """Seconds between the middle of a link and that of the one before."""
        return float(self.seconds[at] + (self.seconds[at - 1] if at else self.seconds[at])) / 2

    def bends(self, places: Array) -> float:
        """What it costs that a way through places (k,) bends."""
        steps = np.diff(np.append(self.before, places)) / self.seconds
        changes = np.diff(np.append(self.velocity, steps))
        between = [self._between(at) for at in range(len(places))]
        return float((np.abs(changes) ** 2 / np.array(between)).sum()) / BEND**2


def _places(point: Point, poses: Index) -> Array:
    return np.asarray(point.poses[poses, 0] + 1j * point.poses[poses, 1])


def _either_side(problem: Problem, point: Point, poses: Index) -> tuple[Array, Array]:
    """(2, k) the places at which ranges to two others hold, as solved where there are none to two;
    and what all ranges cost there."""
    ranges, sight = problem.ranges, point.sight
    tail, place = problem.model.cauchy_sigmas, point.poses[:, 0] + 1j * point.poses[:, 1]
    places, misfit = np.tile(place[poses], (2, 1)), np.zeros((2, len(poses)))
    for at, pose in enumerate(poses.tolist()):
        of_i = ranges.i == pose
        which = np.flatnonzero((of_i | (ranges.j == pose)) & (ranges.sigma < UNKNOWN_M))
        is_i = of_i[which]
        end_i = place[ranges.i[which]] + sight.arm_i[which]
        end_j = place[ranges.j[which]] + sight.arm_j[which]
        antenna, seen = np.where(is_i, end_i, end_j), np.where(is_i, end_j, end_i)
        measured = np.abs(antenna - seen) - sight.error[which]
        whose = problem.robot_id[np.where(is_i, ranges.j[which], ranges.i[which])]
        robots = np.unique(whose)
        if len(robots) >= 2:
            a, b = (int(np.flatnonzero(whose == robot)[-1]) for robot in robots[:2])
            arm = antenna[a] - place[pose]
            places[:, at] = _meet(seen[a], measured[a], seen[b], measured[b]) - arm
        for side in range(2):
            distance = np.abs(antenna + places[side, at] - place[pose] - seen)
            off = (distance - measured) / ranges.sigma[which]
            misfit[side, at] = tail**2 * np.log1p((off / tail) ** 2).sum()
    return places, misfit


def _meet(a: complex, from_a: float, b: complex, from_b: float) -> Array:
    """(2,) where circles about two places meet, or come nearest to that."""
    apart = max(abs(b - a), 1e-9)
    along = (apart**2 + from_a**2 - from_b**2) / (2 * apart)
    across = np.sqrt(max(from_a**2 - along**2, 0.0))
    return np.asarray(a + (b - a) / apart * np.array([along + 1j * across, along - 1j * across]))
