"""What at a solution does not fit the model: links of odometry, and ranges.

Of a right model the weighed squares s of a stretch's errors come to g, its share of the degrees of
freedom: what the other measurements could check of it (Baarda, Foerstner).

    s = sum e' W e     g = sum (3 - tr W P)     P = J H^-1 J'

Ranges that are wrong lose their weight, so what contradicts odometry for long soon counts for
nothing. Therefore outliers are counted too, and the run of them that lasts until now.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.newton_descent import Point
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.problem import Problem, corrected, pose_errors, range_errors
from drslamd.slam.se2 import Array, Index

DOUBT = 1.0
"""Degrees of freedom that hold a ratio at 1: a robot has but two or three that ranges can check."""
PROBES = 6
"""Rows of random signs that estimate g of a whole robot to some percent."""
OUTLIER_SIGMAS = 2.5
"""Of what a range was sent with: beyond it, it is an outlier."""
RUN = 4
"""Outliers of one pair that follow each other, at one a second; bursts are shorter."""
OF_RUN = 0.8
"""Share of the ranges since its beginning that are outliers."""


@dataclass(frozen=True)
class Misfit:
    """
    Attributes:
        squares: (m,) s of each link of odometry.
        checked: (m,) g of each.
    """

    squares: Array
    checked: Array

    def ratio(self, group: Index, count: int) -> Array:
        """(count,) s / g of groups of links.

        Args:
            group: (m,) to which each link belongs.
        """
        s, g = (np.bincount(group, each, count) for each in (self.squares, self.checked))
        return np.asarray((s + DOUBT) / (np.maximum(g, 0.0) + DOUBT))


def misfit(equations: Equations, point: Point) -> Misfit:
    """Computed exactly; where nothing holds the poses, nothing was checked."""
    factor, jacobian = _weighed(equations, point)
    squares, information = _squares(equations.problem, point)
    unknowns = equations.layout.odometry_unknowns(equations.problem.odometry)
    blocks = None if factor is None else factor.covariance_blocks(unknowns)
    if blocks is None:
        return Misfit(squares, np.zeros(len(squares)))
    covariance = jacobian @ blocks @ np.swapaxes(jacobian, 1, 2)
    return Misfit(squares, 3 - np.einsum("kij,kji->k", information, covariance))


def guessed_misfit(equations: Equations, point: Point) -> Misfit:
    """Several times faster, and good for sums over many links (Hutchinson's estimate).

    The signs are the same for everybody who has the same problem.
    """
    factor, jacobian = _weighed(equations, point)
    squares, information = _squares(equations.problem, point)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(jacobian), 3, PROBES))
    whitened = np.swapaxes(np.linalg.cholesky(information), 1, 2) @ jacobian
    unknowns = equations.layout.odometry_unknowns(equations.problem.odometry)
    each = (np.swapaxes(whitened, 1, 2) @ signs).reshape(-1, PROBES)
    size = equations.layout.band + equations.layout.border
    sums = np.stack([np.bincount(unknowns.ravel(), row, size) for row in each.T], axis=-1)
    spread = None if factor is None else factor.solved(sums)
    if spread is None:
        return Misfit(squares, np.zeros(len(squares)))
    seen: Array = signs * (whitened @ spread[unknowns])
    return Misfit(squares, 3 - seen.sum(axis=(1, 2)) / PROBES)


def _weighed(equations: Equations, point: Point) -> tuple[BandFactor | None, Array]:
    system = equations.weighed(point.poses, point.calibration, point.threshold)
    return BandFactor.of(system), linearised.odometry_jacobian(equations.problem, point.poses)


def _squares(problem: Problem, point: Point) -> tuple[Array, Array]:
    """e' W e (m,) and W (m, 3, 3)."""
    odometry = problem.odometry
    error = pose_errors(point.poses, odometry, corrected(odometry, point.calibration))
    information = odometry.information
    squares: Array = np.einsum("ki,kij,kj->k", error, information, error)
    return squares, information


def outliers(problem: Problem, point: Point) -> NDArray[np.bool_]:
    """(n,) which of the ranges are far off the solution."""
    ranges = problem.ranges
    errors = range_errors(point.poses, ranges, point.calibration, problem.model)[0]
    return np.asarray(np.abs(errors) > OUTLIER_SIGMAS * ranges.sigma)


def outlier_share(problem: Problem, point: Point) -> Array:
    """(pairs,) of the ranges of each pair; none of no ranges."""
    pair = problem.ranges.pair
    count = np.bincount(pair, minlength=problem.pairs)
    return np.bincount(pair, outliers(problem, point), problem.pairs) / np.maximum(count, 1)


@dataclass(frozen=True)
class Run:
    """Outliers of one pair that last until now.

    Attributes:
        i, j: robots, as the problem numbers them; i < j.
        n_i, n_j: their keyframes at the first of them, each on the clock of its robot.
        count: of ranges.
    """

    i: int
    j: int
    n_i: int
    n_j: int
    count: int


def runs(problem: Problem, point: Point) -> list[Run]:
    """Of all pairs that have one."""
    ranges = problem.ranges
    order = np.argsort(np.maximum(ranges.i, ranges.j), kind="stable")
    wrong = outliers(problem, point)
    robots = np.unique(problem.robot)
    found = []
    for pair in range(problem.pairs):
        mine = order[ranges.pair[order] == pair][::-1]
        share = np.cumsum(wrong[mine]) / (np.arange(len(mine)) + 1)
        # from a last range that is wrong, as far back as most of them are
        good = np.flatnonzero(wrong[mine] & (share >= OF_RUN))
        count = int(good[-1]) + 1 if len(good) else 0
        if count < RUN or not wrong[mine[:RUN]].all():
            continue
        first = mine[count - 1]
        ends = np.array([ranges.i[first], ranges.j[first]])
        ends = ends[np.argsort(problem.robot[ends])]
        (i, j), (n_i, n_j) = np.searchsorted(robots, problem.robot[ends]), problem.n[ends]
        found.append(Run(int(i), int(j), int(n_i), int(n_j), count))
    return found
