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

from drslamd.slam.optimizer.banded.lapses.known_lapses import GAIN, newest_keyframe, settled
from drslamd.slam.optimizer.banded.lapses.placements import RIVAL
from drslamd.slam.optimizer.banded.lapses.stretches import (
    has_short_links,
    likely_stretches,
    span,
    with_freed,
)
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Freed, Problem

ROUND, ROUGH = 8, 1e-3
"""Steps, and m and rad, after which it is seen which are worth more."""
LITTLE, MOST_POLISHED = 10.0, 3
"""What gains less by then is not gone on with, and so many are."""
ABRUPT = 15.0
"""Of cost, for a stretch in which wheels changed their speed at once: of twenty drives in which the
counters of one robot stuck nineteen have that, and of their healthy robots none."""
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


def best(equations: Equations, nominal: Point, most: int, tolerance: float) -> Tried | None:
    """The solution with the stretch freed that explains most; None where none explains much, or
    where nobody can say which does.

    Args:
        most, tolerance: of that solution, see `descend`.
    """
    rough = [_roughly(equations, nominal, freed) for freed in _possible(equations.problem)]
    rough.sort(key=lambda one: -one.worth)
    tried = [
        _polished(equations, nominal, one, most, tolerance)
        for one in rough[:MOST_POLISHED]
        if one.worth >= LITTLE
    ]
    found = max(tried, key=lambda one: one.worth, default=None)
    if found is None or found.worth < GAIN:
        return None
    others = [one.worth for one in tried if one.robot != found.robot]
    return found if max(others, default=0.0) < found.worth - RIVAL else None


def is_asked_for(problem: Problem) -> bool:
    """Did wheels stop, or go faster, all at once of late? Then it is asked though all fits."""
    if problem.pairs > MOST_PAIRS or not has_short_links(problem):
        return False
    return any(f.is_abrupt and _has_moved(problem, f.robot) for f in _possible(problem))


def _has_moved(problem: Problem, robot: int) -> bool:
    """Has it made keyframes since all was as modelled? Of one that parks nothing new is known."""
    if problem.fitted is None:
        return True
    return bool(newest_keyframe(problem, robot) > problem.fitted[robot])


def _possible(problem: Problem) -> list[Freed]:
    """Recent stretches that are not freed yet."""
    taken = [links for freed in problem.freed for links in freed.links.tolist()]
    return [
        freed
        for freed in likely_stretches(problem)
        if _is_recent(problem, freed) and not np.isin(freed.links[1:-1], taken).any()
    ]


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
