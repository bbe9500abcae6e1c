"""Odometry that was worse than configured, of everybody alike or of one: by how much, and when it
is no slip."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_problems import links_of, mismeasured, slipping, team_problem

from drslamd.slam.optimizer.banded import common_level
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.common_level import CLEAR, MOST, CommonLevel, pooled
from drslamd.slam.optimizer.banded.lapses.stretches import freed_links
from drslamd.slam.optimizer.banded.misfit import Misfit, misfit
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

COUNT = 45


def a_team(seed: int, robots: int, worse: float = 1.0) -> Problem:
    return team_problem(seed, robots=robots, count=COUNT, closures=6, link_error=worse)[0]


def one_is_noisy(problem: Problem, robot: int, times: float) -> Problem:
    """Whose links are so many times as wrong as they say."""
    links = links_of(problem, robot, 0, COUNT)
    roots = np.linalg.cholesky(problem.odometry.covariance[links])
    noise = np.random.default_rng(5).normal(0, math.sqrt(times**2 - 1), (len(links), 3, 1))
    return mismeasured(problem, links, problem.odometry.measured[links] + (roots @ noise)[..., 0])


def nominal(problem: Problem) -> Point:
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return descend(Equations(problem), start, 60)


def found_in(problem: Problem) -> CommonLevel | None:
    return common_level.common_level(Equations(problem), nominal(problem), 60, TOLERANCE)


def variances(problem: Problem, found: CommonLevel) -> list[float]:
    """Of each robot; it is the same along its way."""
    robot = problem.odometry.robot
    each = [np.unique(found.variance[robot == r]) for r in range(robot.max() + 1)]
    assert all(len(values) == 1 for values in each)
    return [float(values[0]) for values in each]


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
@pytest.mark.parametrize("robots", [2, 4])
def test_where_all_is_as_configured_nothing_is_found(seed: int, robots: int) -> None:
    assert found_in(a_team(seed, robots)) is None


@pytest.mark.parametrize("worse", [1.6, 2.5])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_is_as_much_worse_for_all_is_found_of_all(seed: int, worse: float) -> None:
    problem = a_team(seed, 4, worse)
    found = found_in(problem)
    assert found is not None
    assert not found.is_alone
    each = variances(problem, found)
    assert max(each) == min(each)
    assert 0.7 < max(each) / worse**2 < 1.3
    # with that odometry fits
    assert found.ratio.max() < 1.7
    assert found.gain > CLEAR
    assert found.point.converged


@pytest.mark.parametrize("robots", [3, 4])
def test_one_that_is_worse_alone_is_found_alone(robots: int) -> None:
    problem = one_is_noisy(a_team(2, robots), 1, 4.0)
    found = found_in(problem)
    assert found is not None
    assert found.is_alone
    each = variances(problem, found)
    assert each.pop(1) > 4
    assert each == [1.0] * (robots - 1)


def test_of_two_nobody_can_tell_which_is_worse() -> None:
    problem = one_is_noisy(a_team(1, 2), 1, 5.0)
    found = found_in(problem)
    assert found is not None
    assert not found.is_alone
    each = variances(problem, found)
    assert each[0] == each[1] > 4


@pytest.mark.parametrize(("worse", "is_slip"), [(4.0, True), (9.0, False)])
def test_where_very_much_is_asked_for_it_is_no_slip(worse: float, is_slip: bool) -> None:
    found = found_in(a_team(2, 4, worse))
    assert (found is not None) is is_slip
    assert found is None or found.variance.max() < MOST


@pytest.mark.parametrize(("clear", "is_found"), [(0.99, True), (1.01, False)])
def test_what_brings_little_is_not_said(
    clear: float, is_found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = a_team(2, 4, 1.6)
    found = found_in(problem)
    assert found is not None
    monkeypatch.setattr(common_level, "CLEAR", clear * found.gain)
    assert (found_in(problem) is not None) is is_found


def test_a_factor_whose_solution_was_not_reached_is_none() -> None:
    problem = a_team(1, 3, 2.5)
    assert common_level.common_level(Equations(problem), nominal(problem), 0, TOLERANCE) is None


def test_the_surprise_falls_by_what_squares_have_too_much() -> None:
    """Its derivative by the logarithm of the factor is g - s, however that is computed."""
    problem = team_problem(2, robots=3, count=20, link_error=1.6)[0]
    # (with Gauss's ranges only: the weights of others move with the solution)
    problem = replace(problem, model=replace(problem.model, cauchy_sigmas=1e3))
    equations, point = Equations(problem), nominal(problem)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    exact = misfit(equations, point, factor)
    surprises = []
    for log in (-0.02, 0.02):
        odometry = replace(problem.odometry, covariance=math.exp(log) * problem.odometry.covariance)
        believed = Equations(replace(problem, odometry=odometry))
        at = descend(believed, point.calibration, 60)
        surprise = common_level._surprise(believed, at, point.threshold)
        assert surprise is not None
        surprises.append(surprise)
    slope = (surprises[1] - surprises[0]) / 0.04
    assert slope == pytest.approx(exact.checked.sum() - exact.squares.sum(), rel=0.03)


def test_what_is_known_to_have_stood_or_spun_does_not_count() -> None:
    problem = slipping(a_team(1, 3), 1, 20, 26)
    squares = np.ones(len(problem.odometry))
    links = links_of(problem, 1, 20, 26)
    squares[links] = 100.0
    found = Misfit(squares, np.full(len(squares), 2.0))
    count = len(squares)
    all_of_them = (count - 6 + 600 + 1) / (2 * count + 1)
    assert pooled(problem, found) == pytest.approx(all_of_them)
    known = replace(problem, freed=(freed_links(problem, 1, links, stands=False),))
    assert pooled(known, found) == pytest.approx((count - 6 + 1) / (2 * (count - 6) + 1))
