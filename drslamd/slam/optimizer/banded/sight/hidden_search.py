"""Solutions for which sight was blocked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from drslamd.slam.optimizer.banded.misfit import FEW_OUTLIERS, outlier_share
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.sight.hidden import long_for_long

FAR = 10
"""Times the steps that a solution takes else: twice as many mostly suffice, eight times was seen,
and a way that is broken off looks like another cause for half a minute."""
HOPELESS = 0.3
"""Share of ranges of any pair that are too short after the first steps: no sight explains them."""


def solutions(
    equations: Equations, nominal: Point, most: int, tolerance: float
) -> Iterator[tuple[Equations, Point]]:
    """The likelier one first: only pairs were hidden of which that is seen, else anybody was.

    Args:
        nominal: a solution for which nobody was.
        most, tolerance: of a solution, see `descend`.
    """
    problem = equations.problem
    anybody = np.ones(problem.pairs, dtype=bool)
    everywhere = replace(problem, initial=nominal.poses, blocked=anybody)
    # it is far from here: a solution that was bent until the ranges fit leads astray
    wide = Equations(everywhere, like=equations)
    point = descend(wide, nominal.calibration, 2 * most, tolerance)
    if not point.converged and outlier_share(everywhere, point).max(initial=0) < HOPELESS:
        wide = Equations(replace(everywhere, initial=point.poses), like=equations)
        point = descend(wide, point.calibration, FAR * most, tolerance)
    if not point.converged or outlier_share(everywhere, point).max(initial=0) >= FEW_OUTLIERS:
        return
    # the others are believed as always
    hidden = long_for_long(everywhere, point)
    somewhere = Equations(replace(problem, initial=point.poses, blocked=hidden), like=equations)
    better = descend(somewhere, point.calibration, FAR * most, tolerance)
    if better.converged:
        yield somewhere, better
    yield wide, point
