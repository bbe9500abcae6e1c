"""Is the model one of what was measured, and if not, what is?

A solution as configured is asked three questions: does odometry fit, do ranges fit now, does some
track or antenna ask to be another one? Most often all is well. Else a wall between two whom others
see is tried (`sight`), then odometry that was worse all along (`common_level`), then wheels that
stood or spun (`lapses`), then mountings (`mountings`), which explain a fault for good and must
explain more than such odometry, then sight that was blocked for a while, and then odometry that was
worse for a while (`odometry_levels`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drslamd.slam.optimizer.banded import common_level, mountings, odometry_levels
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.common_level import ASKS, TAILS, CommonLevel, pooled
from drslamd.slam.optimizer.banded.lapses import lapse_search
from drslamd.slam.optimizer.banded.lapses.known_lapses import freed_lately, settled
from drslamd.slam.optimizer.banded.misfit import (
    FEW_OUTLIERS,
    Run,
    guessed_misfit,
    many_wrong,
    misfit,
    outlier_share,
    runs,
)
from drslamd.slam.optimizer.banded.mountings import Scores
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.odometry_levels import STANDS_OUT, TARGET
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.sight import hidden_search
from drslamd.slam.optimizer.banded.sight.hidden import has_passed, has_witnesses
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array

SUSPICIOUS = 3.0
"""Guessed s / g above which it is computed."""
MANY_OUTLIERS = 2 * FEW_OUTLIERS
"""Of the ranges of any pair: slip has half of that at first, so it is not what leaves more."""
NOT_WHEELS = 5
"""Ranges of a pair, one a second, since all was as modelled: wheels that stood or spun are found
sooner, and until they are, ranges of theirs may all seem too long."""
WITNESSED = 3
"""Pairs: of the two that a wall hides from each other, and of each with a third who sees both."""
MUCH = 100.0
"""Of cost: a mounting that takes away so much is right, though something else is wrong as well."""


@dataclass(frozen=True)
class Explanation:
    """
    Attributes:
        equations: of the problem with the mountings that were let go.
        point: its solution.
        other: the solution of another explanation, when nobody can tell which is right.
        level: (m,) sigmas of odometry over what is configured, as far as it was seen.
        feared: (m,) variances likewise, as far as it must be feared; lately: of the last seconds.
        ratio: (robots,) s / g of odometry where all is as modelled, else None.
    """

    equations: Equations
    point: Point
    other: Point | None
    level: Array
    feared: Array
    lately: Array
    ratio: Array | None = None


@dataclass(frozen=True)
class _Check:
    """What a solution says of its model.

    Attributes:
        ratio: (robots,) s / g of odometry; 1 as modelled. pooled: of all together.
        runs: of outliers, that last until now.
        scores: of mountings.
    """

    ratio: Array
    runs: list[Run]
    scores: Scores
    pooled: float = 1.0

    def is_passed(self) -> bool:
        return not self.runs and bool((self.ratio <= STANDS_OUT).all())


def explain(equations: Equations, nominal: Point, most: int, tolerance: float) -> Explanation:
    """
    Args:
        nominal: the solution as configured, or with the mountings that were let go before.
        most, tolerance: of further solutions, see `descend`.
    """
    told = equations.problem.told if freed_lately(equations.problem) else None
    hidden = _Hidden(
        Equations(told, like=equations) if told else equations, nominal, most, tolerance
    )
    wall = _by_wall(equations, nominal, hidden)
    if wall is not None:
        return wall
    equations, nominal = settled(equations, nominal, most, tolerance)
    hidden = _Hidden(equations, nominal, most, tolerance) if told else hidden
    check = _checked(equations, nominal)
    fits = check.is_passed() and not check.scores.ask() and _fits(equations, nominal)
    common = _in_common(equations, nominal, check, most, tolerance)
    if common is not None and not check.scores.ask():
        return _commonly(equations, common)
    if common is None and (not fits or lapse_search.is_asked_for(equations.problem)):
        lapse = _by_lapse(equations, nominal, most, tolerance)
        if lapse is not None:
            return lapse
    if fits:
        return _as_is(equations, nominal, check.ratio)
    bases = [(equations, nominal, check)]
    if check.scores.ask():
        mounted, better = mountings.fitted(equations, nominal, check.scores, most, tolerance)
        again, gain = _checked(mounted, better), _gain(equations, nominal, mounted, better)
        explains = check.scores.ask_alone() or again.pooled <= ASKS
        is_worth = better.converged and explains and gain >= check.scores.least_gain()
        if is_worth and (common is None or gain >= common.gain):
            beside = _in_common(mounted, better, again, most, tolerance)
            if beside is not None:
                return _commonly(mounted, beside)
            if _fits(mounted, better) and again.is_passed():
                return _as_is(mounted, better, again.ratio)
        if is_worth and gain > MUCH and check.scores.ask_alone():
            bases.insert(0, (mounted, better, again))
        if common is not None:
            return _commonly(equations, common)
    sight = _by_sight(equations, nominal, hidden)
    if sight is not None:
        return sight
    if check.is_passed() and not check.scores.ask_alone():
        return _as_is(equations, nominal, check.ratio)
    for base, point, said in bases:
        levels = odometry_levels.levelled(base, point, said.ratio, said.runs, most, tolerance)
        seen = np.sqrt(levels.seen)
        if levels.is_odometry:
            return Explanation(base, levels.point, None, seen, levels.feared, levels.lately)
    # what was tried last is what remains of the nominal solution
    return Explanation(equations, nominal, levels.point, seen, levels.feared, levels.lately)


def _by_lapse(
    equations: Equations, nominal: Point, most: int, tolerance: float
) -> Explanation | None:
    """Wheels stood or spun, if that explains all."""
    found = lapse_search.best(equations, nominal, most, tolerance)
    if found is None or not _fits(found.equations, found.point):
        return None
    check = _checked(found.equations, found.point)
    return _as_is(found.equations, found.point, check.ratio) if check.is_passed() else None


@dataclass(frozen=True)
class _Hidden:
    """What may be when some do not see each other, looked for at most once."""

    equations: Equations
    nominal: Point
    most: int
    tolerance: float

    @cached_property
    def solutions(self) -> list[tuple[Equations, Point]]:
        """Those with hardly a range too short."""
        found = hidden_search.solutions(self.equations, self.nominal, self.most, self.tolerance)
        return [(equations, point) for equations, point in found if _fits(equations, point)]

    def explained(self, is_clear: Callable[[Problem, Point], bool]) -> Explanation | None:
        """With wheels as configured.

        Args:
            is_clear: could it be nothing else?
        """
        for equations, point in self.solutions:
            if is_clear(equations.problem, point):
                check = _checked(equations, point)
                if check.is_passed():
                    return _as_is(equations, point, check.ratio)
        return None


def _by_wall(equations: Equations, nominal: Point, hidden: _Hidden) -> Explanation | None:
    """A wall has come between two, if that explains all of what odometry told, also where
    something of it was freed a minute ago."""
    problem = equations.problem
    if problem.pairs < WITNESSED:
        return None
    is_as_told = hidden.equations is equations
    if is_as_told and (not many_wrong(problem, nominal) or _is_new(problem)):
        return None
    return hidden.explained(has_witnesses)


def _by_sight(equations: Equations, nominal: Point, hidden: _Hidden) -> Explanation | None:
    """Sight was blocked for long, if that explains all and somewhere it is free again."""
    if not many_wrong(equations.problem, nominal) or _is_new(equations.problem):
        return None
    return hidden.explained(has_passed)


def _is_new(problem: Problem) -> bool:
    """Was all as modelled so late that wheels may be the cause of what is not?"""
    ranges = problem.ranges
    if problem.fitted is None:
        return False
    ends = problem.n[np.stack([ranges.i, ranges.j], axis=-1)]
    since = (ends > problem.fitted[ranges.robots]).any(axis=1)
    return bool(np.bincount(ranges.pair, since, problem.pairs).max() < NOT_WHEELS)


def _in_common(
    equations: Equations, nominal: Point, check: _Check, most: int, tolerance: float
) -> CommonLevel | None:
    """Odometry was worse than configured, of all robots alike or of one, if that explains all."""
    if check.pooled <= ASKS or not _fits(equations, nominal, MANY_OUTLIERS):
        return None
    found = common_level.common_level(equations, nominal, most, tolerance)
    if found is None or (found.ratio > TARGET).any() or not _fits(equations, found.point):
        return None
    return None if runs(equations.problem, found.point) else found


def _commonly(equations: Equations, found: CommonLevel) -> Explanation:
    feared = 1.0 + TAILS * (found.variance - 1.0)
    # what is the same for all is in the covariances, and no reason to doubt anybody
    lately = feared if found.is_alone else np.ones(len(feared))
    seen = np.sqrt(found.variance)
    return Explanation(equations, found.point, None, seen, feared, lately)


def _fits(equations: Equations, point: Point, most: float = FEW_OUTLIERS) -> bool:
    """Are few ranges outliers?"""
    return bool(outlier_share(equations.problem, point).max(initial=0) < most)


def _as_is(equations: Equations, point: Point, ratio: Array) -> Explanation:
    robot = equations.problem.odometry.robot
    feared = np.maximum(ratio, 1.0)[robot]
    return Explanation(equations, point, None, np.ones(len(robot)), feared, feared, ratio)


def _checked(equations: Equations, point: Point) -> _Check:
    problem = equations.problem
    robot, robots = problem.odometry.robot, len(problem.priors.scale)
    factor = BandFactor.of(equations.weighed(point))
    if factor is None:
        return _Check(np.ones(robots), [], Scores(np.zeros(robots), np.zeros(robots)))
    guessed = guessed_misfit(equations, point, factor)
    ratio, together = guessed.ratio(robot, robots), pooled(problem, guessed)
    if (ratio > SUSPICIOUS).any():
        ratio = misfit(equations, point, factor).ratio(robot, robots)
    scores = mountings.scores(equations, point, factor)
    return _Check(ratio, runs(problem, point), scores, together)


def _gain(before: Equations, at: Point, after: Equations, better: Point) -> float:
    """By how much the cost fell."""
    return before.cost(at, at.threshold) - after.cost(better, at.threshold)
