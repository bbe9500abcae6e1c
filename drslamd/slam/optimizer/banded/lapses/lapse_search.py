"""Which stretch, freed, explains what does not fit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drslamd.slam.optimizer.banded.lapses.stretches import likely_stretches, with_freed
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Freed, Problem

GAIN = 30.0
"""Of cost, by which the best must be better than none; where nothing stood or spun it is below 20,
or the rest still does not fit."""
ROUND, ROUGH = 8, 1e-3
"""Steps, and m and rad, after which it is seen which is best."""


@dataclass(frozen=True)
class Tried:
    """What is solved with a stretch freed; gain: by how much the cost fell."""

    equations: Equations
    point: Point
    gain: float


def best(equations: Equations, nominal: Point, most: int, tolerance: float) -> Tried | None:
    """The solution with the stretch freed that explains most; None where none explains much.

    Args:
        most, tolerance: of that solution, see `descend`.
    """
    problem = equations.problem
    taken = [links for freed in problem.freed for links in freed.links.tolist()]
    tried = [
        _solved(equations, nominal, freed)
        for freed in likely_stretches(problem)
        if not np.isin(freed.links[1:-1], taken).any()
    ]
    found = max(tried, key=lambda one: one.gain, default=None)
    if found is None or found.gain < GAIN:
        return None
    point = descend(found.equations, found.point.calibration, most, tolerance)
    gain = _gain(equations, nominal, found.equations.problem, point)
    return Tried(found.equations, point, gain) if gain >= GAIN else None


def _solved(equations: Equations, nominal: Point, freed: Freed) -> Tried:
    """Roughly."""
    problem = with_freed(replace(equations.problem, initial=nominal.poses), freed)
    wider = Equations(problem, like=equations)
    point = descend(wider, nominal.calibration, ROUND, ROUGH)
    near = Equations(replace(wider.problem, initial=point.poses), like=wider)
    return Tried(near, point, _gain(equations, nominal, problem, point))


def _gain(equations: Equations, nominal: Point, freed: Problem, better: Point) -> float:
    """By how much the cost falls; that some ranges no longer count is no gain."""
    counted = Equations(replace(freed, ranges=equations.problem.ranges), like=equations)
    before = equations.cost(nominal, nominal.threshold)
    return before - counted.cost(better, nominal.threshold)
