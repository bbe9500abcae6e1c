"""Which stretch, freed, explains what does not fit.

Two robots alone only know of each other how far they are apart: what one of them may have done in a
stretch explains much of what the other did in another one. So only what came to an end not long
before all still was as modelled is looked at, and where a stretch of another robot explains nearly
as much nobody can say who it was. But a robot has mass: wheels that stopped or went faster all at
once say more than those that did so as robots do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.banded.lapses.known_lapses import GAIN, newest_keyframe, settled
from drslamd.slam.optimizer.banded.lapses.placements import RIVAL
from drslamd.slam.optimizer.banded.lapses.stretches import (
    any_stretches,
    has_short_links,
    likely_stretches,
    span,
    with_freed,
)
from drslamd.slam.optimizer.banded.misfit import FEW_OUTLIERS, in_a_row, outliers, share
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Freed, Problem
from drslamd.slam.se2 import Index

ROUND, ROUGH = 8, 1e-3
"""Steps, and m and rad, after which it is seen which are worth more."""
LITTLE, MOST_POLISHED = 10.0, 3
"""What gains less by then is not gone on with, and so many are."""
ABRUPT = 15.0
"""Of cost, for a stretch in which wheels changed their speed at once: of twenty drives in which the
counters of one robot stuck nineteen have that, and of their healthy robots none."""
FEWEST = 3
"""Robots: of two that are off each other anything explains everything."""
MANY_BEFORE = 2 * FEW_OUTLIERS
"""Of the ranges of any pair: a solution that was bent until later ones fit leaves fewer."""
MOST_TRIED_PAIRS = 10
"""That have met, five robots: of each ten stretches are tried where odometry shows nothing."""
IN_A_ROW, LATELY = 3, 20
"""Ranges of a pair, one a second, that are outliers, and how many came since."""
MOST_PAIRS = 45
"""That have met, ten robots: a stretch takes some solutions, and larger teams ask only once
something does not fit."""
BEHIND = 10
"""Links by which a stretch may have ended before something did not fit: ranges show it once the
robot has driven some metres."""


@dataclass(frozen=True)
class Tried:
    """What is solved with a stretch freed.

    Attributes:
        robot: whose it is, as the problem numbers them.
        gain: by how much the cost fell.
        is_abrupt: see `Freed`.
    """

    robot: int
    equations: Equations
    point: Point
    gain: float
    is_abrupt: bool = False

    @property
    def worth(self) -> float:
        """What speaks for it."""
        return self.gain + (ABRUPT if self.is_abrupt else 0.0)


def best(
    equations: Equations, nominal: Point, anywhere: bool, most: int, tolerance: float
) -> Tried | None:
    """The solution with the stretch freed that explains most; None where none explains much, or
    where nobody can say which does.

    Args:
        anywhere: also stretches of which odometry shows nothing?
        most, tolerance: of that solution, see `descend`.
    """
    problem = equations.problem
    stretches = _possible(problem, likely_stretches(problem))
    if anywhere:
        wrong = outliers(problem, nominal)
        others = _possible(problem, any_stretches(problem))
        stretches += [freed for freed in others if _may_explain(problem, wrong, freed)]
    rough = [_roughly(equations, nominal, freed) for freed in stretches]
    tried = [
        _polished(equations, nominal, one, most, tolerance)
        for one in _most_worth(rough)
        if one.worth >= LITTLE
    ]
    found = max(tried, key=lambda one: one.worth, default=None)
    if found is None or found.worth < GAIN:
        return None
    rivals = [one.worth for one in tried if one.robot != found.robot]
    return found if max(rivals, default=0.0) < found.worth - RIVAL else None


def is_anywhere(problem: Problem, nominal: Point, is_as_modelled: bool) -> bool:
    """May it have been where odometry shows nothing? Then odometry does not fit, or several ranges
    of a pair do not that follow each other, and not one now and then.

    Args:
        is_as_modelled: does odometry fit, and do ranges at the end?
    """
    robots = len(np.unique(problem.odometry.robot))
    if robots < FEWEST or problem.pairs > MOST_TRIED_PAIRS:
        return False
    if not is_as_modelled:
        return True
    pair, is_wrong, count = in_a_row(problem, outliers(problem, nominal))
    ends = np.cumsum(count)
    since = ends[np.searchsorted(pair, pair, side="right") - 1] - ends
    return bool((is_wrong & (count >= IN_A_ROW) & (since < LATELY)).any())


def _most_worth(rough: list[Tried]) -> list[Tried]:
    """Those that are gone on with; the best one of another robot is among them."""
    rough = sorted(rough, key=lambda one: -one.worth)
    others = [one for one in rough if one.robot != rough[0].robot]
    chosen = rough[:MOST_POLISHED]
    if others and others[0] not in chosen:
        chosen[-1] = others[0]
    return chosen


def _may_explain(problem: Problem, wrong: NDArray[np.bool_], freed: Freed) -> bool:
    """Do ranges fit that its robot has from before? Those no later lapse explains.

    Args:
        wrong: (n,) which ranges are outliers.
    """
    ranges = problem.ranges
    ends = problem.n[np.stack([ranges.i, ranges.j], axis=-1)]
    before = ((ranges.robots == freed.robot) & (ends < span(problem, freed)[0])).any(axis=1)
    return bool((share(problem, wrong & before) < MANY_BEFORE).all())


def is_asked_for(problem: Problem) -> bool:
    """Did wheels stop, or go faster, all at once of late? Then it is asked though all fits."""
    if problem.pairs > MOST_PAIRS or not has_short_links(problem):
        return False
    likely = _possible(problem, likely_stretches(problem))
    return any(f.is_abrupt and _has_moved(problem, f.robot) for f in likely)


def _has_moved(problem: Problem, robot: int) -> bool:
    """Has it made keyframes since all was as modelled? Of one that parks nothing new is known."""
    if problem.fitted is None:
        return True
    return bool(newest_keyframe(problem, robot) > problem.fitted[robot])


def _possible(problem: Problem, stretches: list[Freed]) -> list[Freed]:
    """Those that are recent and not freed yet."""
    taken = [links for freed in problem.freed for links in freed.links.tolist()]
    return [
        freed
        for freed in stretches
        if _is_recent(problem, freed) and not np.isin(_core(freed), taken).any()
    ]


def _core(freed: Freed) -> Index:
    """Its links without those beside it."""
    return freed.links[1:-1] if len(freed.links) > 2 else freed.links


def _is_recent(problem: Problem, freed: Freed) -> bool:
    """Did it end at most some links before the last solution that was as modelled?"""
    if problem.fitted is None:
        return True
    odometry = problem.odometry
    mine = odometry.robot == freed.robot
    until = problem.n[odometry.j[mine]] <= problem.fitted[freed.robot]
    since = problem.n[odometry.i[mine]] >= span(problem, freed)[1]
    return int(np.count_nonzero(until & since)) <= BEHIND


def _roughly(equations: Equations, nominal: Point, freed: Freed) -> Tried:
    problem = with_freed(replace(equations.problem, initial=nominal.poses), freed)
    wider = Equations(problem, like=equations)
    point = descend(wider, nominal.calibration, ROUND, ROUGH)
    near = Equations(replace(problem, initial=point.poses), like=wider)
    return Tried(
        freed.robot, near, point, _gain(equations, nominal, problem, point), freed.is_abrupt
    )


def _polished(
    equations: Equations, nominal: Point, rough: Tried, most: int, tolerance: float
) -> Tried:
    point = descend(rough.equations, rough.point.calibration, most, tolerance)
    freed, point = settled(rough.equations, point, most, tolerance)
    return Tried(
        rough.robot, freed, point, _gain(equations, nominal, freed.problem, point), rough.is_abrupt
    )


def _gain(equations: Equations, nominal: Point, freed: Problem, better: Point) -> float:
    """By how much the cost falls; that some ranges no longer count is no gain."""
    counted = Equations(replace(freed, ranges=equations.problem.ranges), like=equations)
    before = equations.cost(nominal, nominal.threshold)
    return before - counted.cost(better, nominal.threshold)
