"""Module 3 of a team that is solved already and has driven on for a second.

What came of the solution before is used as far as it goes; the solution is that of
`banded_solver.solve`, which is asked whenever something is not as usual: poses that nobody has
solved yet, a matrix that does not lead there, or a model that is not one of what was measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drslamd.slam import se2
from drslamd.slam.optimizer.banded import banded_solver, claims, mountings
from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem
from drslamd.slam.optimizer.banded.lapses import lapse_search
from drslamd.slam.optimizer.banded.misfit import lately_wrong
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.pairs import narrowing
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.solution import Solution
from drslamd.slam.optimizer.kept import kept_claims, kept_factor, quick_check
from drslamd.slam.optimizer.kept.believed import Believed
from drslamd.slam.optimizer.kept.fixed_point import MOST, approach
from drslamd.slam.optimizer.kept.head import LONG_TAIL, Pair, Places, tail_of
from drslamd.slam.optimizer.kept.kept_claims import KeptSpread
from drslamd.slam.optimizer.kept.kept_factor import Current, KeptFactor
from drslamd.slam.optimizer.kept.kept_solution import Kept, KeptShares, Sureness
from drslamd.slam.optimizer.kept.quick_check import Freedom
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array, Index

FEW = 400
"""Poses: a smaller problem is solved anew in the time of what is done beside a kept factor."""

MANY, PATIENT = 100, 36
"""Pairs that have met, as of fifteen robots: each is a column of the border, so a new factor takes
as long as a hundred steps, and memory. So there is one for all that it is needed for, and so many
steps may be made by it."""

TURNED = 0.05
"""rad: by so much of a turn sigmas of places, which lie along it, are 2 % off."""


def solve(
    team: TeamProblem, last: tuple[int, ...], tolerance: float, kept: object = None
) -> tuple[Solution, object]:
    """The solution, and what the next one may begin with.

    Args:
        last: poses whose joint covariance is wanted, each the newest of its robot.
        tolerance: see `newton_descent.TOLERANCE`.
        kept: what came of the solution before.
    """
    is_kept = len(team.problem.n) >= FEW and not lapse_search.is_asked_for(team.problem)
    if team.is_near and is_kept:
        for before in (kept, None) if isinstance(kept, Kept) else (None,):
            found = _solved(team, last, tolerance, before)
            if found is not None:
                return found
    shares = kept.shares if isinstance(kept, Kept) else kept
    now = KeptShares.none(team, last)
    known = shares if isinstance(shares, KeptShares) and shares.hold(now) else None
    left = known.left if known else None
    solution = banded_solver.solve(team.problem, team.start, last, tolerance=tolerance, known=left)
    return solution, known or KeptShares.of(team, last, solution.shares)


def _solved(
    team: TeamProblem, last: tuple[int, ...], tolerance: float, kept: Kept | None
) -> tuple[Solution, Kept] | None:
    problem, pairs = team.problem, team.pairs
    start = Point.of(problem, problem.initial.copy(), team.start)
    is_large = problem.pairs >= MANY
    before = kept.downwards if kept else None
    current = _matrix(before, Believed(problem, start), pairs, is_curved=not is_large)
    if current is None:
        return None
    equations = Equations(problem, layout=current.places.flat)
    point = approach(equations, start, current, tolerance, PATIENT if is_large else MOST)
    if point is None:
        return None
    reached = Reached(team, equations, point, current)
    asked = _as_modelled(reached, kept)
    if asked is None:
        return None
    variances, checked, ratio = asked
    scatter = claims.scatter_of(problem, point)
    sure = Sureness.of(team, scatter, np.maximum(ratio, 1.0))
    believed = sure.believed(problem, point)
    wanted = np.array(last, dtype=int)
    known = kept.claimed if kept and not sure.has_moved(kept.sure) else None
    claimed = _claimed(known, believed, pairs, wanted)
    if claimed is None:
        return None
    since = kept.sure if kept and claimed.kept is known else sure
    joint = kept_claims.kept_covariance(claimed, point, wanted)
    spread = _spread(kept, problem, point, claimed)
    downwards = _grown(current, Believed(problem, point))
    held = _grown(claimed, believed)
    if joint is None or spread is None or downwards is None or held is None:
        return None
    learned, biases = spread.told(problem, point, claimed)
    shares = _shares(reached, last, kept, Claimed(ratio, joint, biases))
    after = Kept(downwards, held, since, spread, variances, checked, shares)
    said = _said(equations, point, scatter, sure.feared, joint, learned, biases)
    return replace(said, shares=shares.left), after


@dataclass(frozen=True)
class Reached:
    """A solution.

    Attributes:
        current: the matrix that led there.
    """

    team: TeamProblem
    equations: Equations
    point: Point
    current: Current

    @cached_property
    def weighed(self) -> tuple[Current, Point] | None:
        """The matrix that questions are asked of, and where it was made: what little holds shall
        be as little in what is asked, or differences of large numbers are hundreds of times too
        large. The one that leads to the solution knows how heavy tails bend, so it is another;
        only of a large team, of which a factor takes long to make, it is the same."""
        problem, point = self.team.problem, self.point
        if problem.pairs >= MANY:
            return self.current, Point.of(problem, self.current.poses, point.calibration)
        found = _matrix(None, Believed(problem, point), self.team.pairs)
        return None if found is None else (found, point)


class AsModelled(NamedTuple):
    """What says that all is as modelled.

    Attributes:
        variances: see `mountings.variances`; ratio: (robots,) s / g of odometry.
    """

    variances: Array
    checked: Freedom
    ratio: Array


def _as_modelled(reached: Reached, kept: Kept | None) -> AsModelled | None:
    """None where something may not be as modelled."""
    problem = reached.team.problem
    if kept and kept.downwards.head.is_mounted_as(problem) and kept.checked.is_fresh(problem):
        variances, checked = kept.variances, kept.checked
    else:
        if reached.weighed is None:
            return None
        matrix, there = reached.weighed
        found = mountings.variances(reached.equations, there, matrix)
        if found is None:
            return None
        variances, checked = found, Freedom.of(reached.equations, there, matrix)
    ratio = quick_check.misfit_as_modelled(problem, reached.point, checked, variances)
    return None if ratio is None else AsModelled(variances, checked, ratio)


class Claimed(NamedTuple):
    """Of a solution.

    Attributes:
        ratio: (robots,) s / g of odometry.
        joint: (3 k, 3 k) covariance of the poses that are wanted.
        biases: (pairs,) how wrong they may be, m.
    """

    ratio: Array
    joint: Array
    biases: Array


def _shares(
    reached: Reached, last: tuple[int, ...], kept: Kept | None, seen: Claimed
) -> KeptShares:
    """See `Solution.shares`."""
    team, point = reached.team, reached.point
    nothing = KeptShares.none(team, last)
    if kept is not None and kept.shares.hold(nothing):
        return kept.shares
    if not narrowing.may_narrow(team.problem, len(last)) or reached.weighed is None:
        return nothing
    matrix, there = reached.weighed
    noise = narrowing.seen_noise(
        reached.equations, point, matrix, seen.ratio, seen.biases, made_at=there
    )
    if noise is None:
        return nothing
    sure = Sureness.of(team, noise.scatter, noise.feared)
    believed = sure.believed(noise.of_biases(team.problem), point)
    claimed = _matrix(None, believed, team.pairs, with_blocks=False)
    wanted = np.array(last, dtype=int)
    joint = None if claimed is None else kept_claims.kept_covariance(claimed, point, wanted)
    if joint is None:
        return nothing
    return replace(nothing, left=narrowing.shares(point.poses[wanted], seen.joint, joint))


def _matrix(
    kept: KeptFactor | None,
    believed: Believed,
    pairs: list[Pair],
    with_blocks: bool = True,
    is_curved: bool = False,
) -> Current | None:
    """A kept factor, or a new one if there is none or it does not fit, with the tail of a problem
    on top."""
    places = _places(kept, believed.problem, pairs)
    if kept and places:
        return kept.on_top(believed, places)
    # (far from a solution the whole second derivative may be no valley)
    for whole in (True, False) if is_curved else (False,):
        tail = tail_of(believed.problem)
        kept = kept_factor.build(believed, pairs, tail, with_blocks, whole)
        places = _places(kept, believed.problem, pairs)
        found = kept.on_top(believed, places) if kept and places else None
        if found:
            return found
    return None


def _claimed(
    kept: KeptFactor | None, believed: Believed, pairs: list[Pair], newest: Index
) -> Current | None:
    """A kept factor of what may be claimed, if the team is hardly turned since, or a new one."""
    found = _matrix(kept, believed, pairs, with_blocks=False)
    if found and abs(kept_claims.turn_since(found, believed.point, newest)) > TURNED:
        return _matrix(None, believed, pairs, with_blocks=False)
    return found


def _spread(
    kept: Kept | None, problem: Problem, point: Point, claimed: Current
) -> KeptSpread | None:
    """What is told of what was learned, found anew where the border is."""
    if kept and kept.spread.border is claimed.border:
        return kept.spread
    return KeptSpread.of(problem, point, claimed)


def _places(kept: KeptFactor | None, problem: Problem, pairs: list[Pair]) -> Places | None:
    """None where a factor does not fit a problem."""
    places = kept.head.places(problem, pairs) if kept else None
    return None if places is None or places.is_late(problem) else places


def _grown(current: Current, believed: Believed) -> KeptFactor | None:
    """The same for the next second: a tail that is long goes to the head."""
    kept, tail = current.kept, len(current.places.tail)
    if tail <= LONG_TAIL * len(believed.problem.priors.scale):
        return replace(kept, border=current.border)
    grown = kept.grown(believed, current.places)
    return None if grown is None else replace(grown, border=current.border)


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
