"""Is all as modelled? The questions of `banded.explanation`, asked each second of a kept factor.

Its matrix is near that of the solution, and how much the rest says of a mounting only grows, so an
answer that says yes is one; when it is no, `banded_solver` looks closer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.conventions import GRID_HZ
from drslamd.slam.optimizer.banded import mountings
from drslamd.slam.optimizer.banded.band_factor import Solver
from drslamd.slam.optimizer.banded.common_level import ASKS
from drslamd.slam.optimizer.banded.explanation import SUSPICIOUS
from drslamd.slam.optimizer.banded.misfit import (
    guessed_misfit,
    many_wrong,
    ratio_of,
    squares_of,
    with_runs,
)
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept.exact_gradient import mounting_pulls
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array, Index

GROWN = 1.05
"""Times as many links as when a freedom was computed ..."""
MINUTE = 60 * GRID_HZ
"""... and samples since then, at most: thinning takes away links, and others come."""


@dataclass(frozen=True)
class Freedom:
    """What the other measurements could check of each robot's odometry, some seconds ago.

    It grows with the way, as the links do or faster: the more ranges there are, the more each link
    is checked. To compute it takes a factor of its own, so it is done again when there are some
    more links (`GROWN`), or after a minute.

    Attributes:
        checked: (robots,) g, see `misfit`; links: (robots,) of so many.
        newest: (robots,) keyframe at which the last of them ends.
    """

    checked: Array
    links: Array
    newest: Index

    @staticmethod
    def of(equations: Equations, point: Point, matrix: Solver) -> Freedom:
        """
        Args:
            equations: in the layout of `matrix`.
        """
        odometry, robots = equations.problem.odometry, len(equations.problem.priors.scale)
        checked = guessed_misfit(equations, point, matrix).checked
        sums = np.bincount(odometry.robot, checked, robots)
        links = np.bincount(odometry.robot, minlength=robots).astype(float)
        return Freedom(sums, links, _newest(equations.problem, robots))

    def is_fresh(self, problem: Problem) -> bool:
        """Have the robots not driven much further since?"""
        links = np.bincount(problem.odometry.robot, minlength=len(self.links))
        since = _newest(problem, len(self.links)) - self.newest
        return bool((links <= GROWN * self.links).all() and (since <= MINUTE).all())

    def ratio(self, problem: Problem, point: Point) -> tuple[Array, float]:
        """(robots,) s / g now, and that of all together."""
        robot, robots = problem.odometry.robot, len(self.links)
        squares = np.bincount(robot, squares_of(problem, point), robots)
        links = np.bincount(robot, minlength=robots)
        checked = self.checked * links / np.maximum(self.links, 1.0)
        return ratio_of(squares, checked), float(ratio_of(squares.sum(), checked.sum()))


def _newest(problem: Problem, robots: int) -> Index:
    """(robots,) keyframe at which the last link of each ends."""
    found = np.zeros(robots, dtype=np.int64)
    np.maximum.at(found, problem.odometry.robot, problem.n[problem.odometry.j])
    return found


def misfit_as_modelled(
    problem: Problem, point: Point, checked: Freedom, variances: Array
) -> Array | None:
    """(robots,) s / g of odometry, see `misfit`; None where something may not be as modelled.

    Args:
        variances: of the mountings, see `mountings.variances`; they may be of some seconds ago.
    """
    if len(with_runs(problem, point)) or many_wrong(problem, point):
        return None
    pull = mounting_pulls(problem, point)
    if mountings.scored(problem, pull, variances).ask():
        return None
    ratio, pooled = checked.ratio(problem, point)
    return ratio if (ratio <= SUSPICIOUS).all() and pooled <= ASKS else None
