"""The questions of each second, against those that are asked of a solution made anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kept_scenes import a_problem, shaken

from drslamd.conventions import GRID_HZ
from drslamd.slam.optimizer.banded import misfit, mountings
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.common_level import ASKS
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept import quick_check
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Index


def with_errors(problem: Problem, point: Point, sigmas: dict[int, float]) -> Point:
    """The newest ranges of pair 1 are so many sigmas off, counted from the last; others fit."""
    ranges = problem.ranges
    error = np.zeros(len(ranges))
    mine = np.flatnonzero(ranges.pair == 1)
    mine = mine[np.argsort(np.maximum(ranges.i, ranges.j)[mine], kind="stable")][::-1]
    for back, size in sigmas.items():
        error[mine[back]] = size * ranges.sigma[mine[back]]
    return replace(point, sight=point.sight._replace(error=error))


def newest_of(problem: Problem) -> Index:
    """The last keyframe of each of three robots."""
    return np.array([problem.n[problem.robot_id == robot].max() for robot in range(3)])


CASES = [
    ({}, False),
    (dict.fromkeys(range(3), 3.0), False),
    (dict.fromkeys(range(4), 3.0), True),
    (dict.fromkeys(range(1, 9), 3.0), True),
    (dict.fromkeys(range(2, 5), 3.0), False),
    ({k: (-1) ** k * 1.9 for k in range(10)}, True),
    ({k: (-1) ** k * 1.8 for k in range(10)}, False),
    ({k: (-1) ** k * 2.0 for k in range(9)}, True),
]


@pytest.mark.parametrize(("sigmas", "expected"), CASES)
def test_runs_are_seen_where_there_are_any(sigmas: dict[int, float], expected: bool) -> None:
    problem = a_problem(carried=False)
    point = with_errors(problem, shaken(problem), sigmas)
    assert bool(len(misfit.with_runs(problem, point))) is expected
    assert bool(misfit.runs(problem, point)) is expected


@pytest.mark.parametrize("share", [0.2, 0.39, 0.41, 0.7])
def test_pairs_of_which_many_ranges_are_wrong_are_named(share: float) -> None:
    problem = a_problem(carried=False)
    point = with_errors(problem, shaken(problem), {})
    error = point.sight.error.copy()
    mine = np.flatnonzero(problem.ranges.pair == 2)
    # the newest ones fit, so that there is no run
    error[mine[: int(share * len(mine))]] = 1.0
    point = replace(point, sight=point.sight._replace(error=error))
    assert not len(misfit.with_runs(problem, point))
    found = misfit.lately_wrong(problem, point)
    assert found.tolist() == misfit.contradicted(problem, point).tolist()


def test_a_misfit_is_told_where_all_is_as_modelled_and_not_where_it_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = a_problem()
    equations = Equations(problem)
    point = descend(equations, Calibration.zero(problem.pairs, 3), 40)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    left = mountings.variances(equations, point, factor)
    assert left is not None
    checked = quick_check.Freedom.of(equations, point, factor)
    ratio = quick_check.misfit_as_modelled(problem, point, checked, left)
    assert ratio is not None
    expected = misfit.guessed_misfit(equations, point, factor).ratio(problem.odometry.robot, 3)
    assert np.allclose(ratio, expected)
    ask = mountings.scores(equations, point, factor)
    assert not ask.ask()
    # a mounting that asks, odometry that does not fit
    assert quick_check.misfit_as_modelled(problem, point, checked, left / 1e4) is None
    worse = replace(point, link=point.link * 4)
    assert quick_check.misfit_as_modelled(problem, worse, checked, left) is None
    # ranges of which many are outliers
    monkeypatch.setattr(quick_check, "many_wrong", lambda *_: True)
    assert quick_check.misfit_as_modelled(problem, point, checked, left) is None


@pytest.mark.parametrize(("off", "is_modelled"), [(0.001, False), (-0.001, True)])
def test_robots_that_are_worse_only_together_are_looked_at_closer(
    off: float, is_modelled: bool
) -> None:
    problem = a_problem()
    equations = Equations(problem)
    point = descend(equations, Calibration.zero(problem.pairs, 3), 40)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    left = mountings.variances(equations, point, factor)
    assert left is not None
    squares = misfit.squares_of(problem, point)
    robot = problem.odometry.robot
    links = np.bincount(robot, minlength=3).astype(float)
    s = np.bincount(robot, squares, 3)
    # each has a third of what makes both sides alike, and nobody stands out
    share = ((s.sum() + 1) / (ASKS + off) - 1) / s.sum()
    checked = quick_check.Freedom(s * share, links, newest_of(problem))
    found = quick_check.misfit_as_modelled(problem, point, checked, left)
    assert (found is not None) is is_modelled


def test_what_could_be_checked_grows_with_the_way() -> None:
    """Twice as many links as then: twice the freedom, and what fitted fits."""
    problem = a_problem()
    point = shaken(problem)
    squares, robot = misfit.squares_of(problem, point), problem.odometry.robot
    links = np.bincount(robot, minlength=3).astype(float)
    then = quick_check.Freedom(np.array([7.0, 20.0, 0.0]), links / [1, 2, 1], newest_of(problem))
    s = [squares[robot == k].sum() for k in range(3)]
    expected = [(s[0] + 1) / (7 + 1), (s[1] + 1) / (40 + 1), s[2] + 1]
    ratio, pooled = then.ratio(problem, point)
    assert ratio == pytest.approx(expected)
    assert pooled == pytest.approx((sum(s) + 1) / (7 + 40 + 1))


@pytest.mark.parametrize(("times", "is_fresh"), [(1.04, True), (1.06, False)])
def test_what_could_be_checked_is_fresh_until_one_robot_has_five_in_a_hundred_more_links(
    times: float, is_fresh: bool
) -> None:
    problem = a_problem()
    links = np.bincount(problem.odometry.robot, minlength=3).astype(float)
    then = quick_check.Freedom(np.ones(3), links / [1.0, times, 1.0], newest_of(problem))
    assert then.is_fresh(problem) is is_fresh


@pytest.mark.parametrize(("later_s", "is_fresh"), [(60, True), (61, False)])
def test_what_could_be_checked_is_fresh_for_a_minute(later_s: int, is_fresh: bool) -> None:
    problem = a_problem()
    links = np.bincount(problem.odometry.robot, minlength=3).astype(float)
    newest = newest_of(problem) - np.array([0, later_s * GRID_HZ, 0])
    assert quick_check.Freedom(np.ones(3), links, newest).is_fresh(problem) is is_fresh
