"""Module 3 of a team that is solved already and has driven on for a second.

What came of the solution before is used as far as it goes; the solution is that of
`banded_solver.solve`, which is asked whenever something is not as usual: poses that nobody has
solved yet, a matrix that does not lead there, or a model that is not one of what was measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drslamd.slam import se2
from drslamd.slam.calibration.range_scatter import LEAST_SCATTER
from drslamd.slam.optimizer.banded import banded_solver, claims, mountings
from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem
from drslamd.slam.optimizer.banded.misfit import lately_wrong
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.odometry_levels import raised
from drslamd.slam.optimizer.banded.pairs import narrowing
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.solution import Solution
from drslamd.slam.optimizer.kept import kept_claims, kept_factor, quick_check
from drslamd.slam.optimizer.kept.fixed_point import MOST, approach
from drslamd.slam.optimizer.kept.head import LONG_TAIL, Pair, tail_of
from drslamd.slam.optimizer.kept.kept_factor import (
    Believed,
    Current,
    KeptFactor,
)
from drslamd.slam.optimizer.kept.quick_check import Freedom
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array

MOVED = 0.12
"""Of log variance: what is claimed of the head holds as long as what is feared of each robot moved
less, and half of it for pairs in the mean. A sigma goes with the fourth root, so it is off by 3 %
at most; what is feared of a whole robot is a guess that scatters by some percent itself."""

GROWN = 1.1
"""Times as many links as when shares of pairs were found."""

FEW = 400
"""Poses: a smaller problem is solved anew in the time of what is done beside a kept factor."""

MANY, PATIENT = 4000, 36
"""Poses: to solve a larger problem anew takes ten times as long as to try a kept factor, and a new
factor as long as a hundred steps. So that is tried though the team turns, and for so many steps."""

FAR = 0.1
"""m and rad. By the matrix of a start 2.5 m away the score of one antenna came out as 39 where it
was 3.9: what is known of it is the difference of large numbers. To solve a large team anew for that
takes several times as long as to make another matrix."""


@dataclass(frozen=True)
class Sureness:
    """How far measurements are believed when something is claimed.

    Attributes:
        pairs: (pairs,) how many times the sent sigma the ranges of each are as wrong by.
        names: of these; feared: (robots,) variance of odometry over the configured one.
    """

    pairs: Array
    names: list[Pair]
    feared: Array

    @staticmethod
    def of(team: TeamProblem, scatter: Array, feared: Array) -> Sureness:
        ratio = team.problem.model.correlated_ratio(1.0)
        return Sureness(ratio * np.maximum(scatter, LEAST_SCATTER), team.pairs, feared)

    def believed(self, problem: Problem, point: Point) -> Believed:
        """A problem so far believed."""
        return Believed(
            raised(problem, self.feared[problem.odometry.robot], point), point, self.pairs
        )

    def has_moved(self, before: Sureness) -> bool:
        """Is it another one than before, of pairs and robots that were there?"""
        then = dict(zip(before.names, before.pairs.tolist(), strict=True))
        now = dict(zip(self.names, self.pairs.tolist(), strict=True))
        ratios = np.array([now[name] / then[name] for name in now if name in then])
        robots = self.feared / before.feared
        return bool(
            np.abs(np.log(ratios)).mean() > MOVED / 2 or np.abs(np.log(robots)).max() > MOVED
        )


@dataclass(frozen=True)
class KeptShares:
    """What is left of the covariances of pairs (`banded.pairs.narrowing`), some seconds ago. It
    moves slowly, and to find it takes longer than a second that is kept.

    Attributes:
        robots: of whose last poses; links: of odometry, so many.
        left: (k, k), or of none.
        is_turning: did the team turn as a whole of late? A kept factor is one of how it stood, so
            it is solved anew until it does not.
    """

    robots: tuple[int, ...]
    links: int
    left: Array
    is_turning: bool = False

    @staticmethod
    def of(team: TeamProblem, last: tuple[int, ...], left: Array) -> KeptShares:
        """Of the poses `last`, one of each robot."""
        robots = tuple(team.problem.robot[list(last)].tolist())
        return KeptShares(robots, len(team.problem.odometry), left)

    def hold(self, now: KeptShares) -> bool:
        """Are they those of the same robots, which have not driven much further since?"""
        return self.robots == now.robots and now.links <= GROWN * self.links


@dataclass(frozen=True)
class Kept:
    """What the next solution begins with.

    Attributes:
        downwards: of the system that leads to the solution; claimed: of what may be claimed there.
        sure: when that was made.
        variances: of the mountings, see `mountings.variances`, of when `downwards` was made.
        checked: of odometry, made anew as the way grows.
        shares: of pairs, likewise.
    """

    downwards: KeptFactor
    claimed: KeptFactor
    sure: Sureness
    variances: Array
    checked: Freedom
    shares: KeptShares


def solve(
    team: TeamProblem, last: tuple[int, ...], tolerance: float, kept: object = None
) -> tuple[Solution, object]:
    """The solution, and what the next one may begin with.

    Args:
        last: poses whose joint covariance is wanted, each the newest of its robot.
        tolerance: see `newton_descent.TOLERANCE`.
        kept: what came of the solution before.
    """
    is_turning = isinstance(kept, KeptShares) and kept.is_turning
    if team.is_near and len(team.problem.n) >= (MANY if is_turning else FEW):
        for before in (kept, None) if isinstance(kept, Kept) else (None,):
            found = _solved(team, last, tolerance, before)
            if found is not None:
                return found
    shares = kept.shares if isinstance(kept, Kept) else kept
    known = shares if isinstance(shares, KeptShares) and shares.hold(_none(team, last)) else None
    left = known.left if known else None
    solution = banded_solver.solve(team.problem, team.start, last, tolerance=tolerance, known=left)
    after = known or KeptShares.of(team, last, solution.shares)
    return solution, replace(after, is_turning=solution.is_turning)


def _none(team: TeamProblem, last: tuple[int, ...]) -> KeptShares:
    """Nothing is known of them."""
    return KeptShares.of(team, last, np.ones((0, 0)))


def _solved(
    team: TeamProblem, last: tuple[int, ...], tolerance: float, kept: Kept | None
) -> tuple[Solution, Kept] | None:
    problem, pairs = team.problem, team.pairs
    start = Point.of(problem, problem.initial.copy(), team.start)
    current = _matrix(kept.downwards if kept else None, Believed(problem, start), pairs)
    if current is None:
        return None
    equations = Equations(problem, layout=current.places.flat)
    most = MOST if len(problem.n) < MANY else PATIENT
    point = approach(equations, start, current, tolerance, most)
    if point is None:
        return None
    asked = _as_modelled(equations, point, current, kept)
    if kept is None and len(problem.n) >= MANY and (asked is None or _is_far(start, point)):
        del current
        current = _matrix(None, Believed(problem, point), pairs)
        asked = _as_modelled(equations, point, current, None) if current else None
    if asked is None or current is None:
        return None
    variances, checked, ratio = asked
    scatter = claims.scatter_of(problem, point)
    sure = Sureness.of(team, scatter, np.maximum(ratio, 1.0))
    believed = sure.believed(problem, point)
    known = kept.claimed if kept and not sure.has_moved(kept.sure) else None
    claimed = _matrix(known, believed, pairs, with_blocks=False)
    if claimed is None:
        return None
    joint = kept_claims.kept_covariance(claimed, np.array(last, dtype=int))
    spread = kept_claims.kept_spread(problem, point, claimed)
    downwards = _grown(current, Believed(problem, point))
    held = _grown(claimed, believed)
    if joint is None or spread is None or downwards is None or held is None:
        return None
    since = kept.sure if kept and known else sure
    solved = JustSolved(equations, point, current, ratio, joint, spread[1])
    shares = _shares(team, last, kept, solved)
    after = Kept(downwards, held, since, variances, checked, shares)
    said = _said(equations, point, scatter, sure.feared, joint, *spread)
    return replace(said, shares=shares.left), after


def _is_far(start: Point, point: Point) -> bool:
    """Is a matrix of the start no longer one of the solution, where differences of large numbers
    are asked of it?"""
    return bool(np.abs(point.poses - start.poses).max() > FAR)


class AsModelled(NamedTuple):
    """What says that all is as modelled.

    Attributes:
        variances: see `mountings.variances`; ratio: (robots,) s / g of odometry.
    """

    variances: Array
    checked: Freedom
    ratio: Array


def _as_modelled(
    equations: Equations, point: Point, matrix: Current, kept: Kept | None
) -> AsModelled | None:
    """None where something may not be as modelled.

    Args:
        matrix: that led to the point.
    """
    problem = equations.problem
    variances = kept.variances if kept else mountings.variances(equations, point, matrix)
    if variances is None:
        return None
    is_fresh = kept is not None and kept.checked.is_fresh(problem)
    checked = kept.checked if kept and is_fresh else Freedom.of(equations, point, matrix)
    ratio = quick_check.misfit_as_modelled(problem, point, checked, variances)
    return None if ratio is None else AsModelled(variances, checked, ratio)


class JustSolved(NamedTuple):
    """A solution.

    Attributes:
        matrix: that led there; ratio: (robots,) s / g of odometry.
        joint: (3 k, 3 k) covariance of the poses that are wanted, as it is claimed.
        biases: (pairs,) how wrong they may be, m.
    """

    equations: Equations
    point: Point
    matrix: Current
    ratio: Array
    joint: Array
    biases: Array


def _shares(
    team: TeamProblem, last: tuple[int, ...], kept: Kept | None, seen: JustSolved
) -> KeptShares:
    """See `Solution.shares`."""
    problem, point = team.problem, seen.point
    nothing = _none(team, last)
    if kept is not None and kept.shares.hold(nothing):
        return kept.shares
    if not narrowing.may_narrow(problem, len(last)):
        return nothing
    noise = narrowing.seen_noise(seen.equations, point, seen.matrix, seen.ratio, seen.biases)
    if noise is None:
        return nothing
    sure = Sureness.of(team, noise.scatter, noise.feared)
    believed = sure.believed(noise.of_biases(problem), point)
    claimed = _matrix(None, believed, team.pairs, with_blocks=False)
    wanted = np.array(last, dtype=int)
    joint = None if claimed is None else kept_claims.kept_covariance(claimed, wanted)
    if joint is None:
        return nothing
    return replace(nothing, left=narrowing.shares(point.poses[wanted], seen.joint, joint))


def _matrix(
    kept: KeptFactor | None, believed: Believed, pairs: list[Pair], with_blocks: bool = True
) -> Current | None:
    """A kept factor, or a new one, with the tail of a problem on top; None if it does not fit."""
    problem = believed.problem
    if kept is None:
        kept = kept_factor.build(believed, pairs, tail_of(problem), with_blocks)
    places = kept.head.places(problem, pairs) if kept else None
    if kept is None or places is None or places.is_late(problem):
        return None
    return kept.on_top(believed, places)


def _grown(current: Current, believed: Believed) -> KeptFactor | None:
    """The same for the next second: a tail that is long goes to the head."""
    tail, robots = len(current.places.tail), len(believed.problem.priors.scale)
    if tail <= LONG_TAIL * robots:
        return current.kept
    return current.kept.grown(believed, current.places)


def _said(
    equations: Equations,
    point: Point,
    scatter: Array,
    feared: Array,
    joint: Array,
    spread: Calibration,
    biases: Array,
) -> Solution:
    """What `banded_solver.solve` says where all is as modelled."""
    problem = equations.problem
    poses: Array = point.poses.copy()
    poses[:, 2] = se2.wrap(poses[:, 2])
    level = np.sqrt(feared)[problem.odometry.robot]
    return Solution(
        poses,
        point.calibration,
        cost=equations.cost(point, point.threshold),
        iterations=point.steps,
        converged=point.converged,
        scatter=scatter,
        joint=joint,
        spread=spread,
        bias_sigmas=biases,
        odometry_level=np.ones(len(level)),
        feared_level=level,
        late_level=level,
        contradicted=lately_wrong(problem, point),
        doubted=claims.still_doubted(problem.doubted, point.calibration, spread),
        freed=problem.freed,
    )
