"""The normal equations against dense residuals and finite differences, and where unknowns stand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_problems import (
    dense,
    jacobian,
    no_ranges,
    packed,
    pose_edges,
    range_weights,
    residual_vector,
    team_problem,
)
from slam_scenes import Array

from drslamd.slam.optimizer.banded.layout import BandLayout, border_poses
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.problem import Calibration, Problem
from drslamd.slam.optimizer.vertex_cover import vertex_cover


def somewhere(problem: Problem, seed: int) -> tuple[Array, Calibration]:
    """A point where nothing is zero."""
    rng = np.random.default_rng(seed)
    p = problem.priors
    calibration = Calibration(*(rng.normal(0, s) for s in (p.bias, p.scale, p.yaw, p.near_bias)))
    return problem.initial + rng.normal(0, 0.05, problem.initial.shape), calibration


@pytest.mark.parametrize("robots", [2, 3])
def test_gradient_hessian_and_cost_are_those_of_the_dense_residuals(robots: int) -> None:
    problem, _ = team_problem(1, robots=robots, count=6)
    poses, calibration = somewhere(problem, 2)
    x = packed(poses, calibration)
    equations = Equations(problem)
    system = equations.at(poses, calibration)
    robust = residual_vector(problem, x)
    assert system.cost == pytest.approx(float(robust @ robust), rel=1e-9)
    # the gradient is that of the robust cost itself ...
    gradient = jacobian(problem, x, robust=True).T @ robust
    layout = equations.layout
    order = np.concatenate(
        [layout.poses.ravel(), layout.bias, layout.scale, layout.yaw, layout.near_bias]
    )
    assert np.allclose(system.gradient[order], gradient, rtol=1e-5, atol=1e-4)
    # ... the Hessian that of Gauss and Newton, ranges by their weights
    j = jacobian(problem, x, robust=False)
    hessian = j.T @ (range_weights(problem, x)[:, None] * j)
    scale = np.sqrt(np.diag(hessian))
    assert np.abs((dense(system, layout) - hessian) / np.outer(scale, scale)).max() < 1e-6


def test_it_is_the_same_with_poses_at_the_border() -> None:
    """One pose that is ranged from all the others, and a gauge that reaches far."""
    problem, _ = team_problem(3, robots=2, count=40, closures=0)
    far = [(0, k) for k in range(30, 80, 7)] + [(9, 78)]
    edges = pose_edges(np.random.default_rng(4), problem.initial, far, (0.05, 0.05, 0.03))
    problem = replace(problem, closures=edges)
    layout = BandLayout.of(problem)
    assert layout.band == 3 * 78
    assert layout.width < 3 * 20
    poses, calibration = somewhere(problem, 5)
    equations = Equations(problem)
    x = packed(poses, calibration)
    j = jacobian(problem, x, robust=False)
    weights = range_weights(problem, x)
    hessian = j.T @ (weights[:, None] * j)
    scale = np.sqrt(np.diag(hessian))
    system = equations.at(poses, calibration)
    assert np.abs((dense(system, layout) - hessian) / np.outer(scale, scale)).max() < 1e-6


def test_every_unknown_stands_somewhere_and_only_once() -> None:
    problem, _ = team_problem(6, robots=3, count=30)
    layout = BandLayout.of(problem)
    parts = [layout.poses.ravel(), layout.bias, layout.scale, layout.yaw, layout.near_bias]
    numbers = np.sort(np.concatenate(parts))
    assert np.array_equal(numbers, np.arange(layout.band + layout.border))
    # links of three robots reach three poses: 3 * 3 + 2 below the diagonal
    assert layout.width == 3 * 3 + 3
    step = np.arange(len(numbers), dtype=float)
    assert layout.calibration(step).scale.tolist() == layout.scale.tolist()


def test_a_group_of_one_pose_has_a_layout() -> None:
    problem, _ = team_problem(7, robots=1, count=1, closures=0)
    problem = replace(problem, ranges=no_ranges())
    layout = BandLayout.of(problem)
    assert (layout.band, layout.width) == (3, 3)


@pytest.mark.parametrize(("reach", "apart"), [(20, 0), (21, 1)])
def test_poses_are_taken_out_only_beyond_the_reach_that_needs_no_attention(
    reach: int, apart: int
) -> None:
    i = np.array([0, 1, 2, 50])
    assert len(border_poses(i, i + [1, 1, 1, reach], narrow=20)) == apart


def test_the_pose_of_one_who_stands_is_enough_for_all_its_edges() -> None:
    i, j = np.full(500, 7), np.arange(500)
    assert border_poses(i, j, narrow=20).tolist() == [7]


def test_what_is_left_in_the_band_is_narrow_and_few_are_at_the_border() -> None:
    rng = np.random.default_rng(8)
    i = np.arange(1000)
    j = np.minimum(i + rng.integers(1, 6, 1000), 999)
    hubs = rng.choice(1000, 12, replace=False)
    i = np.concatenate([i, np.repeat(hubs, 40)])
    j = np.concatenate([j, rng.integers(0, 1000, 480)])
    apart = border_poses(i, j, narrow=20)
    assert set(apart.tolist()) <= set(hubs.tolist())
    left = ~np.isin(i, apart) & ~np.isin(j, apart)
    assert np.abs(i - j)[left].max() <= 20


def test_edges_all_over_the_place_widen_the_band_instead() -> None:
    rng = np.random.default_rng(9)
    i, j = rng.integers(0, 300, (2, 2000))
    apart = border_poses(i, j, narrow=20)
    left = ~np.isin(i, apart) & ~np.isin(j, apart)
    reach = int(np.abs(i - j)[left].max(initial=0))
    assert len(apart) <= 160
    assert reach <= 320


def test_the_busiest_come_first_and_no_more_than_asked_for() -> None:
    i, j = np.array([1, 1, 1, 2, 2, 3]), np.array([4, 5, 6, 4, 5, 9])
    assert vertex_cover(i, j, 1).tolist() == [1]
    assert vertex_cover(i, j, 2).tolist() == [1, 2]
    assert len(vertex_cover(i, j, 10)) == 3
    assert vertex_cover(i[:0], j[:0], 5).tolist() == []
