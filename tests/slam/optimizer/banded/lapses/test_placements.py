"""Where the way behind a lapse may lie, of which ranges alone tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from slam_problems import held_at, slipping, stuck, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded.lapses import placements
from drslamd.slam.optimizer.banded.lapses.placements import FEWEST, RIVAL, PlacedWay, best_placed
from drslamd.slam.optimizer.banded.lapses.stretches import likely_stretches, with_freed
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

COUNT = 45
FAULT = (25, 31)
"""Keyframes between which something happens to robot 1; the stretch goes from 24 to 32."""


def freed_team(
    robots: int = 3, count: int = COUNT, fault: Callable[..., Problem] = slipping
) -> tuple[Problem, Array]:
    """A team whose robot 1 slipped, or stuck, which is known."""
    problem, truth = team_problem(7, robots=robots, count=count, closures=6)
    problem = fault(held_at(problem, truth), 1, *FAULT)
    (freed,) = likely_stretches(problem)
    return with_freed(problem, freed), truth


def solved(problem: Problem, initial: Array) -> tuple[Equations, Point]:
    equations = Equations(replace(problem, initial=initial))
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return equations, descend(equations, start, 60)


def displaced(truth: Array, robots: int, turn: float) -> Array:
    """The truth, with what is behind the stretch turned about its first pose."""
    poses = truth.copy()
    behind = np.arange(robots * 32 + 1, len(truth), robots)
    cos, sin = np.cos(turn), np.sin(turn)
    arm = poses[behind, :2] - poses[behind[0], :2]
    poses[behind, :2] = poses[behind[0], :2] + arm @ [[cos, sin], [-sin, cos]]
    poses[behind, 2] += turn
    return np.asarray(poses)


def found(equations: Equations, point: Point) -> PlacedWay:
    (freed,) = equations.problem.freed
    return best_placed(equations, point, freed, 60, TOLERANCE)


def off(point: Point, truth: Array, robots: int = 3) -> float:
    """Of robot 1 behind the stretch, m."""
    behind = np.arange(robots * 32 + 1, len(truth), robots)
    return float(np.hypot(*(point.poses - truth)[behind, :2].T).max())


@pytest.mark.parametrize("turn", [2.0, np.pi, -2.0])
def test_a_way_in_a_wrong_valley_is_brought_to_the_right_one(turn: float) -> None:
    problem, truth = freed_team()
    equations, wrong = solved(problem, displaced(truth, 3, turn))
    answer = found(equations, wrong)
    assert off(answer.point, truth) < 0.7
    assert answer.is_clear
    assert answer.point.converged


def test_a_valley_that_newton_does_not_leave_is_left() -> None:
    problem, truth = freed_team()
    stays = [solved(problem, displaced(truth, 3, turn))[1] for turn in (2.0, np.pi, -2.0)]
    assert max(off(point, truth) for point in stays) > 1.5


def test_a_way_that_is_right_is_left_where_it_is() -> None:
    problem, truth = freed_team()
    equations, right = solved(problem, truth)
    answer = found(equations, right)
    assert answer.point is right
    assert answer.is_clear


@pytest.mark.parametrize("times", [0.99, 1.01])
def test_another_place_must_cost_much_more_or_it_may_be_that_one(
    times: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One other is tried: the way turned by half a turn."""
    problem, truth = freed_team()
    equations, right = solved(problem, truth)
    _, wrong = solved(problem, displaced(truth, 3, np.pi))
    by = equations.cost(wrong, right.threshold) - equations.cost(right, right.threshold)
    assert by > RIVAL
    monkeypatch.setattr(placements._Way, "minima", lambda _: np.array([[0.0, 0.0, np.pi]]))
    monkeypatch.setattr(placements, "descend", lambda *_: wrong)
    monkeypatch.setattr(placements, "RIVAL", times * by)
    assert found(equations, right).is_clear is (times < 1)


@pytest.mark.parametrize("ranges", [FEWEST - 1, FEWEST])
def test_as_many_ranges_are_needed_as_leave_one_to_doubt(
    ranges: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two robots have one in each second, from keyframe 32 on."""
    problem, truth = freed_team(2, 32 + ranges)
    equations, point = solved(problem, truth)
    tried = []

    def counting(*_: object) -> Point:
        tried.append(1)
        return point

    monkeypatch.setattr(placements, "descend", counting)
    answer = found(equations, point)
    assert bool(tried) is (ranges == FEWEST)
    assert answer.point is point
    if not tried:
        assert not answer.is_clear


def test_wheels_that_stand_until_now_leave_no_way_behind() -> None:
    problem, truth = team_problem(7, robots=3, count=COUNT, closures=6)
    problem = stuck(held_at(problem, truth), 1, 30, COUNT)
    (freed,) = likely_stretches(problem)
    equations, point = solved(with_freed(problem, freed), truth)
    assert found(equations, point) == PlacedWay(point, is_clear=False)


def test_what_is_moved_is_the_way_behind_and_half_of_what_lies_within() -> None:
    """A quarter of a turn to the left about the middle of the antennas, then 1 m along x."""
    problem, truth = freed_team()
    _, point = solved(problem, truth)
    (freed,) = problem.freed
    way = placements._Way.behind(problem, point, freed)
    assert way is not None
    assert way.after.tolist() == list(range(3 * 32 + 1, 3 * COUNT, 3))
    assert way.inside.tolist() == list(range(3 * 25 + 1, 3 * 32, 3))
    moved = way.moved(point, np.array([1.0, 0.0, np.pi / 2]))
    middle = np.array([way.middle.real, way.middle.imag])
    arm = point.poses[way.after, :2] - middle
    assert moved[way.after, :2] == pytest.approx(
        middle + [1.0, 0.0] + np.column_stack([-arm[:, 1], arm[:, 0]])
    )
    assert moved[way.after, 2] == pytest.approx(point.poses[way.after, 2] + np.pi / 2)
    # the fourth of seven between two poses
    ends = point.poses[3 * 24 + 1], moved[3 * 32 + 1]
    assert moved[way.inside[3]] == pytest.approx((ends[0] + ends[1]) / 2)
    others = np.setdiff1d(np.arange(len(truth)), [*way.after, *way.inside])
    assert np.array_equal(moved[others], point.poses[others])
