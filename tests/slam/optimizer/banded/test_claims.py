"""What is claimed of a solution, against dense inverses and against drawn errors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from dense_problems import bias_places, claimed_information, learned_information, packed, unpacked
from slam_problems import held_at, no_ranges, pose_edges, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded import claims
from drslamd.slam.optimizer.banded.banded_solver import solve
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.range_model import LINKTRACK

SHARED = math.sqrt(1 + 2 * 0.64 * math.exp(-0.4) / (1 - math.exp(-0.4)))
"""How much more wrong ranges are together, one a second, whose slow part of 0.8 lasts 2.5 s."""


def solved(problem: Problem) -> tuple[Equations, Point]:
    equations = Equations(problem)
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return equations, descend(equations, start, 60)


def dense_claim(problem: Problem, point: Point, scatter: Array) -> Array:
    x = packed(point.poses, point.calibration, problem.doubted)
    ratio = SHARED * scatter
    return np.asarray(np.linalg.inv(claimed_information(problem, x, point.threshold, ratio)))


def dense_sigmas(problem: Problem, point: Point, scatter: Array) -> Array:
    x = packed(point.poses, point.calibration, problem.doubted)
    information = learned_information(problem, x, point.threshold, SHARED * scatter)
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(information))))


def far_edges() -> Problem:
    """One pose at the border, that many others are joined to."""
    problem, _ = team_problem(6, robots=2, count=14, closures=0)
    edges = pose_edges(
        np.random.default_rng(7),
        problem.initial,
        [(3, k) for k in range(20, 28, 2)] + [(9, 27)],
        (0.05, 0.05, 0.03),
    )
    return replace(problem, closures=edges)


@pytest.mark.parametrize("kind", ["band", "border"])
def test_covariances_are_blocks_of_the_dense_inverse_between_poses_too(kind: str) -> None:
    thinned = team_problem(5, robots=2, count=8, is_thinned=True)[0]
    problem = thinned if kind == "band" else far_edges()
    equations, point = solved(problem)
    assert point.converged
    wanted = np.array([15, 3, 9])
    joint, *_ = claims.covariances(equations, point, np.array([0.8]), wanted)
    inverse = dense_claim(problem, point, np.array([0.8]))
    at = (3 * wanted[:, None] + np.arange(3)).ravel()
    expected = inverse[np.ix_(at, at)]
    sigma = np.sqrt(np.diag(expected))
    assert joint.shape == (9, 9)
    assert np.abs((joint - expected) / np.outer(sigma, sigma)).max() < 1e-3


def test_sigmas_of_the_sensors_are_those_of_the_dense_inverse() -> None:
    problem, _ = team_problem(5, robots=3, count=8, is_thinned=True)
    equations, point = solved(problem)
    scatter = np.array([0.5, 1.0, 1.4])
    _, spread, _ = claims.covariances(equations, point, scatter, np.array([0]))
    _, expected = unpacked(problem, dense_sigmas(problem, point, scatter))
    for name in ("bias", "scale", "yaw", "near_bias", "team_bias", "turn", "antenna"):
        assert getattr(spread, name) == pytest.approx(getattr(expected, name), rel=1e-3)
    # far less than the 0.6 m that are configured
    assert spread.bias.max() < 0.3


def test_a_bias_is_told_as_the_likeness_of_the_team_leaves_it_and_feared_as_configured() -> None:
    """Poses are so uncertain as if each bias could be of any size that is configured."""
    problem, _ = team_problem(5, robots=3, count=8)
    equations, point = solved(problem)
    joint, spread, _ = claims.covariances(equations, point, np.ones(3), np.array([22]))
    prior = replace(problem.priors.bias, spread=0.01, team=0.01)
    alike = replace(problem, priors=replace(problem.priors, bias=prior))
    other, narrow, _ = claims.covariances(Equations(alike), point, np.ones(3), np.array([22]))
    assert np.allclose(joint, other, rtol=1e-9)
    assert narrow.bias.max() < 0.5 * spread.bias.max()


def test_where_nothing_tells_of_a_bias_it_may_be_as_wrong_as_teams_are() -> None:
    """It is held to 0.05 m, and half a metre is configured."""
    problem, _ = team_problem(5, robots=2, count=8)
    vague = replace(problem.ranges, sigma=np.full(len(problem.ranges), 100.0))
    equations, point = solved(replace(problem, ranges=vague))
    _, spread, biases = claims.covariances(equations, point, np.ones(1), np.array([0]))
    prior = problem.priors.bias
    own = 1 / (1 / (prior.spread**2 * prior.dof / (prior.dof - 2)) + prior.sigma**-2)
    assert biases[0] == pytest.approx(math.sqrt(own + prior.team_variance), rel=0.02)
    assert spread.bias[0] < biases[0] / 2


def test_how_wrong_biases_may_be_follows_from_what_is_claimed_with_priors_as_configured() -> None:
    problem, _ = team_problem(5, robots=3, count=8)
    equations, point = solved(problem)
    *_, biases = claims.covariances(equations, point, np.ones(3), np.array([0]))
    x = packed(point.poses, point.calibration, problem.doubted)
    wide = np.linalg.inv(claimed_information(problem, x, point.threshold, np.full(3, SHARED)))
    at = bias_places(problem)
    told = 1 / np.diag(wide)[at[:-1]] - problem.priors.bias.sigma**-2
    own = x[at[:-1]] - x[at[-1]]
    assert biases == pytest.approx(problem.priors.bias.sigmas(own, told), rel=1e-3)


def test_sigmas_of_mountings_in_doubt_are_those_of_the_dense_inverse() -> None:
    problem, truth = team_problem(5, robots=2, count=20)
    doubted = Doubted(np.array([True, False]), np.array([False, True]))
    equations, point = solved(replace(held_at(problem, truth), doubted=doubted))
    assert point.converged
    assert np.hypot(*point.calibration.antenna[1]) < 0.018
    joint, spread, _ = claims.covariances(equations, point, np.ones(1), np.array([39]))
    problem = equations.problem
    _, expected = unpacked(problem, dense_sigmas(problem, point, np.ones(1)))
    assert spread.turn == pytest.approx(expected.turn, rel=2e-3)
    assert spread.antenna == pytest.approx(expected.antenna, rel=2e-3)
    assert spread.turn[1] == 0
    assert spread.turn[0] > 0
    at = 3 * 39 + np.arange(3)
    assert np.allclose(joint, dense_claim(problem, point, np.ones(1))[np.ix_(at, at)], rtol=2e-3)


@pytest.mark.parametrize("sigmas", [2.99, 3.01, -2.99, -3.01])
def test_a_mounting_stays_in_doubt_where_it_is_three_sigmas_off(sigmas: float) -> None:
    is_off = abs(sigmas) > 3
    spread = replace(Calibration.zero(0, 2), turn=np.full(2, 0.1), antenna=np.full((2, 2), 0.02))
    learned = replace(
        Calibration.zero(0, 2),
        turn=np.array([0.1 * sigmas, 0.1 * sigmas]),
        antenna=np.array([[0.0, 0.02 * sigmas], [0.02 * sigmas, 0.0]]),
    )
    doubted = Doubted(np.array([True, False]), np.array([False, True]))
    found = claims.still_doubted(doubted, learned, spread)
    # those that were no unknowns cannot have become any
    assert found.track.tolist() == [is_off, False]
    assert found.antenna.tolist() == [False, is_off]
    one_axis = claims.still_doubted(Doubted(doubted.track, ~doubted.antenna), learned, spread)
    assert one_axis.antenna.tolist() == [is_off, False]


@pytest.mark.parametrize(("scatter", "counted"), [(0.1, 0.3), (0.29, 0.3), (0.31, 0.31)])
def test_no_range_is_claimed_to_be_more_than_three_times_better_than_configured(
    scatter: float, counted: float
) -> None:
    equations, point = solved(team_problem(5, robots=2, count=8)[0])
    found, expected = (
        claims.covariances(equations, point, np.array([s]), np.array([15]))[0]
        for s in (scatter, counted)
    )
    assert np.allclose(found, expected, rtol=1e-9)


def test_of_no_poses_nothing_is_claimed_but_of_the_sensors() -> None:
    equations, point = solved(team_problem(5, robots=2, count=8)[0])
    joint, spread, _ = claims.covariances(equations, point, np.ones(1), np.zeros(0, dtype=int))
    assert joint.shape == (0, 0)
    assert 0 < spread.bias[0] < 0.6


def test_of_poses_that_nothing_holds_nothing_is_known() -> None:
    problem, _ = team_problem(16, robots=2, count=10, closures=0)
    equations, point = solved(replace(problem, ranges=no_ranges(), pairs=0))
    joint, spread, _ = claims.covariances(equations, point, np.zeros(0), np.array([0, 1]))
    assert np.array_equal(joint, claims.UNKNOWN * np.eye(6))
    assert spread.scale.tolist() == [1000.0, 1000.0]


def test_scatter_is_that_of_the_errors_over_what_is_configured() -> None:
    """Sent with 0.05 m and configured with 0.1 m; the prior counts as twenty ranges of that."""
    problem, _ = team_problem(9, robots=2, count=40, range_error=0.06)
    problem = replace(problem, range_sigma=0.1)
    _, point = solved(problem)
    errors = []
    for m in range(40):
        apart = point.poses[2 * m + 1] - point.poses[2 * m]
        ends = [
            np.exp(1j * point.poses[k, 2]) * complex(*q[m])
            for k, q in ((2 * m, problem.ranges.q_i), (2 * m + 1, problem.ranges.q_j))
        ]
        distance = abs(complex(*apart[:2]) + ends[1] - ends[0])
        seen = distance + point.calibration.bias[0]
        near = point.calibration.near_bias[0] * math.exp(-distance / 3)
        errors.append(min(abs(seen + near - problem.ranges.measured[m]), 2.5 * 0.05))
    expected = math.sqrt((20 + np.sum(np.square(errors)) / 0.1**2) / 60)
    assert claims.scatter_of(problem, point) == pytest.approx([expected], rel=1e-6)
    assert 0.6 < expected < 0.85


def test_two_explanations_differ_by_the_short_way_around() -> None:
    _, point = solved(team_problem(5, robots=2, count=2, closures=0)[0])
    one = replace(point, poses=np.array([[1.0, 2.0, 3.1], [0.0, 0.0, 0.0]]))
    other = replace(one, poses=np.array([[1.5, 2.0, -3.1], [9.0, 9.0, 9.0]]))
    apart = np.array([-0.5, 0.0, 6.2 - 2 * math.pi])
    found = claims.disagreement(one, other, np.array([0]))
    assert np.allclose(found, np.outer(apart, apart))
    assert claims.disagreement(one, other, np.array([0, 1])).shape == (6, 6)


def slow_errors(rng: np.random.Generator, count: int, sigma: float) -> Array:
    """(count,) one a second, most of each lasting for 2.5 s."""
    keep, slow = math.exp(-1 / 2.5), [rng.normal()]
    for _ in range(count - 1):
        slow.append(keep * slow[-1] + math.sqrt(1 - keep**2) * rng.normal())
    share = LINKTRACK.slow_share
    return np.asarray(sigma * (share * np.array(slow) + 0.6 * rng.normal(size=count)))


@pytest.mark.slow
def test_errors_of_many_teams_are_as_large_as_is_claimed() -> None:
    """Sensors drawn as they are configured, ranges that share their errors as the model says."""
    scores = []
    for seed in range(120):
        rng = np.random.default_rng(1000 + seed)
        problem, truth = team_problem(
            100 + seed,
            robots=2,
            count=30,
            biases=(rng.normal(0, 0.6),),
            scale=tuple(rng.normal(0, 0.03, 2)),
            yaw=tuple(rng.normal(0, 0.01, 2)),
            near_bias=rng.normal(0, 0.1),
            range_error=0.0,
        )
        measured = problem.ranges.measured + slow_errors(rng, 30, 0.05)
        start = problem.initial.copy()
        start[0] = truth[0]
        problem = replace(problem, initial=start, ranges=replace(problem.ranges, measured=measured))
        solution = solve(problem, marginals=(59,), most=60)
        error = solution.poses[59] - truth[59]
        error[2] = math.remainder(error[2], 2 * math.pi)
        scores.append(float(error @ np.linalg.solve(solution.joint, error)) / 3)
    # the mean of 120 has a sigma of 0.075
    assert 0.7 < np.mean(scores) < 1.3
