"""To what the squares of ranges would come at a solution, were they as wrong as configured.

A solution bends until ranges fit, and follows most of an error that lasts for seconds. So what is
left of errors of one sigma each is less than their number, and how much less hangs on who drives
where. It is found by errors that are drawn as the model has them, with a slow and a white part:
each draw is solved for once, by the matrix of the solution, and the squares of what that leaves
are counted.
"""

from __future__ import annotations

import numpy as np

from drslamd.conventions import GRID_HZ
from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.band_factor import Solver
from drslamd.slam.optimizer.banded.layout import NOWHERE
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array

DRAWS = 6
"""Of all ranges; their mean over a hundred ranges is good to some percent."""


def expected_squares(equations: Equations, point: Point, factor: Solver) -> Array | None:
    """(pairs,) mean of the sums e' W e, with the weights of that solution; None where the matrix
    gives no solution.

    Args:
        factor: of `Equations.weighed` at that point, or near it.
    """
    problem, layout = equations.problem, equations.layout
    has_antennas = bool(problem.doubted.antenna.any())
    factors = linearised.weighed_ranges(problem, point, problem.widths, has_antennas)
    weight, unknowns = factors.information[:, 0], layout.range_unknowns(problem.ranges)
    jacobian = np.where(unknowns == NOWHERE, 0.0, factors.jacobian[:, 0])
    unknowns = np.maximum(unknowns, 0)
    drawn = drawn_errors(problem)
    pulls = jacobian[:, :, None] * (weight * drawn)[:, None]
    size = layout.band + layout.border
    sums = [np.bincount(unknowns.ravel(), each.ravel(), size) for each in np.moveaxis(pulls, 2, 0)]
    followed = factor.solved(np.stack(sums, axis=-1))
    if followed is None:
        return None
    left = drawn - np.einsum("mc,mck->mk", jacobian, followed[unknowns])
    squares = (weight * left**2).mean(axis=1)
    return np.asarray(np.bincount(problem.ranges.pair, squares, problem.pairs))


def drawn_errors(problem: Problem) -> Array:
    """(m, DRAWS) errors of all ranges, m; the same for everybody who has the same problem."""
    ranges, model = problem.ranges, problem.model
    n = problem.n[ranges.i]
    order = np.lexsort((n, ranges.pair))
    pair = ranges.pair[order]
    count = np.bincount(pair, minlength=problem.pairs)
    most = int(count.max(initial=0))
    place = np.arange(len(order)) - (np.cumsum(count) - count)[pair]
    seconds = np.zeros((most, problem.pairs))
    seconds[place, pair] = n[order] / GRID_HZ
    keep = np.exp(-np.maximum(np.diff(seconds, axis=0), 0.0) / model.slow_s)[..., None]
    slow, white = np.random.default_rng(0).normal(size=(2, most, problem.pairs, DRAWS))
    news = np.sqrt(1 - keep**2)
    for k in range(most - 1):
        slow[k + 1] = keep[k] * slow[k] + news[k] * slow[k + 1]
    both = model.slow_share * slow + np.sqrt(1 - model.slow_share**2) * white
    out = np.empty((len(order), DRAWS))
    out[order] = both[place, pair]
    return ranges.sigma[:, None] * out
