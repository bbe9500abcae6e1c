"""What at a solution does not fit the model: links of odometry, and ranges.

Of a right model the weighed squares s of a stretch's errors come to g, its share of the degrees of
freedom: what the other measurements could check of it (Baarda, Foerstner).

    s = sum e' W e     g = sum (3 - tr W P)     P = J H^-1 J'

Ranges that are wrong lose their weight, so what contradicts odometry for long soon counts for
nothing. Therefore outliers are counted too, and the run of them that lasts until now.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.band_factor import BandFactor, Solver
from drslamd.slam.optimizer.banded.layout import NOWHERE
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array, Index

DOUBT = 1.0
"""Degrees of freedom that hold a ratio at 1: a robot has but two or three that ranges can check."""
PROBES = 6
"""Rows of random signs that estimate g of a whole robot to some percent."""
AT_ONCE = 1024
"""Links for which signs are drawn at once."""
FEW_OUTLIERS = 0.06
"""Of the ranges of any pair, when odometry alone was at fault; 0.08 to 0.21 where ranges were."""
OUTLIER_SIGMAS = 2.5
"""Of what a range was sent with: beyond it, it is an outlier."""
BY_CHANCE = 1e-3
"""Of ranges that are as modelled: what they are sent with is more than they scatter."""
NEVER = 100
"""Outliers of a pair that are none by chance; 100! is a number yet."""
HALF_A_PAIR = 0.5
"""Pairs of a team: when fewer than that are expected to have so many outliers by chance, a pair
that has them says something. One of ten ranges does among thirty pairs, not among a thousand."""
RUN = 4
"""Outliers of one pair that follow each other, at one a second; bursts are shorter."""
OF_RUN = 0.8
"""Share of the ranges since its beginning that are outliers."""

LAST = 10
"""Ranges of a pair that are held against their sigmas together: a solution that was bent until the
ranges fit leaves them scattering to both sides, without a run."""
MOST_SCATTER = 3.5
"""Mean square of these, in sigmas; as modelled it is 0.2 to 1.5, and a burst of three makes 3."""
CLIPPED = 3.0
"""Sigmas that count at most, so that a burst alone is no misfit."""
LATELY = 200
"""Steps of the keyframes' grid."""
MANY_WRONG = 0.4
"""Share of the ranges of late that are outliers; bursts take a tenth or two."""
FEWEST_LATELY = 8
"""Ranges, fewer are no share."""


@dataclass(frozen=True)
class Misfit:
    """
    Attributes:
        squares: (m,) s of each link of odometry.
        checked: (m,) g of each.
    """

    squares: Array
    checked: Array

    @staticmethod
    def unknown(links: int) -> Misfit:
        """Of a system that cannot be solved."""
        return Misfit(np.zeros(links), np.zeros(links))

    def ratio(self, group: Index, count: int) -> Array:
        """(count,) s / g of groups of links.

        Args:
            group: (m,) to which each link belongs.
        """
        s, g = (np.bincount(group, each, count) for each in (self.squares, self.checked))
        return ratio_of(s, g)


def ratio_of(s: Array, g: Array) -> Array:
    """(count,) s / g of groups, from their sums."""
    return np.asarray((s + DOUBT) / (np.maximum(g, 0.0) + DOUBT))


def misfit(equations: Equations, point: Point, factor: BandFactor) -> Misfit:
    """Computed exactly.

    Args:
        factor: of `Equations.weighed` at that point.
    """
    problem = equations.problem
    jacobian = linearised.odometry_jacobian(problem, point)
    squares, information = squares_of(problem, point), problem.odometry.information
    blocks = factor.covariance_blocks(equations.layout.odometry_unknowns(problem.odometry))
    if blocks is None:
        return Misfit(squares, np.zeros(len(squares)))
    covariance = jacobian @ blocks @ np.swapaxes(jacobian, 1, 2)
    return Misfit(squares, 3 - np.einsum("kij,kji->k", information, covariance))


def guessed_misfit(equations: Equations, point: Point, factor: Solver) -> Misfit:
    """Several times faster, and good for sums over many links (Hutchinson's estimate).

    The signs are the same for everybody who has the same problem.
    """
    problem, layout = equations.problem, equations.layout
    jacobian = linearised.odometry_jacobian(problem, point)
    squares, information = squares_of(problem, point), problem.odometry.information
    signs = _signs(-(-len(jacobian) // AT_ONCE), PROBES)[: len(jacobian)]
    jacobian = np.ascontiguousarray(jacobian)
    whitened = np.swapaxes(np.linalg.cholesky(information), 1, 2) @ jacobian
    unknowns = layout.odometry_unknowns(problem.odometry)
    whitened = np.where((unknowns == NOWHERE)[:, None], 0.0, whitened)
    unknowns = np.maximum(unknowns, 0)
    each = (np.swapaxes(whitened, 1, 2) @ signs).reshape(-1, PROBES)
    size = layout.band + layout.border
    sums = np.stack([np.bincount(unknowns.ravel(), row, size) for row in each.T], axis=-1)
    spread = factor.solved(sums)
    if spread is None:
        return Misfit(squares, np.zeros(len(squares)))
    seen: Array = signs * (whitened @ spread[unknowns])
    return Misfit(squares, 3 - seen.sum(axis=(1, 2)) / PROBES)


@lru_cache(maxsize=2)
def _signs(blocks: int, probes: int) -> Array:
    """(AT_ONCE blocks, 3, probes) 1 or -1, the first of which do not depend on how many follow."""
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (blocks * AT_ONCE, 3, probes))
    signs.flags.writeable = False
    return signs


def squares_of(problem: Problem, point: Point) -> Array:
    """(m,) e' W e of each link."""
    return problem.odometry.squares(point.link)


def squares_of_ranges(problem: Problem, point: Point) -> Array:
    """(pairs,) e' W e of the ranges of each, as far as they are believed."""
    ranges, error = problem.ranges, point.sight.error
    cut = point.threshold[ranges.pair] * ranges.sigma
    squares = problem.weight * error**2 / (1 + (error / cut) ** 2)
    return np.bincount(ranges.pair, squares, problem.pairs)


def sigmas_off(problem: Problem, point: Point) -> Array:
    """(n,) how far ranges are off the solution; too long ones of blocked sight are not."""
    off = point.sight.error / problem.ranges.sigma
    if problem.blocked is None:
        return np.abs(off)
    return np.where(problem.blocked[problem.ranges.pair], np.maximum(off, 0.0), np.abs(off))


def outliers(problem: Problem, point: Point) -> NDArray[np.bool_]:
    """(n,) which of the ranges are far off the solution."""
    return np.asarray(sigmas_off(problem, point) > OUTLIER_SIGMAS)


def outlier_share(problem: Problem, point: Point) -> Array:
    """(pairs,) of the ranges of each pair; none of no ranges, nor where it may be by chance."""
    wrong, pair = outliers(problem, point), problem.ranges.pair
    count, several = (np.bincount(pair, of, problem.pairs) for of in (None, wrong))
    expected = problem.pairs * _chance(count * BY_CHANCE, several.astype(int))
    return np.where(expected < HALF_A_PAIR, share(problem, wrong), 0.0)


def _chance(mean: Array, count: Index) -> Array:
    """Of so many or more of what is as rare as that (Poisson's first term)."""
    count = np.minimum(count, NEVER)
    factorials = np.cumprod(np.maximum(np.arange(1.0 + NEVER), 1.0))
    return np.asarray(mean**count / factorials[count])


def many_wrong(problem: Problem, point: Point) -> bool:
    """Are many ranges of any pair outliers, and some of them for longer than bursts last?"""
    wrong = outliers(problem, point)
    many = share(problem, wrong) >= FEW_OUTLIERS
    if not many.any():
        return False
    pair, is_wrong, count = in_a_row(problem, wrong)
    return bool((many[pair] & is_wrong & (count >= RUN)).any())


def in_a_row(problem: Problem, which: NDArray[np.bool_]) -> tuple[Index, NDArray[np.bool_], Index]:
    """(k,) of which pair each stretch of ranges is that are alike, are they among those (n,), and
    how many there are; pair by pair in the order of time."""
    ranges = problem.ranges
    order = np.lexsort((np.maximum(ranges.i, ranges.j), ranges.pair))
    pair, flagged = ranges.pair[order], which[order]
    begins = np.flatnonzero(np.diff(2 * pair + flagged, prepend=-1))
    return pair[begins], flagged[begins], np.diff(begins, append=len(order))


def share(problem: Problem, which: NDArray[np.bool_]) -> Array:
    """(pairs,) how many of the ranges of each pair are among those (n,); none of no ranges."""
    pair = problem.ranges.pair
    count = np.bincount(pair, minlength=problem.pairs)
    return np.bincount(pair, which, problem.pairs) / np.maximum(count, 1)


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


def contradicted(problem: Problem, point: Point) -> NDArray[np.bool_]:
    """(pairs,) whose ranges of late do not fit the solution: an unbroken run of them, or many."""
    found = lately_wrong(problem, point)
    robots = np.unique(problem.robot_id)
    ends = problem.robot_id[np.stack([problem.ranges.i, problem.ranges.j])]
    for run in runs(problem, point):
        between = np.isin(ends, robots[[run.i, run.j]]).all(axis=0)
        found[problem.ranges.pair[between]] = True
    return found


def lately_wrong(problem: Problem, point: Point) -> NDArray[np.bool_]:
    """(pairs,) of whose ranges of late many do not fit."""
    pair, n = problem.ranges.pair, problem.n[problem.ranges.i]
    newest = np.zeros(problem.pairs)
    np.maximum.at(newest, pair, n)
    lately = n > newest[pair] - LATELY
    count = np.bincount(pair[lately], minlength=problem.pairs)
    wrong = np.bincount(pair[lately & outliers(problem, point)], minlength=problem.pairs)
    return np.asarray((count >= FEWEST_LATELY) & (wrong >= MANY_WRONG * count))


def runs(problem: Problem, point: Point) -> list[Run]:
    """Of all pairs that have one."""
    ranges = problem.ranges
    named = with_runs(problem, point).tolist()
    if not named:
        return []
    order = np.argsort(np.maximum(ranges.i, ranges.j), kind="stable")
    wrong = outliers(problem, point)
    sigmas = sigmas_off(problem, point)
    robots = np.unique(problem.robot_id)
    found = []
    for pair in named:
        mine = order[ranges.pair[order] == pair][::-1]
        count = _run_length(wrong[mine]) or _scattered(sigmas[mine])
        first = mine[count - 1]
        ends = np.array([ranges.i[first], ranges.j[first]])
        ends = ends[np.argsort(problem.robot_id[ends])]
        (i, j), (n_i, n_j) = np.searchsorted(robots, problem.robot_id[ends]), problem.n[ends]
        found.append(Run(int(i), int(j), int(n_i), int(n_j), count))
    return found


def with_runs(problem: Problem, point: Point) -> Index:
    """The pairs that have a run of outliers, in their order: all of them seen at once, because
    most often there is none."""
    ranges = problem.ranges
    # in the order of pairs and time
    order = np.lexsort((np.maximum(ranges.i, ranges.j), ranges.pair))
    count = np.bincount(ranges.pair, minlength=problem.pairs)
    ends = np.cumsum(count)
    found = np.zeros(problem.pairs, dtype=bool)
    many = np.flatnonzero(count >= RUN)
    found[many] = outliers(problem, point)[_last(order, ends[many], RUN)].all(axis=1)
    many = np.flatnonzero(count >= LAST)
    sigmas = sigmas_off(problem, point)
    last = np.minimum(sigmas[_last(order, ends[many], LAST)], CLIPPED)
    found[many] |= np.mean(last**2, axis=1) > MOST_SCATTER
    return np.flatnonzero(found)


def _last(order: Index, ends: Index, count: int) -> Index:
    """(k, count) the newest ranges of k pairs that end there."""
    return np.asarray(order[ends[:, None] - 1 - np.arange(count)])


def _run_length(wrong: NDArray[np.bool_]) -> int:
    """From a last range that is wrong, as far back as most of them are; the newest comes first."""
    share = np.cumsum(wrong) / (np.arange(len(wrong)) + 1)
    good = np.flatnonzero(wrong & (share >= OF_RUN))
    count = int(good[-1]) + 1 if len(good) else 0
    return count if count >= RUN and wrong[:RUN].all() else 0


def _scattered(sigmas: Array) -> int:
    """As far back as the oldest outlier of the last ranges, or all of them, if they scatter."""
    last = np.minimum(sigmas[:LAST], CLIPPED)
    if not (len(last) == LAST and np.mean(last**2) > MOST_SCATTER):
        return 0
    wrong = np.flatnonzero(last > OUTLIER_SIGMAS)
    return int(wrong[-1]) + 1 if len(wrong) else LAST
