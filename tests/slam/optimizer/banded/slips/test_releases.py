"""Which links of odometry are let go, worked out with whole problems."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_problems import held_at, links_of, mismeasured, team_problem
from slam_scenes import Array

from drslamd.conventions import GRID_HZ
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.odometry_levels import MEMORY, MOST_LEVEL
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.slips.releases import (
    LEAST_SAID,
    LOST_MPS,
    LOST_RADPS,
    Released,
    gains,
    lately,
    released,
    seen,
    squares,
    without,
)
from drslamd.slam.optimizer.problem import OdometryFactors, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

ROBOTS, COUNT = 3, 45
FAULT = (28, 33)
"""Keyframes between which something happens to robot 1."""


def a_team(seed: int) -> tuple[Problem, Array]:
    problem, truth = team_problem(seed, robots=ROBOTS, count=COUNT, closures=4)
    return held_at(problem, truth), truth


def nominal(problem: Problem) -> Point:
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return descend(Equations(problem), start, 60)


def freed(problem: Problem) -> Released:
    return released(Equations(problem), nominal(problem))


def worst(point: Point, truth: Array) -> float:
    return float(np.hypot(*(point.poses - truth)[:, :2].T).max())


def moment(problem: Problem, robot: int, at: int, moved: tuple[float, float, float]) -> Problem:
    """One link of a robot says something else."""
    link = links_of(problem, robot, at, at + 1)
    return mismeasured(problem, link, problem.odometry.measured[link] + moved)


@pytest.mark.parametrize("seed", [1, 2, 7])
def test_as_configured_nothing_is_let_go(seed: int) -> None:
    problem, _ = a_team(seed)
    point = nominal(problem)
    found = released(Equations(problem), point)
    assert not found.lost.any()
    assert found.point is point
    assert found.other is None


@pytest.mark.parametrize("moved", [(0.6, 0.0, 0.0), (0.0, 0.0, 0.8)])
def test_a_single_moment_is_let_go_near_where_it_was(moved: tuple[float, float, float]) -> None:
    problem, truth = a_team(3)
    problem = moment(problem, 2, 20, moved)
    found = freed(problem)
    assert found.lost.sum() == 1
    (link,) = np.flatnonzero(found.lost)
    assert problem.odometry.robot[link] == 2
    assert abs(problem.odometry.i[link] // ROBOTS - 20) <= 2
    assert worst(found.point, truth) < 0.4


def stood(problem: Problem, robot: int, first: int, last: int) -> tuple[Problem, Array]:
    """Counters of a robot stand between two keyframes: there are none in between, and what was
    ranged meanwhile is of the first; and the places (k,) that are left."""
    k, of = np.arange(len(problem.robot)) // ROBOTS, problem.robot == robot
    gone = of & (k > first) & (k < last)
    left = np.flatnonzero(~gone)
    at = np.cumsum(~gone) - 1
    at[gone] = at[first * ROBOTS + robot]
    odometry, ranges = problem.odometry, problem.ranges
    inside = links_of(problem, robot, first, last)
    said = mismeasured(problem, inside[:1], np.zeros(3), 5e-4).odometry
    ends = said.j.copy()
    ends[inside[0]] = last * ROBOTS + robot
    stays = np.setdiff1d(np.arange(len(odometry)), inside[1:])
    rows = {name: value[stays] for name, value in vars(said).items() if name != "information"}
    closures = problem.closures.chosen(np.zeros(len(problem.closures), dtype=bool))
    return replace(
        problem,
        robot=problem.robot[left],
        n=problem.n[left],
        initial=problem.initial[left],
        odometry=OdometryFactors(**{**rows, "i": at[said.i[stays]], "j": at[ends[stays]]}),
        closures=closures,
        ranges=replace(ranges, i=at[ranges.i], j=at[ranges.j]),
    ), left


@pytest.mark.parametrize("seed", [1, 4, 9])
def test_a_robot_whose_counters_stood_is_found_again_and_the_others_stay(seed: int) -> None:
    problem, truth = a_team(seed)
    problem, left = stood(problem, 1, *FAULT)
    truth = truth[left]
    found = freed(problem)
    odometry, n = problem.odometry, problem.n
    assert set(odometry.robot[found.lost]) == {1}
    gap = (odometry.robot == 1) & (n[odometry.j] - n[odometry.i] > 10)
    assert gap.sum() == 1
    assert found.lost[gap].all()
    goes_on = replace(found.equations.problem, initial=found.point.poses)
    point = descend(Equations(goes_on), found.point.calibration, 60)
    assert worst(point, truth) < 0.5
    assert worst(point, truth) < 0.3 * worst(nominal(problem), truth)


def test_baarda_says_by_how_much_the_cost_falls_without_a_link() -> None:
    """Against solutions without it, robots standing so near the truth that all is linear."""
    problem, _ = a_team(5)
    problem = moment(problem, 1, 22, (0.03, 0.0, 0.0))
    equations, point = Equations(problem), nominal(problem)
    found = gains(equations, point)
    assert found is not None
    before = equations.cost(point, point.threshold)
    for link in (int(np.argmax(found)), *links_of(problem, 1, 22, 23)):
        covariance = problem.odometry.covariance.copy()
        covariance[link] *= 1e8
        loose = replace(problem, odometry=replace(problem.odometry, covariance=covariance))
        free = Equations(replace(loose, initial=point.poses))
        better = descend(free, point.calibration, 60, TOLERANCE)
        assert found[link] == pytest.approx(
            before - free.cost(better, point.threshold), rel=0.2, abs=0.3
        )


def test_what_is_let_go_is_held_by_how_far_a_robot_can_have_come() -> None:
    problem, _ = a_team(1)
    lost = np.zeros(len(problem.odometry), dtype=bool)
    lost[4] = True
    loose = without(problem, lost).odometry.covariance - problem.odometry.covariance
    seconds = 10 / GRID_HZ
    expected = np.diag([LOST_MPS, LOST_MPS, LOST_RADPS]) ** 2 * seconds**2
    assert loose[4] == pytest.approx(expected)
    assert not loose[~lost].any()


def test_what_was_let_go_was_as_wrong_as_it_was_seen_and_is_said_for_a_while() -> None:
    problem, _ = a_team(1)
    point = nominal(problem)
    errors = squares(problem, point)
    assert errors.sum() == pytest.approx(problem.odometry.cost(point.link))
    lost = np.zeros(len(errors), dtype=bool)
    link = int(links_of(problem, 1, 10, 11)[0])
    lost[link] = True
    found = seen(problem, point, lost)
    assert found[link] == LEAST_SAID**2
    assert (found[~lost] == 1).all()
    far = replace(point, link=point.link + 5.0)
    assert seen(problem, far, lost)[link] == MOST_LEVEL**2
    said = lately(problem, found)
    n = problem.n[problem.odometry.j]
    near = (problem.odometry.robot == 1) & (n >= n[link]) & (n <= n[link] + MEMORY)
    assert (said[near] == LEAST_SAID**2).all()
    assert (said[~near] == 1).all()
