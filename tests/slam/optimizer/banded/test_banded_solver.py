"""The exact solution, against scipy's dense least squares, GTSAM and dense inverses."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from dense_problems import (
    claimed_information,
    dense_solution,
    known_exactly,
    learned_information,
    packed,
    point_at,
    residual_vector,
    thresholds,
    unpacked,
)
from machine_speed import allowed_s
from places import Recorded
from slam_problems import (
    BIAS,
    held_at,
    links_of,
    mismounted,
    no_ranges,
    pose_edges,
    slipping,
    team_problem,
)
from slam_scenes import matrix, same_pose, wander

from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.banded_solver import solve
from drslamd.slam.optimizer.banded.claims import UNKNOWN, covariances
from drslamd.slam.optimizer.banded.explanation import explain
from drslamd.slam.optimizer.banded.lapses.stretches import with_freed
from drslamd.slam.optimizer.banded.misfit import guessed_misfit
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.odometry_levels import FIRST_LEVEL
from drslamd.slam.optimizer.problem import Doubted, Freed, OdometryFactors, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration, Priors

gtsam = pytest.importorskip("gtsam", reason="gtsam has no wheel for this Python")


def loose(problem: Problem) -> Problem:
    """Without ranges and calibration: a pose graph for everybody's solver."""
    return replace(problem, ranges=no_ranges(), pairs=0)


# the minimum


def test_with_mountings_in_doubt_the_solution_is_that_of_a_dense_solver_too() -> None:
    problem, truth = team_problem(
        6,
        robots=2,
        count=8,
        range_error=0.01,
        link_sigma=(0.004, 0.004, 0.001),
        is_thinned=True,
    )
    beside = ((0.0, 0.0), (0.4, 0.3))
    problem = mismounted(held_at(problem, truth), truth, (0.5, 0.0), beside, turned_sigma=0.2)
    doubted = Doubted(np.array([True, False]), np.array([False, True]))
    # (in so short a way a track that is off looks like a yaw rate)
    priors = replace(problem.priors, yaw=np.full(2, 0.001))
    problem = replace(problem, doubted=doubted, priors=priors)
    solution = solve(problem, tolerance=1e-10, most=100)
    x, _ = dense_solution(problem)
    poses, known = unpacked(problem, x)
    assert solution.converged
    assert np.abs(solution.poses[:, :2] - poses[:, :2]).max() < 1e-4
    assert solution.calibration.turn == pytest.approx(known.turn, abs=1e-4)
    assert solution.calibration.antenna == pytest.approx(known.antenna, abs=1e-4)
    assert abs(known.turn[0]) > 0.1
    assert np.abs(known.antenna[1]).min() > 0.1


def test_a_track_that_is_far_off_is_let_go_and_said() -> None:
    """Beside who stays as configured; what is claimed of poses and turn is true."""
    problem, truth = team_problem(7, robots=3, count=120)
    problem = mismounted(held_at(problem, truth), truth, (0.0, 0.35, 0.0))
    last = 3 * 119 + 1
    solution = solve(problem, marginals=(last,))
    assert solution.converged
    assert solution.is_explained
    assert solution.doubted.track.tolist() == [False, True, False]
    assert not solution.doubted.antenna.any()
    assert solution.spread is not None
    off = solution.calibration.turn[1] - 0.35
    assert abs(off) < 3 * solution.spread.turn[1] < 0.15
    error = solution.poses[last] - truth[last]
    error[2] = math.remainder(error[2], 2 * math.pi)
    assert error @ np.linalg.solve(solution.joint, error) < 14.2
    assert (solution.odometry_level == 1).all()
    assert solution.feared_level.min() >= 1
    assert solution.feared_level.max() < 1.5
    plain = solve(team_problem(7, robots=3, count=120)[0])
    assert not plain.doubted.any()
    assert (plain.calibration.turn == 0).all()


@pytest.mark.parametrize(("seed", "robots"), [(0, 2), (1, 2), (2, 3)])
def test_the_solution_is_that_of_a_dense_solver(seed: int, robots: int) -> None:
    problem, _ = team_problem(
        seed, robots=robots, count=7, biases=(0.2, -0.1, 0.1), is_thinned=True
    )
    solution = solve(problem, tolerance=1e-10)
    x, threshold = dense_solution(problem)
    poses, known = unpacked(problem, x)
    assert solution.converged
    for ours, theirs in zip(solution.poses, poses, strict=True):
        assert same_pose(ours, theirs, 1e-5)
    for name in ("bias", "scale", "yaw", "near_bias", "team_bias"):
        assert np.allclose(getattr(solution.calibration, name), getattr(known, name), atol=1e-5)
    residuals = residual_vector(problem, x, threshold)
    assert solution.cost == pytest.approx(float(residuals @ residuals), rel=1e-4)


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
        robot=np.zeros(len(links), dtype=int),
        by_yaw=np.zeros((len(links), 3)),
        by_turn=np.zeros((len(links), 3)),
    )
    # calibration that is known to be nothing
    known = np.array([1e-9])
    priors = Priors(BIAS, scale=known, scale_tails=1.0, yaw=known, near_bias=1e-9)
    start = truth + rng.normal(0, 0.02, truth.shape)
    start[0] = truth[0]
    robot, n = np.zeros(50, dtype=int), np.arange(50)
    factors = (odometry, closures, no_ranges())
    problem = Problem(robot, n, start, 0, 0, *factors, priors, Doubted.none(1))
    wanted = (0, 7, 48, 49)
    solution = solve(problem, marginals=wanted, tolerance=1e-12)

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
    for number, k in enumerate(wanted):
        ours = solution.joint[3 * number : 3 * number + 3, 3 * number : 3 * number + 3]
        turn = matrix((0, 0, best.atPose2(k).theta()))  # theirs are in the frame of the pose
        theirs = turn @ marginals.marginalCovariance(k) @ turn.T
        sigma = np.sqrt(np.diag(theirs))
        assert np.abs((ours - theirs) / np.outer(sigma, sigma)).max() < 2e-3


def test_what_is_claimed_is_the_dense_inverse_with_odometry_as_bad_as_it_looks() -> None:
    """Links 1.6 times as wrong as configured; poses in the order in which they are asked for."""
    problem, _ = team_problem(5, robots=3, count=12, link_error=1.6, is_thinned=True)
    wanted = np.array([35, 3, 22])
    solution = solve(problem, marginals=tuple(wanted), tolerance=1e-10)
    x, links = packed(solution.poses, solution.calibration), problem.odometry
    point = point_at(problem, solution.poses, solution.calibration, thresholds(problem, x))
    equations = Equations(problem)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    ratio = np.maximum(guessed_misfit(equations, point, factor).ratio(links.robot, 3), 1.0)
    assert 1.2 < ratio.max() < 3
    covariance = ratio[links.robot][:, None, None] * links.covariance
    covariance += (ratio - 1)[links.robot][:, None, None] * 0.004**2 * np.eye(3)
    worse = replace(problem, odometry=replace(links, covariance=covariance))
    claims = math.sqrt(1 + 1.28 / (math.exp(0.4) - 1)) * np.maximum(solution.scatter, 0.3)
    inverse = np.linalg.inv(claimed_information(worse, x, point.threshold, claims))
    learned = np.linalg.inv(learned_information(worse, x, point.threshold, claims))
    at = (3 * wanted[:, None] + np.arange(3)).ravel()
    expected = inverse[np.ix_(at, at)]
    sigma = np.sqrt(np.diag(expected))
    assert np.abs((solution.joint - expected) / np.outer(sigma, sigma)).max() < 2e-3
    assert solution.spread is not None
    _, spread = unpacked(problem, np.sqrt(np.diag(learned)))
    for name in ("bias", "scale", "yaw", "near_bias", "team_bias"):
        assert getattr(solution.spread, name) == pytest.approx(getattr(spread, name), rel=2e-3)
    assert solution.odometry_level == pytest.approx(1.0)
    assert solution.is_explained


@pytest.mark.row("M2")
def test_where_somebody_slipped_the_solution_is_the_one_that_explains_it() -> None:
    problem, truth = team_problem(3, robots=4, count=45, closures=6)
    problem = slipping(held_at(problem, truth), 1, 25, 31)
    solution = solve(problem, marginals=(4 * 44 + 1, 4 * 44 + 2), most=60)
    assert solution.converged
    assert solution.is_explained
    slipped = links_of(problem, 1, 25, 31)
    assert solution.odometry_level[slipped].min() > 10
    assert np.median(solution.odometry_level) == 1
    assert (solution.feared_level >= solution.odometry_level).all()
    assert not solution.doubted.any()
    error = solution.poses - truth
    error[:, 2] = np.angle(np.exp(1j * error[:, 2]))
    assert np.hypot(*error[:, :2].T).max() < 0.7
    for number, k in enumerate((4 * 44 + 1, 4 * 44 + 2)):
        block = slice(3 * number, 3 * number + 3)
        assert error[k] @ np.linalg.solve(solution.joint[block, block], error[k]) < 14.2


@pytest.mark.parametrize(("count", "is_news"), [(41, True), (45, False)])
def test_a_stretch_that_was_freed_is_told_and_feared_until_ranges_have_shown_where_it_led(
    count: int, is_news: bool
) -> None:
    """It ends with keyframe 32. Who knew of it before relies on the solution ten seconds later."""
    problem, truth = team_problem(3, robots=3, count=count, closures=6)
    first = solve(slipping(held_at(problem, truth), 1, 25, 31), most=60)
    (freed,) = first.freed
    slipped = links_of(problem, 1, 24, 32)
    assert sorted(freed.links.tolist()) == slipped.tolist()
    others = np.setdiff1d(np.arange(len(problem.odometry)), slipped)
    # a solution with news is none to go on from
    assert (first.odometry_level[slipped] == FIRST_LEVEL).all()
    assert (first.odometry_level[others] == 1).all()
    assert freed.is_settled is not is_news
    wider = with_freed(slipping(held_at(problem, truth), 1, 25, 31), freed)
    again = solve(wider, most=60)
    assert [one.links.tolist() for one in again.freed] == [freed.links.tolist()]
    assert (again.odometry_level[slipped] == (FIRST_LEVEL if is_news else 1)).all()
    assert (again.feared_level >= again.odometry_level).all()
    late = np.flatnonzero(again.late_level == FIRST_LEVEL)
    assert late.tolist() == (links_of(problem, 1, 24, 41).tolist() if is_news else [])


def test_a_stretch_along_which_wheels_were_right_is_freed_no_longer() -> None:
    problem, truth = team_problem(3, robots=3, count=45, closures=6)
    problem = held_at(problem, truth)
    # (between two keyframes with ranges little is left to freedom)
    links = links_of(problem, 1, 10, 11)
    freed = Freed(1, links, 0.02**2 * np.eye(3)[None], stands=False)
    solution = solve(with_freed(problem, freed), most=60)
    assert solution.freed == ()
    assert (solution.odometry_level[links] == FIRST_LEVEL).all()


def test_where_nobody_can_say_who_is_wrong_poses_stay_and_their_covariances_grow() -> None:
    """The ranges of one pair a metre too short in the last ten seconds."""
    problem, _ = team_problem(1, robots=4, count=45, closures=6)
    ranges, wanted = problem.ranges, np.arange(4 * 44, 4 * 45)
    wrong = (ranges.pair == 0) & (ranges.i >= 4 * 35)
    problem = replace(problem, ranges=replace(ranges, measured=ranges.measured - wrong))
    equations, nothing = Equations(problem), Calibration.zero(problem.pairs, 4)
    nominal = descend(equations, nothing, 60)
    solution = solve(problem, marginals=tuple(wanted), most=60)
    assert not solution.is_explained
    assert np.abs(solution.poses[:, :2] - nominal.poses[:, :2]).max() == 0
    assert solution.calibration is not None
    # at least by how far both explanations are apart
    other = explain(equations, nominal, 60, 3e-7).other
    assert other is not None
    apart = (nominal.poses - other.poses)[wanted]
    apart[:, 2] = np.angle(np.exp(1j * apart[:, 2]))
    plain, *_ = covariances(equations, nominal, solution.scatter, wanted)
    grown = solution.joint - plain - np.outer(apart, apart)
    assert np.abs(apart).max() > 0.05
    assert np.linalg.eigvalsh(grown)[0] > -1e-6


# calibration and robustness


@pytest.mark.row("M8")
def test_bias_scale_and_yaw_rate_are_found(record_property: Recorded) -> None:
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
    problem = held_at(problem, truth)
    solution = solve(problem)
    assert solution.converged
    assert solution.calibration.bias == pytest.approx([0.25, -0.2, 0.4], abs=0.03)
    record_property(
        "measured",
        f"off by {np.abs(np.array(solution.calibration.bias) - [0.25, -0.2, 0.4]).max():.3f} m",
    )
    assert solution.calibration.scale == pytest.approx([0.03, -0.02, 0.05], abs=0.006)
    assert solution.calibration.yaw == pytest.approx([0.01, -0.008, 0.0], abs=0.002)
    assert np.hypot(*(solution.poses - truth)[:, :2].T).max() < 0.3
    wrong = solve(known_exactly(problem))
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
    problem = held_at(problem, truth)
    # a prior of 0.1 m would draw it a quarter of the way to nothing
    problem = replace(problem, priors=replace(problem.priors, near_bias=0.5))
    solution = solve(problem)
    assert solution.calibration.near_bias == pytest.approx([-0.25], abs=0.05)
    assert solution.calibration.bias == pytest.approx([0.25, -0.2, 0.4], abs=0.03)
    # what is held to zero goes elsewhere
    held = replace(problem.priors, near_bias=1e-9)
    without = solve(replace(problem, priors=held))
    assert without.calibration.near_bias == pytest.approx([0.0], abs=1e-6)
    assert without.cost > solution.cost + 20


def test_bursts_move_the_solution_by_less_than_it_is_known() -> None:
    """A fifth of the ranges 30 sigmas too long, all in a row."""
    problem, truth = team_problem(9, robots=2, count=60, range_error=0.03)
    problem = held_at(problem, truth)
    measured = problem.ranges.measured.copy()
    measured[20:32] += 1.5
    burst = solve(replace(problem, ranges=replace(problem.ranges, measured=measured)))
    good = np.ones(len(measured), dtype=bool)
    good[20:32] = False
    wanted = tuple(range(21, 120, 14))
    without = solve(replace(problem, ranges=problem.ranges.chosen(good)), marginals=wanted)
    for number, k in enumerate(wanted):
        moved = burst.poses[k] - without.poses[k]
        block = slice(3 * number, 3 * number + 3)
        assert moved @ np.linalg.solve(without.joint[block, block], moved) < 1.0


def test_the_gauge_stays_where_it_was() -> None:
    problem, _ = team_problem(10, robots=2, count=20)
    for gauge in (0, 17):
        solution = solve(replace(problem, gauge=gauge), marginals=(gauge,))
        assert same_pose(solution.poses[gauge], problem.initial[gauge], 1e-5)
        assert np.sqrt(np.diag(solution.joint)).max() < 1.1e-5


def test_calibration_that_nothing_touches_keeps_its_prior() -> None:
    problem, _ = team_problem(11, robots=2, count=20)
    priors = replace(problem.priors, scale=np.full(3, 0.06), yaw=np.full(3, 0.01))
    wide = solve(replace(problem, priors=priors, doubted=Doubted.none(3)))
    plain = solve(problem)
    assert np.allclose(wide.poses, plain.poses, atol=1e-6)
    assert wide.calibration.scale[2] == wide.calibration.yaw[2] == 0
    assert wide.spread is not None
    assert wide.spread.scale[2] == pytest.approx(0.06)
    assert wide.spread.yaw[2] == pytest.approx(0.01)


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


# when there is no solution, or not enough time


@pytest.mark.parametrize("most", [0, 1, 2])
@pytest.mark.row("O12")
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
    assert np.linalg.eigvalsh(solution.joint[3:, 3:])[-1] >= UNKNOWN


def test_numbers_that_are_none_are_no_progress() -> None:
    problem, _ = team_problem(17, robots=2, count=10)
    measured = problem.ranges.measured.copy()
    measured[3] = np.nan
    strange = replace(problem, ranges=replace(problem.ranges, measured=measured))
    solution = solve(strange, marginals=(5,))
    assert not solution.converged
    assert np.array_equal(solution.poses[:, :2], problem.initial[:, :2])
    assert solution.joint[0, 0] == UNKNOWN


@pytest.mark.slow
def test_a_robot_that_stood_for_ten_minutes_costs_little() -> None:
    """Two drove on and ranged it: without a border the band would be 1,200 poses wide."""
    rng = np.random.default_rng(19)
    problem, _ = team_problem(19, robots=2, count=600, closures=0)
    standing = [(0, k) for k in range(1, 1200)]
    edges = pose_edges(rng, problem.initial, standing, (0.3, 0.3, 0.2))
    began = time.process_time()
    solution = solve(replace(problem, closures=edges))
    took = time.process_time() - began
    assert solution.converged
    assert took < allowed_s(5.0)
