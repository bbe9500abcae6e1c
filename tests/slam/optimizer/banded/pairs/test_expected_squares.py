"""What a solution leaves of drawn errors of ranges, against the dense matrix that leaves it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_problems import team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.layout import NOWHERE
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.pairs import expected_squares as module
from drslamd.slam.optimizer.banded.pairs.expected_squares import drawn_errors, expected_squares
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

SLOW, SLOW_S = 0.8, 2.5
"""Share of a range's sigma that is slow, and how long that lasts."""


def solved(problem: Problem) -> tuple[Equations, Point]:
    equations = Equations(problem)
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return equations, descend(equations, start, 60)


def correlated(problem: Problem) -> Array:
    """(m, m) covariance of all ranges."""
    ranges = problem.ranges
    t = problem.n[ranges.i] / 10.0
    apart = np.abs(t[:, None] - t)
    same = ranges.pair[:, None] == ranges.pair
    white = (1 - SLOW**2) * np.eye(len(t))
    kept = same * SLOW**2 * np.exp(-apart / SLOW_S) + white
    return np.asarray(ranges.sigma[:, None] * kept * ranges.sigma)


def dense(equations: Equations, point: Point) -> Array:
    """(pairs,) the exact mean: of r = (1 - J H^-1 J' W) e with the covariance of e."""
    problem, layout = equations.problem, equations.layout
    system = equations.weighed(point)
    size = layout.band + layout.border
    matrix = np.zeros((size, size))
    for d, row in enumerate(system.band):
        for k in range(layout.band - d):
            matrix[k + d, k] = matrix[k, k + d] = row[k]
    matrix[: layout.band, layout.band :] = system.border
    matrix[layout.band :, : layout.band] = system.border.T
    matrix[layout.band :, layout.band :] = system.corner
    factors = linearised.weighed_ranges(problem, point, problem.widths, False)
    unknowns, jacobian = (
        layout.range_unknowns(problem.ranges),
        np.zeros((len(problem.ranges), size)),
    )
    for row, at, values in zip(jacobian, unknowns, factors.jacobian[:, 0], strict=True):
        np.add.at(row, at[at != NOWHERE], values[at != NOWHERE])
    weight = factors.information[:, 0, 0]
    left = np.eye(len(weight)) - jacobian @ np.linalg.solve(matrix, jacobian.T * weight)
    squares = weight * np.diag(left @ correlated(problem) @ left.T)
    return np.bincount(problem.ranges.pair, squares, problem.pairs)


def test_it_is_the_mean_of_all_errors_as_modelled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "DRAWS", 400)
    problem, _ = team_problem(3, robots=3, count=20)
    problem = replace(problem, width=np.array([1.0, 1.35, 1.7]))
    equations, point = solved(problem)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    found, right = expected_squares(equations, point, factor), dense(equations, point)
    assert found == pytest.approx(right, rel=0.06)
    # a solution follows what lasts: much less is left than there are ranges
    assert (right < 0.8 * 20).all()


def test_the_few_that_are_drawn_are_near_that_and_the_same_each_time() -> None:
    problem, _ = team_problem(4, robots=2, count=60)
    equations, point = solved(problem)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    found, again = (expected_squares(equations, point, factor) for _ in range(2))
    assert found is not None
    assert again is not None
    assert found == pytest.approx(dense(equations, point), rel=0.2)
    assert np.array_equal(found, again)


def test_errors_of_a_pair_last_as_modelled_and_those_of_others_are_their_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "DRAWS", 3000)
    problem, _ = team_problem(2, robots=3, count=6)
    mixed = np.random.default_rng(1).permutation(len(problem.ranges))
    kept = replace(problem.ranges, sigma=np.linspace(0.02, 0.2, len(mixed)))
    columns = ("i", "j", "q_i", "q_j", "measured", "sigma", "pair", "robots", "turned")
    shuffled = replace(kept, **{name: getattr(kept, name)[mixed] for name in columns})
    problem = replace(problem, ranges=shuffled)
    drawn = drawn_errors(problem)
    sigma = shuffled.sigma
    found = drawn @ drawn.T / drawn.shape[1] / np.outer(sigma, sigma)
    assert found == pytest.approx(correlated(problem) / np.outer(sigma, sigma), abs=0.08)
    lasts = SLOW**2 * math.exp(-1 / SLOW_S)
    first, second = np.flatnonzero(shuffled.pair == 1)[
        np.argsort(problem.n[shuffled.i[shuffled.pair == 1]])
    ][:2]
    assert found[first, second] == pytest.approx(lasts, abs=0.08)


def test_a_matrix_that_leads_nowhere_says_nothing() -> None:
    class Nowhere:
        def solved(self, right: Array) -> Array | None:
            return None

        def squared(self, right: Array) -> Array | None:
            return None

    equations, point = solved(team_problem(3, robots=2, count=5)[0])
    assert expected_squares(equations, point, Nowhere()) is None
