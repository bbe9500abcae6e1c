"""The normal equations against dense residuals and finite differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_problems import (
    dense,
    jacobian,
    packed,
    pose_edges,
    range_weights,
    residual_vector,
    team_problem,
)
from slam_scenes import Array

from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.problem import Calibration, Problem


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
