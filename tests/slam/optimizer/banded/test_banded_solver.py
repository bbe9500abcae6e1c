"""The exact solution, against scipy's dense least squares, GTSAM and dense inverses."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from slam_problems import (
    jacobian,
    no_ranges,
    packed,
    pose_edges,
    range_weights,
    residual_vector,
    team_problem,
    unpacked,
)
from slam_scenes import Array, matrix, same_pose, wander

from drslamd.slam.optimizer.banded import banded_solver
from drslamd.slam.optimizer.banded.banded_solver import solve
from drslamd.slam.optimizer.problem import (
    Calibration,
    OdometryFactors,
    Priors,
    Problem,
)

gtsam = pytest.importorskip("gtsam", reason="gtsam has no wheel for this Python")


def dense_solution(problem: Problem) -> Array:
    """The unknowns at the minimum by scipy, started at the same poses."""
    x = packed(problem.initial, Calibration.zero(problem.priors))
    result = least_squares(
        lambda v: residual_vector(problem, v), x, method="lm", xtol=1e-13, ftol=1e-13
    )
    return np.asarray(result.x)


def loose(problem: Problem) -> Problem:
    """Without ranges and calibration: a pose graph for everybody's solver."""
    return replace(problem, ranges=no_ranges())


# ---- the minimum ----


@pytest.mark.parametrize(("seed", "robots"), [(0, 2), (1, 2), (2, 3)])
def test_the_solution_is_that_of_a_dense_solver(seed: int, robots: int) -> None:
    problem, _ = team_problem(seed, robots=robots, count=7, biases=(0.2, -0.1, 0.1))
    solution = solve(problem, tolerance=1e-10)
    poses, bias, scale, yaw, near_bias = unpacked(problem, dense_solution(problem))
    assert solution.converged
    for ours, theirs in zip(solution.poses, poses, strict=True):
        assert same_pose(ours, theirs, 1e-5)
    assert np.allclose(solution.calibration.bias, bias, atol=1e-5)
    assert np.allclose(solution.calibration.scale, scale, atol=1e-5)
    assert np.allclose(solution.calibration.yaw, yaw, atol=1e-5)
    assert np.allclose(solution.calibration.near_bias, near_bias, atol=1e-5)


def test_the_default_tolerance_is_far_below_every_noise() -> None:
    problem, _ = team_problem(3, robots=3, count=20)
    quick, slow = solve(problem), solve(problem, tolerance=1e-10)
    assert quick.iterations <= slow.iterations
    assert np.abs(quick.poses - slow.poses).max() < 1e-3
    assert quick.cost == pytest.approx(slow.cost, rel=1e-4)


def test_the_pose_graph_of_gtsam_has_the_same_minimum_and_marginals() -> None:
    """Errors a hundredth of the sigmas, so that its logarithm and our difference agree; its
    covariances are seen from the second pose of each edge, ours from the first."""
    rng = np.random.default_rng(4)
    truth = np.stack([wander(rng, 25, 0.4), wander(rng, 25, 0.4)], axis=1).reshape(-1, 3)
    chain = [(2 * k + r, 2 * k + 2 + r) for k in range(24) for r in range(2)]
    joined = [(0, 1), (10, 11), (24, 27), (40, 41), (40, 41), (48, 47)]
    links = pose_edges(rng, truth, chain, (0.05, 0.05, 0.02), 0.01)
    closures = pose_edges(rng, truth, joined, (0.1, 0.1, 0.05), 0.01)
    odometry = OdometryFactors(
        links.i,
        links.j,
        links.measured,
        links.covariance,
        np.zeros(len(links), dtype=int),
        np.zeros((len(links), 3)),
    )
    # calibration that is known to be nothing
    known = np.array([1e-9])
    priors = Priors(bias=np.zeros(0), scale=known, yaw=known, near_bias=known)
    start = truth + rng.normal(0, 0.02, truth.shape)
    start[0] = truth[0]
    problem = Problem(
        np.zeros(50, dtype=int), np.arange(50), start, 0, odometry, closures, no_ranges(), priors
    )
    solution = solve(problem, marginals=(0, 7, 48, 49), tolerance=1e-12)

    graph = gtsam.NonlinearFactorGraph()
    hold = gtsam.noiseModel.Isotropic.Sigma(3, 1e-5)
    graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*truth[0]), hold))
    for edges in (links, closures):
        for i, j, measured, covariance in zip(
            edges.i, edges.j, edges.measured, edges.covariance, strict=True
        ):
            turn = matrix((0, 0, -measured[2]))
            noise = gtsam.noiseModel.Gaussian.Covariance(turn @ covariance @ turn.T)
            graph.add(gtsam.BetweenFactorPose2(int(i), int(j), gtsam.Pose2(*measured), noise))
    values = gtsam.Values()
    for k, pose in enumerate(start):
        values.insert(k, gtsam.Pose2(*pose))
    params = gtsam.LevenbergMarquardtParams()
    params.setRelativeErrorTol(1e-15)
    params.setAbsoluteErrorTol(1e-15)
    best = gtsam.LevenbergMarquardtOptimizer(graph, values, params).optimize()
    for k in range(50):
        theirs = best.atPose2(k)
        assert same_pose(
            solution.poses[k], np.array([theirs.x(), theirs.y(), theirs.theta()]), 2e-6
        )
    marginals = gtsam.Marginals(graph, best)
    for k, ours in solution.covariances.items():
        turn = matrix((0, 0, best.atPose2(k).theta()))  # theirs are in the frame of the pose
        theirs = turn @ marginals.marginalCovariance(k) @ turn.T
        sigma = np.sqrt(np.diag(theirs))
        assert np.abs((ours - theirs) / np.outer(sigma, sigma)).max() < 2e-3


def test_marginals_are_blocks_of_the_dense_inverse_calibration_included() -> None:
    problem, _ = team_problem(5, robots=3, count=8)
    wanted = (0, 3, 22, 23)
    solution = solve(problem, marginals=wanted, tolerance=1e-10)
    x = packed(solution.poses, solution.calibration)
    j = jacobian(problem, x, robust=False)
    inverse = np.linalg.inv(j.T @ (range_weights(problem, x)[:, None] * j))
    assert list(solution.covariances) == list(wanted)
    for k in wanted:
        block = inverse[3 * k : 3 * k + 3, 3 * k : 3 * k + 3]
        assert np.allclose(solution.covariances[k], block, rtol=1e-3, atol=1e-12)


def test_what_is_said_of_the_calibration_is_the_end_of_the_dense_inverse() -> None:
    problem, _ = team_problem(5, robots=3, count=8)
    solution = solve(problem, marginals=(0,), tolerance=1e-10)
    x = packed(solution.poses, solution.calibration)
    j = jacobian(problem, x, robust=False)
    inverse = np.linalg.inv(j.T @ (range_weights(problem, x)[:, None] * j))
    _, bias, scale, yaw, near_bias = unpacked(problem, np.sqrt(np.diag(inverse)))
    assert solution.spread is not None
    assert np.allclose(solution.spread.bias, bias, rtol=1e-3)
    assert np.allclose(solution.spread.scale, scale, rtol=1e-3)
    assert np.allclose(solution.spread.yaw, yaw, rtol=1e-3)
    assert np.allclose(solution.spread.near_bias, near_bias, rtol=1e-3)


def test_marginals_of_poses_at_the_border_are_the_same() -> None:
    problem, _ = team_problem(6, robots=2, count=40, closures=0)
    far = [(9, k) for k in range(40, 80, 7)]
    edges = pose_edges(np.random.default_rng(7), problem.initial, far, (0.05, 0.05, 0.03))
    problem = replace(problem, closures=edges)
    solution = solve(problem, marginals=(9, 10), tolerance=1e-9)
    x = packed(solution.poses, solution.calibration)
    j = jacobian(problem, x, robust=False)
    inverse = np.linalg.inv(j.T @ (range_weights(problem, x)[:, None] * j))
    for k in (9, 10):
        block = inverse[3 * k : 3 * k + 3, 3 * k : 3 * k + 3]
        assert np.allclose(solution.covariances[k], block, rtol=1e-3, atol=1e-12)


def test_errors_of_many_teams_are_as_large_as_the_marginals_say() -> None:
    """Biases, scales and yaw rates drawn from their priors."""
    scores = []
    for seed in range(60):
        rng = np.random.default_rng(1000 + seed)
        problem, truth = team_problem(
            100 + seed,
            robots=2,
            count=15,
            biases=(rng.normal(0, 0.3),),
            scale=tuple(rng.normal(0, 0.03, 2)),
            yaw=tuple(rng.normal(0, 0.01, 2)),
        )
        start = problem.initial.copy()
        start[0] = truth[0]
        solution = solve(replace(problem, initial=start), marginals=(29,))
        error = solution.poses[29] - truth[29]
        error[2] = math.remainder(error[2], 2 * math.pi)
        scores.append(float(error @ np.linalg.solve(solution.covariances[29], error)) / 3)
    # the mean of 60 has a sigma of 0.105
    assert 0.7 < np.mean(scores) < 1.3


# ---- calibration and robustness ----


def test_bias_scale_and_yaw_rate_are_found() -> None:
    problem, truth = team_problem(
        8,
        robots=3,
        count=150,
        biases=(0.25, -0.2, 0.4),
        scale=(0.03, -0.02, 0.05),
        yaw=(0.01, -0.008, 0.0),
        range_error=0.02,
        link_sigma=(0.004, 0.004, 0.002),
    )
    start = problem.initial.copy()
    start[0] = truth[0]
    solution = solve(replace(problem, initial=start))
    assert solution.converged
    assert solution.calibration.bias == pytest.approx([0.25, -0.2, 0.4], abs=0.03)
    assert solution.calibration.scale == pytest.approx([0.03, -0.02, 0.05], abs=0.006)
    assert solution.calibration.yaw == pytest.approx([0.01, -0.008, 0.0], abs=0.002)
    assert np.hypot(*(solution.poses - truth)[:, :2].T).max() < 0.3
    three = np.full(3, 1e-9)
    known = Priors(bias=three, scale=three, yaw=three, near_bias=three[:1])
    fixed = replace(problem, priors=known)
    wrong = solve(replace(fixed, initial=start))
    assert np.hypot(*(wrong.poses - truth)[:, :2].T).max() > 0.9


def test_a_bias_that_only_near_ranges_have_is_found_and_told_from_that_of_the_pairs() -> None:
    """-0.25 m at no distance, as uncorrected modules have it, beside another bias of each pair."""
    problem, truth = team_problem(
        8,
        robots=3,
        count=150,
        biases=(0.25, -0.2, 0.4),
        near_bias=-0.25,
        range_error=0.02,
        link_sigma=(0.004, 0.004, 0.002),
    )
    start = problem.initial.copy()
    start[0] = truth[0]
    solution = solve(replace(problem, initial=start))
    assert solution.calibration.near_bias == pytest.approx([-0.25], abs=0.05)
    assert solution.calibration.bias == pytest.approx([0.25, -0.2, 0.4], abs=0.03)
    # what is held to zero goes elsewhere
    held = replace(problem.priors, near_bias=np.full(1, 1e-9))
    without = solve(replace(problem, initial=start, priors=held))
    assert without.calibration.near_bias == pytest.approx([0.0], abs=1e-6)
    assert without.cost > solution.cost + 20


def test_bursts_move_the_solution_by_less_than_it_is_known() -> None:
    """A fifth of the ranges 30 sigmas too long, all in a row."""
    problem, truth = team_problem(9, robots=2, count=60, range_error=0.03)
    start = problem.initial.copy()
    start[0] = truth[0]
    problem = replace(problem, initial=start)
    measured = problem.ranges.measured.copy()
    measured[20:32] += 1.5
    burst = solve(replace(problem, ranges=replace(problem.ranges, measured=measured)))
    good = np.ones(len(measured), dtype=bool)
    good[20:32] = False
    wanted = tuple(range(21, 120, 14))
    without = solve(replace(problem, ranges=problem.ranges.chosen(good)), marginals=wanted)
    for k in wanted:
        moved = burst.poses[k] - without.poses[k]
        assert moved @ np.linalg.solve(without.covariances[k], moved) < 1.0


def test_the_gauge_stays_where_it_was() -> None:
    problem, _ = team_problem(10, robots=2, count=20)
    for gauge in (0, 17):
        solution = solve(replace(problem, gauge=gauge), marginals=(gauge,))
        assert same_pose(solution.poses[gauge], problem.initial[gauge], 1e-5)
        assert np.sqrt(np.diag(solution.covariances[gauge])).max() < 1.1e-5


def test_calibration_that_nothing_touches_keeps_its_prior() -> None:
    problem, _ = team_problem(11, robots=2, count=20)
    priors = Priors(np.array([0.3, 0.3]), np.full(3, 0.03), np.full(3, 0.01), np.full(1, 0.1))
    wide, plain = solve(replace(problem, priors=priors)), solve(problem)
    assert np.allclose(wide.poses, plain.poses, atol=1e-6)
    assert wide.calibration.bias[1] == 0
    assert wide.calibration.scale[2] == wide.calibration.yaw[2] == 0


def test_a_solution_is_the_place_to_go_on_from() -> None:
    problem, _ = team_problem(12, robots=3, count=40)
    first = solve(problem)
    again = solve(replace(problem, initial=first.poses), first.calibration)
    assert again.iterations <= 2
    assert again.cost <= first.cost * (1 + 1e-9)


def test_angles_come_back_wrapped() -> None:
    problem, _ = team_problem(13, robots=2, count=10)
    turns = np.zeros_like(problem.initial)
    turns[:, 2] = 2 * math.pi * np.arange(len(turns))
    solution = solve(replace(problem, initial=problem.initial + turns))
    assert np.abs(solution.poses[:, 2]).max() <= math.pi
    plain = solve(problem)
    for ours, theirs in zip(solution.poses[1:], plain.poses[1:], strict=True):
        assert same_pose(ours, theirs, 1e-3)


# ---- when there is no solution, or not enough time ----


@pytest.mark.parametrize("most", [0, 1, 2])
def test_what_has_not_converged_does_not_say_so(most: int) -> None:
    problem, _ = team_problem(14, robots=3, count=40)
    far = problem.initial + np.random.default_rng(15).normal(0, 0.5, problem.initial.shape)
    solution = solve(replace(problem, initial=far), most=most)
    assert not solution.converged
    assert solution.iterations == most
    assert np.isfinite(solution.poses).all()


def test_enough_iterations_converge_from_there() -> None:
    problem, _ = team_problem(14, robots=3, count=40)
    far = problem.initial + np.random.default_rng(15).normal(0, 0.3, problem.initial.shape)
    assert solve(replace(problem, initial=far)).converged


def test_poses_that_nothing_holds_raise_nothing_and_are_unknown() -> None:
    problem, _ = team_problem(16, robots=2, count=10, closures=0)
    solution = solve(loose(problem), marginals=(0, 1))
    assert np.isfinite(solution.poses).all()
    assert np.linalg.eigvalsh(solution.covariances[1])[-1] >= banded_solver.UNKNOWN


def test_numbers_that_are_none_are_no_progress() -> None:
    problem, _ = team_problem(17, robots=2, count=10)
    measured = problem.ranges.measured.copy()
    measured[3] = np.nan
    strange = replace(problem, ranges=replace(problem.ranges, measured=measured))
    solution = solve(strange, marginals=(5,))
    assert not solution.converged
    assert np.array_equal(solution.poses[:, :2], problem.initial[:, :2])
    assert solution.covariances[5][0, 0] == banded_solver.UNKNOWN


@pytest.mark.slow
def test_a_robot_that_stood_for_ten_minutes_costs_little() -> None:
    """Two drove on and ranged it: without a border the band would be 1,200 poses wide."""
    rng = np.random.default_rng(19)
    problem, _ = team_problem(19, robots=2, count=600, closures=0)
    standing = [(0, k) for k in range(1, 1200)]
    edges = pose_edges(rng, problem.initial, standing, (0.3, 0.3, 0.2))
    began = time.perf_counter()
    solution = solve(replace(problem, closures=edges))
    assert solution.converged
    assert time.perf_counter() - began < 5.0
