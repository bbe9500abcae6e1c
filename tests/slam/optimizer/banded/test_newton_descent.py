"""Steps down the cost: where they end, how many there are, and what stops them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from dense_problems import packed, residual_vector, thresholds
from slam_problems import held_at, stuck, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded import newton_descent
from drslamd.slam.optimizer.banded.assembly import System
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.newton_descent import (
    FIRST_DAMPING,
    LITTLE_DAMPING,
    descend,
)
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.bias_prior import WHOLE
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

MOST = 60


def nothing(problem: Problem) -> Calibration:
    return Calibration.zero(problem.pairs, len(problem.priors.scale))


def from_start(problem: Problem, most: int = MOST) -> Point:
    return descend(Equations(problem), nothing(problem), most)


def cost_at(problem: Problem, point: Point) -> float:
    x = packed(point.poses, point.calibration)
    residuals = residual_vector(problem, x, point.threshold)
    return float(residuals @ residuals)


class Counted(Equations):
    """How often a matrix is made, and a gradient alone."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self.matrices = self.gradients = 0

    def at(self, *args: Any) -> tuple[System, Array]:
        self.matrices += 1
        return super().at(*args)

    def gradient(self, *args: Any) -> Array:
        self.gradients += 1
        return super().gradient(*args)


@pytest.mark.parametrize("seed", range(4))
def test_wherever_it_starts_it_comes_to_the_same_answer(seed: int) -> None:
    """Within a micrometre, though matrices are kept and thresholds move."""
    problem, _ = team_problem(3, robots=3, count=30, biases=(0.2, -0.1, 0.1))
    rng = np.random.default_rng(seed)
    ends = []
    for _ in range(2):
        away = problem.initial + rng.normal(0, 0.3, problem.initial.shape)
        away[0] = problem.initial[0]
        names = {"bias": 3, "scale": 3, "yaw": 3, "near_bias": 1, "team_bias": 1}
        began = {name: rng.normal(0, 0.02, n) for name, n in names.items()}
        start = replace(nothing(problem), **began)
        ends.append(descend(Equations(replace(problem, initial=away)), start, MOST))
    one, other = ends
    assert one.converged
    assert other.converged
    assert np.abs(one.poses - other.poses).max() < 1e-6
    for name in ("bias", "scale", "yaw", "near_bias", "team_bias"):
        apart = getattr(one.calibration, name) - getattr(other.calibration, name)
        assert np.abs(apart).max() < 1e-6


def test_the_end_is_a_minimum_of_the_dense_cost_with_the_thresholds_of_its_own_errors() -> None:
    problem, _ = team_problem(4, robots=2, count=9, range_error=0.02)
    point = from_start(problem)
    x = packed(point.poses, point.calibration)
    assert point.threshold == pytest.approx(thresholds(problem, x), rel=1e-3)
    assert 0.75 < point.threshold[0] < 2.4
    least = cost_at(problem, point)
    for k in range(len(x)):
        for step in (1e-4, -1e-4):
            moved = x.copy()
            moved[k] += step
            residuals = residual_vector(problem, moved, point.threshold)
            assert float(residuals @ residuals) > least


def test_near_the_end_the_matrix_is_kept_while_steps_shrink_fast() -> None:
    problem, _ = team_problem(3, robots=3, count=30)
    equations = Counted(problem)
    point = descend(equations, nothing(problem), MOST)
    assert point.converged
    assert equations.matrices + equations.gradients == point.steps
    assert equations.gradients >= 2
    assert equations.matrices <= 5


def driven_on(away_m: float) -> tuple[Problem, Calibration, Point]:
    """The solution of a team, a start beside it, and what the last keyframes are away from it."""
    problem, _ = team_problem(3, robots=3, count=60, scale=(0.02, -0.01, 0.01))
    right = from_start(problem)
    began = right.poses.copy()
    began[-3:, 0] += away_m
    # a way that bends a little, as solutions of two seconds do
    began[:, 1] += 0.002 * np.sin(np.linspace(0, 3, len(began)))
    return replace(problem, initial=began, gauge=0), right.calibration, right


def test_who_is_near_comes_to_the_end_with_fewer_matrices_because_nothing_holds_it_back() -> None:
    problem, known, _ = driven_on(0.01)
    found = []
    for is_near in (False, True):
        equations = Counted(problem)
        found.append((descend(equations, known, MOST, is_near=is_near), equations.matrices))
    (slow, many), (fast, few) = found
    assert slow.converged
    assert fast.converged
    assert few < many
    assert fast.steps < slow.steps
    assert np.abs(slow.poses - fast.poses).max() < 1e-6


def test_who_is_not_as_near_as_was_thought_goes_as_from_anywhere() -> None:
    problem, known, _ = driven_on(0.5)
    cautious = descend(Equations(problem), known, MOST)
    found = descend(Equations(problem), known, MOST, is_near=True)
    assert found.steps == cautious.steps + 1
    assert np.array_equal(found.poses, cautious.poses)


def hardly_held() -> Problem:
    """Three robots of whose first two seconds little is known, and how far they turned there."""
    problem, _ = team_problem(3, robots=3, count=60, closures=0)
    links, ranges = problem.odometry, problem.ranges
    covariance = links.covariance.copy()
    covariance[links.i < 6] = 100 * np.eye(3)
    later = ranges.chosen((ranges.i >= 9) & (ranges.j >= 9))
    return replace(problem, odometry=replace(links, covariance=covariance), ranges=later)


def turned(poses: Array, angle: float) -> Array:
    """All but the first three seconds about the first pose."""
    out: Array = poses.copy()
    later = slice(9, None)
    places = (poses[later, :2] - poses[0, :2]) @ [1, 1j] * np.exp(1j * angle)
    out[later, :2] = np.column_stack([places.real, places.imag]) + poses[0, :2]
    out[later, 2] += angle
    return out


@pytest.mark.parametrize("angle", [0.03, 0.3])
def test_a_team_that_is_hardly_held_turns_to_its_place_in_some_steps(angle: float) -> None:
    """Straight steps do not get there within hundreds."""
    problem = hardly_held()
    right = from_start(problem)
    away = replace(problem, initial=turned(right.poses, angle), gauge=0)
    assert np.abs(away.initial - right.poses).max() > 10 * angle
    found = descend(Equations(away), right.calibration, 30, is_near=True)
    assert right.converged
    assert found.converged
    assert np.abs(found.poses - right.poses).max() < 1e-6


def test_who_knows_where_the_team_is_turned_to_needs_no_second_derivative(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, known, _ = driven_on(0.01)
    asked = []
    monkeypatch.setattr(Equations, "add_curvature", lambda *args: asked.append(args))
    assert descend(Equations(problem), known, MOST, is_near=True).converged
    assert not asked


@pytest.mark.parametrize("fault", ["no factor", "no better"])
def test_a_first_step_in_vain_is_made_anew_with_the_usual_damping(
    fault: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, known, _ = driven_on(0.01)
    tried = []
    of, is_better = BandFactor.of, newton_descent._is_better

    def factor(system: System, damping: float = 0.0) -> BandFactor | None:
        tried.append(damping)
        return None if fault == "no factor" and len(tried) == 1 else of(system, damping)

    def better(*args: Any) -> bool:
        return is_better(*args) and not (fault == "no better" and len(tried) == 1)

    monkeypatch.setattr(BandFactor, "of", staticmethod(factor))
    monkeypatch.setattr(newton_descent, "_is_better", better)
    found = descend(Equations(problem), known, MOST, is_near=True)
    assert found.converged
    assert tried[:2] == [LITTLE_DAMPING, FIRST_DAMPING]


@pytest.mark.parametrize(("near", "faster", "kept"), [(0.0, 0.25, 0), (math.inf, 1e-9, 1)])
def test_a_matrix_is_not_kept_after_long_steps_nor_after_slow_ones(
    near: float, faster: float, kept: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first step is compared with none."""
    problem, _ = team_problem(3, robots=3, count=30)
    monkeypatch.setattr(newton_descent, "NEAR", near)
    monkeypatch.setattr(newton_descent, "FASTER", faster)
    equations = Counted(problem)
    assert descend(equations, nothing(problem), MOST).converged
    assert equations.gradients == kept


@pytest.mark.parametrize("most", [0, 1, 3])
def test_there_are_no_more_steps_than_allowed(most: int) -> None:
    problem, _ = team_problem(5, robots=2, count=20)
    far = problem.initial + np.random.default_rng(6).normal(0, 0.3, problem.initial.shape)
    point = from_start(replace(problem, initial=far), most)
    assert point.steps == most
    assert not point.converged
    if not most:
        assert np.array_equal(point.poses, far)


@pytest.mark.parametrize(("times", "is_enough"), [(1.01, True), (0.99, False)])
def test_a_step_that_is_shorter_than_the_tolerance_is_the_last(
    times: float, is_enough: bool
) -> None:
    problem, _ = team_problem(7, robots=2, count=10)
    one = from_start(problem, 1)
    length = float(np.abs(one.poses - problem.initial).max())
    point = descend(Equations(problem), nothing(problem), 1, tolerance=times * length)
    assert point.converged is is_enough


@pytest.mark.parametrize("seed", range(3))
def test_from_poses_a_third_of_a_radian_off_it_takes_few_steps(seed: int) -> None:
    """By weights, which no step overshoots; by curvatures alone, sixty are not enough."""
    problem, _ = team_problem(13, robots=3, count=30)
    rng = np.random.default_rng(seed)
    away = problem.initial + rng.normal(0, 0.3, problem.initial.shape)
    point = from_start(replace(problem, initial=away), 20)
    assert point.converged


def test_a_step_counts_as_long_as_it_moves_a_bias_or_an_antenna() -> None:
    """Of what else is learned the units are others."""
    step = Calibration.zero(2, 2)
    assert newton_descent._metres_of_sensors(step) == 0
    step.scale[:], step.yaw[:], step.turn[:], step.near_bias[:] = 9, 9, 9, 9
    assert newton_descent._metres_of_sensors(step) == 0
    step.bias[1] = -0.3
    assert newton_descent._metres_of_sensors(step) == 0.3
    step.antenna[1, 0] = -0.4
    assert newton_descent._metres_of_sensors(step) == 0.4
    assert newton_descent._metres_of_sensors(Calibration.zero(0, 0)) == 0


def test_where_many_ranges_are_outliers_the_last_steps_shrink_fast_too() -> None:
    """Robots that were stuck, so that Cauchy's cost bends down where many ranges are: by a tenth of
    their weight it took 86 steps."""
    steps = 0
    for seed in (1, 7, 8):
        problem, truth = team_problem(seed, robots=4, count=45, closures=6)
        point = from_start(stuck(held_at(problem, truth), 1, 25, 31))
        assert point.converged
        steps += point.steps
    assert steps < 60


def test_a_bias_that_goes_a_metre_is_a_long_step_however_short_those_of_the_poses_are() -> None:
    """A third of the ranges 0.2 m too long: the first step takes the bias of a pair to 1.1 m, where
    all of its ranges are outliers."""
    problem, truth = team_problem(3, robots=3, count=30)
    measured = problem.ranges.measured.copy()
    measured[::3] += 0.2
    problem = held_at(problem, truth)
    problem = replace(problem, ranges=replace(problem.ranges, measured=measured))
    first = from_start(problem, 1)
    assert np.abs(first.poses - problem.initial).max() < newton_descent.FAR
    assert first.calibration.bias[0] > 1
    assert from_start(problem, 12).converged


@pytest.mark.parametrize(
    ("size", "tried"), [(0.29, [0, 1, 1, 1]), (0.31, [0, 1, 2, 2]), (0.0, [0, 1, 1, 1])]
)
def test_what_did_not_help_is_tried_with_more_curvature_and_then_with_more_damping(
    size: float, tried: list[int]
) -> None:
    damping, level, found, dampings = 1e-6, 0, [], []
    for _ in range(4):
        found.append(level)
        dampings.append(damping)
        damping, level = newton_descent._stiffer(damping, level, size)
    assert found == tried
    rising = [tried.count(tried[k]) > 1 and tried[k] == tried[k - 1] for k in range(1, 4)]
    for k, is_damped in enumerate(rising, start=1):
        assert dampings[k] == pytest.approx(dampings[k - 1] * (10 if is_damped else 1))


class Indefinite(Equations):
    """The whole second derivative is never positive definite."""

    def at(self, *args: Any) -> tuple[System, Array]:
        system, gradient = super().at(*args)
        if args[1] == WHOLE:
            system.band[0, 4] = -1.0
        return system, gradient


def test_a_second_derivative_that_is_not_positive_definite_makes_no_step() -> None:
    """It goes on by less of it, to the same answer."""
    problem, _ = team_problem(3, robots=2, count=10)
    usual = from_start(problem)
    point = descend(Indefinite(problem), nothing(problem), MOST)
    assert point.converged
    assert np.abs(point.poses - usual.poses).max() < 1e-6


def test_no_step_makes_it_worse_at_the_thresholds_that_it_began_with() -> None:
    problem, _ = team_problem(8, robots=3, count=15)
    far = problem.initial + np.random.default_rng(2).normal(0, 1.0, problem.initial.shape)
    problem = replace(problem, initial=far)
    equations = Equations(problem)
    before = from_start(problem, 0)
    for most in range(1, 8):
        now = from_start(problem, most)
        costs = [equations.cost(p, before.threshold) for p in (before, now)]
        assert costs[1] <= costs[0] * (1 + 1e-9)
        before = now


def test_numbers_that_are_none_end_it_where_it_began() -> None:
    problem, _ = team_problem(9, robots=2, count=10)
    measured = problem.ranges.measured.copy()
    measured[3] = np.nan
    problem = replace(problem, ranges=replace(problem.ranges, measured=measured))
    point = from_start(problem)
    assert np.array_equal(point.poses, problem.initial)
    assert not point.converged
    # damping rises tenfold from 1e-6 until it is 1e6
    assert point.steps == 12


def test_a_start_that_is_the_end_takes_one_step() -> None:
    problem, _ = team_problem(10, robots=2, count=20)
    end = from_start(problem)
    again = descend(Equations(replace(problem, initial=end.poses)), end.calibration, MOST)
    assert again.steps == 1
    assert again.converged
    assert np.abs(again.poses - end.poses).max() < newton_descent.TOLERANCE
