"""Steps by a matrix of elsewhere, against Newton's own."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from kept_scenes import a_team_problem

from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem
from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept.believed import Believed
from drslamd.slam.optimizer.kept.fixed_point import approach
from drslamd.slam.optimizer.kept.head import tail_of
from drslamd.slam.optimizer.kept.kept_factor import Current, build
from drslamd.slam.se2 import Array


@pytest.fixture(scope="module")
def team() -> TeamProblem:
    return a_team_problem()


def solution(team: TeamProblem) -> Point:
    found = descend(Equations(team.problem), team.start, 60, 1e-9)
    assert found.converged
    return found


def matrix_at(team: TeamProblem, point: Point) -> Current:
    believed = Believed(team.problem, point)
    kept = build(believed, team.pairs, tail_of(team.problem), True)
    assert kept is not None
    places = kept.head.places(team.problem, team.pairs)
    assert places is not None
    found = kept.on_top(believed, places)
    assert found is not None
    return found


def test_the_end_is_the_solution_whatever_the_matrix(team: TeamProblem) -> None:
    right = solution(team)
    problem = team.problem
    flat = Equations(problem, layout=BandLayout.flat(problem))
    rng = np.random.default_rng(1)
    moved = right.poses + rng.normal(0, 0.002, right.poses.shape)
    start = Point.of(problem, moved, right.calibration)
    for seed in range(2):
        beside = replace(
            right, poses=right.poses + rng.normal(0, 0.001 * (1 + seed), right.poses.shape)
        )
        beside = Point.of(problem, beside.poses, beside.calibration)
        found = approach(flat, start, matrix_at(team, beside), 1e-8, most=40)
        assert found is not None
        assert found.converged
        assert np.abs(found.poses - right.poses).max() < 1e-7
        assert np.abs(found.calibration.bias - right.calibration.bias).max() < 1e-7


def test_mixing_saves_steps(team: TeamProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    right = solution(team)
    problem = team.problem
    flat = Equations(problem, layout=BandLayout.flat(problem))
    rng = np.random.default_rng(1)
    start = Point.of(
        problem, right.poses + rng.normal(0, 0.01, right.poses.shape), right.calibration
    )
    matrix = matrix_at(team, start)
    mixed = approach(flat, start, matrix, 1e-8, most=60)
    monkeypatch.setattr(
        "drslamd.slam.optimizer.kept.fixed_point._mixed",
        lambda places, steps, gradients: places[-1] + steps[-1],
    )
    plain = approach(flat, start, matrix, 1e-8, most=60)
    assert mixed is not None
    assert plain is None or mixed.steps < plain.steps


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1.0])
def test_a_later_step_that_leads_astray_ends_it_without_an_answer(
    team: TeamProblem, wrong: float
) -> None:
    """One pose a metre away from those beside it, or nowhere."""
    right = solution(team)
    flat = Equations(team.problem, layout=BandLayout.flat(team.problem))
    near = Point.of(team.problem, right.poses + 0.001, right.calibration)
    matrix, asked = matrix_at(team, right), 0

    def solved(pulled: Array) -> Array:
        nonlocal asked
        asked += 1
        step = np.array(matrix.solved(pulled))
        if asked == 2:
            step[flat.layout.poses[3]] += wrong
        return step

    astray = cast(Current, SimpleNamespace(poses=matrix.poses, solved=solved))
    assert approach(flat, near, astray, 1e-12, most=4) is None
    assert asked == 2


def test_what_is_far_from_its_neighbours_or_slow_is_not_reached(team: TeamProblem) -> None:
    problem = team.problem
    right = solution(team)
    flat = Equations(problem, layout=BandLayout.flat(problem))
    matrix = matrix_at(team, right)
    near = Point.of(problem, right.poses + 0.001, right.calibration)
    assert approach(flat, near, matrix, 1e-6) is not None
    assert approach(flat, near, matrix, 1e-9, most=2) is None
    # one pose away from those beside it is far, all of them together are not
    poses = right.poses.copy()
    poses[-1, 0] += 5.0
    assert approach(flat, Point.of(problem, poses, right.calibration), matrix, 1e-6) is None
    beside = Point.of(problem, right.poses + [5.0, 0.0, 0.0], right.calibration)
    found = approach(flat, beside, matrix, 1e-6)
    assert found is not None
    assert np.abs(found.poses - right.poses).max() < 1e-6


def test_a_matrix_of_how_the_team_stood_leads_on_when_it_has_turned(team: TeamProblem) -> None:
    """With as many steps, but for two, as one of how it stands; turned about its first pose."""
    problem, right = team.problem, solution(team)
    flat = Equations(problem, layout=BandLayout.flat(problem))
    moved = right.poses + np.random.default_rng(1).normal(0, 0.005, right.poses.shape)
    start = Point.of(problem, moved, right.calibration)
    gauge = right.poses[problem.gauge, :2]
    places = (right.poses[:, :2] - gauge) @ [1, 1j] * np.exp(0.3j)
    turned = np.column_stack([places.real, places.imag, right.poses[:, 2] + 0.3])
    turned[:, :2] += gauge
    before = matrix_at(team, Point.of(problem, turned, right.calibration))
    assert np.abs(before.poses - right.poses).max() > 1.0
    by_that = approach(flat, start, before, 1e-7, most=40)
    by_this = approach(flat, start, matrix_at(team, right), 1e-7, most=40)
    assert by_that is not None
    assert by_this is not None
    assert by_that.steps <= by_this.steps + 2
    assert np.abs(by_that.poses - by_this.poses).max() < 1e-6
