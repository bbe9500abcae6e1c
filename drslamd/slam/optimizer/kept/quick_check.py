"""Is all as modelled? The questions of `banded.explanation`, asked each second of a kept factor.

Its matrix is near that of the solution, and how much the rest says of a mounting only grows, so an
answer that says yes is one; when it is no, `banded_solver` looks closer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.banded import mountings
from drslamd.slam.optimizer.banded.band_factor import Solver
from drslamd.slam.optimizer.banded.explanation import SUSPICIOUS
from drslamd.slam.optimizer.banded.misfit import (
    CLIPPED,
    FEWEST_LATELY,
    LAST,
    LATELY,
    MANY_WRONG,
    MOST_SCATTER,
    RUN,
    guessed_misfit,
    outliers,
    ratio_of,
    squares_of,
)
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept.exact_gradient import mounting_pulls
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array, Index

GROWN = 1.1
"""Times as many links as when a freedom was computed."""


@dataclass(frozen=True)
class Freedom:
    """What the other measurements could check of each robot's odometry, some seconds ago.

    It grows with the way, as the links do or faster: the more ranges there are, the more each link
    is checked. To compute it takes as long as several steps, so it is done again when there are a
    tenth more links.

    Attributes:
        checked: (robots,) g, see `misfit`; links: (robots,) of so many.
    """

    checked: Array
    links: Array

    @staticmethod
    def of(equations: Equations, point: Point, matrix: Solver) -> Freedom:
        """
        Args:
            equations: in the layout of `matrix`.
        """
        odometry, robots = equations.problem.odometry, len(equations.problem.priors.scale)
        checked = guessed_misfit(equations, point, matrix).checked
        sums = np.bincount(odometry.robot, checked, robots)
        return Freedom(sums, np.bincount(odometry.robot, minlength=robots).astype(float))

    def is_fresh(self, problem: Problem) -> bool:
        """Have the robots not driven much further since?"""
        links = np.bincount(problem.odometry.robot, minlength=len(self.links))
        return bool((links <= GROWN * self.links).all())

    def ratio(self, problem: Problem, point: Point) -> Array:
        """(robots,) s / g now."""
        robot, robots = problem.odometry.robot, len(self.links)
        squares = np.bincount(robot, squares_of(problem, point), robots)
        links = np.bincount(robot, minlength=robots)
        return ratio_of(squares, self.checked * links / np.maximum(self.links, 1.0))


def misfit_as_modelled(
    problem: Problem, point: Point, checked: Freedom, variances: Array
) -> Array | None:
    """(robots,) s / g of odometry, see `misfit`; None where something may not be as modelled.

    Args:
        variances: of the mountings, see `mountings.variances`; they may be of some seconds ago.
    """
    if has_runs(problem, point):
        return None
    pull = mounting_pulls(problem, point)
    if mountings.scored(problem, pull, variances).ask():
        return None
    ratio = checked.ratio(problem, point)
    return ratio if (ratio <= SUSPICIOUS).all() else None


def has_runs(problem: Problem, point: Point) -> bool:
    """Is there any run of outliers (`misfit.runs`)?"""
    order, ends, count = _by_pair(problem)
    wrong = outliers(problem, point)
    if wrong[_last(order, ends[count >= RUN], RUN)].all(axis=1).any():
        return True
    sigmas = np.abs(point.sight.error) / problem.ranges.sigma
    last = np.minimum(sigmas[_last(order, ends[count >= LAST], LAST)], CLIPPED)
    return bool((np.mean(last**2, axis=1) > MOST_SCATTER).any())


def lately_wrong(problem: Problem, point: Point) -> NDArray[np.bool_]:
    """(pairs,) of whose ranges of late many do not fit, where no run does not (`misfit`)."""
    pair, n = problem.ranges.pair, problem.n[problem.ranges.i]
    newest = np.zeros(problem.pairs)
    np.maximum.at(newest, pair, n)
    lately = n > newest[pair] - LATELY
    count = np.bincount(pair[lately], minlength=problem.pairs)
    wrong = np.bincount(pair[lately & outliers(problem, point)], minlength=problem.pairs)
    return np.asarray((count >= FEWEST_LATELY) & (wrong >= MANY_WRONG * count))


def _by_pair(problem: Problem) -> tuple[Index, Index, Index]:
    """Ranges in the order of pairs and time, where each pair ends there, and how many it has."""
    ranges = problem.ranges
    order = np.lexsort((np.maximum(ranges.i, ranges.j), ranges.pair))
    count = np.bincount(ranges.pair, minlength=problem.pairs)
    return order, np.cumsum(count), count


def _last(order: Index, ends: Index, count: int) -> Index:
    """(k, count) the newest ranges of k pairs."""
    return np.asarray(order[ends[:, None] - 1 - np.arange(count)])
