"""A group's graph, built as a problem, solved, and sorted by robot again."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import (
    BANDED,
    NOISE,
    Array,
    closure,
    group_of,
    inverted,
    keyframes,
    product,
    range_item,
    small_team,
)

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer.banded.banded_optimizer import (
    YAW_PRIOR_FLOOR,
    build_problem,
)
from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.robot_model import RobotModel


def solved(graph: PoseGraph, group: Group, previous: TeamEstimate | None = None) -> TeamEstimate:
    return BANDED.job(graph, group, previous, {})()


def errors(estimate: TeamEstimate, truth: dict[int, Array]) -> float:
    """Largest distance from the truth, in the frame of robot 0's first pose."""
    origin = inverted(truth[0][0])
    worst = 0.0
    for robot, trajectory in estimate.trajectories.items():
        for pose, true in zip(trajectory.poses, truth[robot], strict=True):
            worst = max(worst, float(np.hypot(*(pose - product(origin, true))[:2])))
    return worst


def test_a_team_is_solved_in_the_frame_of_its_lowest_robot() -> None:
    team = small_team(1, count=60, biases={(0, 1): 0.3, (1, 2): -0.2})
    group = group_of(team.graph)
    estimate = solved(team.graph, group)
    assert estimate.converged
    assert estimate.frame == Segment(*team.chains[0], 0)
    assert np.allclose(estimate.trajectories[0].poses[0], 0, atol=1e-6)
    assert {r: t.n.tolist() for r, t in estimate.trajectories.items()} == {
        r: n.tolist() for r, n in team.n.items()
    }
    assert errors(estimate, team.truth) < 0.7
    assert set(estimate.covariances) == {0, 1, 2}
    for robot, covariance in estimate.covariances.items():
        error = estimate.trajectories[robot].poses[-1] - product(
            inverted(team.truth[0][0]), team.truth[robot][-1]
        )
        error[2] = math.remainder(error[2], 2 * math.pi)
        assert error @ np.linalg.solve(covariance, error) < 14.2


def test_biases_are_named_by_their_pairs_and_scales_by_their_robots() -> None:
    true = {(0, 1): 0.4, (0, 2): 0.0, (1, 2): -0.3}
    team = small_team(2, count=150, range_sigma=0.01, biases=true)
    estimate = solved(team.graph, group_of(team.graph))
    for pair, bias in true.items():
        found = estimate.bias_m[pair]
        assert found.value == pytest.approx(bias, abs=0.15)
        assert abs(found.value - bias) < 2 * found.sigma < 0.6
    assert set(estimate.scale) == set(estimate.yaw) == {0, 1, 2}


def test_what_strong_signals_do_is_one_constant_of_the_team() -> None:
    """Found where it may be large; its sigma is that of what was measured, without the prior."""
    team = small_team(2, count=150, range_sigma=0.01)
    graph = PoseGraph()
    for chain, entry in team.entries:
        near = [0.6 * math.exp(-r.range_m / LINKTRACK.near_reach_m) for r in entry.ranges]
        short = [replace(r, range_m=r.range_m - m) for r, m in zip(entry.ranges, near, strict=True)]
        graph.insert(chain, replace(entry, ranges=tuple(short)))
    group = group_of(graph)
    held = solved(graph, group).near_bias_m
    loose = replace(BANDED, model=replace(LINKTRACK, near_bias_sigma_m=1.0))
    free = loose.job(graph, group, None, {})().near_bias_m
    assert abs(free.value + 0.6) < 3 * free.sigma
    assert free.value < held.value < 0
    assert held.sigma == pytest.approx(free.sigma, rel=0.3)
    assert abs(held.value) < 2 * LINKTRACK.near_bias_sigma_m


def test_priors_are_those_of_the_robots_and_of_the_configuration() -> None:
    team = small_team(3)
    still = replace(NOISE, yaw_rad_per_m=1e-6, scale=0.07)
    team.graph.insert(team.chains[1], GraphEntry(9, RobotModel(still)))
    problem = build_problem(
        team.graph, group_of(team.graph), None, replace(BANDED, bias_sigma=0.25)
    ).problem
    assert problem.priors.bias == pytest.approx(0.25 / 3)
    assert problem.priors.scale == pytest.approx([0.01, 0.07 / 3, 0.01])
    assert problem.priors.yaw == pytest.approx(
        [NOISE.yaw_rad_per_m, YAW_PRIOR_FLOOR, NOISE.yaw_rad_per_m]
    )
    assert problem.priors.near_bias == pytest.approx([LINKTRACK.near_bias_sigma_m])


def test_the_next_solution_goes_on_from_the_last_one() -> None:
    team = small_team(4, count=60)
    group = group_of(team.graph)
    first = solved(team.graph, group)
    problem_and_start = build_problem(team.graph, group, first, BANDED)
    assert problem_and_start.start.scale.tolist() == [first.scale[r].value for r in range(3)]
    assert problem_and_start.start.near_bias.tolist() == [first.near_bias_m.value] != [0.0]
    again = solved(team.graph, group, first)
    assert again.iterations <= 2
    for robot, trajectory in again.trajectories.items():
        assert np.abs(trajectory.poses - first.trajectories[robot].poses).max() < 1e-3


def test_the_frame_is_where_its_odometry_begins_whatever_anybody_remembers() -> None:
    """Who solved many times does not carry the frame away by what each solution was off."""
    team = small_team(12, count=20)
    group = group_of(team.graph)
    first = solved(team.graph, group)
    astray = {
        r: replace(t, poses=t.poses + [1e-3, 0.0, 1e-3]) for r, t in first.trajectories.items()
    }
    problem = build_problem(team.graph, group, replace(first, trajectories=astray), BANDED).problem
    own = team.graph.chains[0].keyframes.poses[0]
    assert problem.initial[problem.gauge].tolist() == own.tolist()


def test_two_robots_with_the_same_items_agree_whatever_their_history() -> None:
    team = small_team(5, count=60)
    one = solved(team.graph, group_of(team.graph))
    half = PoseGraph()
    for chain, entry in team.entries:
        half.insert(chain, replace(entry, keyframes=entry.keyframes[:30]))
    earlier = solved(half, group_of(half))
    other = solved(team.graph, group_of(team.graph), earlier)
    for robot, trajectory in one.trajectories.items():
        assert np.abs(trajectory.poses - other.trajectories[robot].poses).max() < 1e-3


def test_clocks_that_differ_leave_the_problem_narrow() -> None:
    """Robots count from 0, 1000 and 2000; nobody is told but by the measurements."""
    team = small_team(6, count=60)
    problem = build_problem(team.graph, group_of(team.graph), None, BANDED).problem
    reach = max(int(np.abs(e.i - e.j).max()) for e in (problem.odometry, problem.ranges))
    assert reach <= 3


def test_closures_hold_together_what_has_no_ranges() -> None:
    team = small_team(7, count=30, closure_sigma=0.0)
    entries = [(chain, replace(entry, ranges=())) for chain, entry in team.entries]
    graph = PoseGraph()
    for chain, entry in entries:
        graph.insert(chain, entry)
    estimate = solved(graph, group_of(graph))
    assert estimate.converged
    assert errors(estimate, team.truth) < 0.5
    sigma = math.sqrt(estimate.covariances[2][0, 0])
    assert 1.0 < sigma < 100.0


def test_where_there_are_ranges_closures_count_for_nothing() -> None:
    """One closure off by a metre moves nobody by a centimetre."""
    team = small_team(8, count=60)
    group = group_of(team.graph)
    plain = solved(team.graph, group)
    a_T_b = product(inverted(team.truth[0][30]), team.truth[1][30]) + [1.0, 0, 0]
    wrong = closure(900, int(team.n[0][30]), team.chains[1], int(team.n[1][30]), a_T_b, 0.02)
    team.graph.insert(team.chains[0], GraphEntry(9, closures=(wrong,)))
    moved = solved(team.graph, group)
    for robot, trajectory in plain.trajectories.items():
        off = (trajectory.poses - moved.trajectories[robot].poses)[:, :2]
        assert np.hypot(*off.T).max() < 0.02


@pytest.mark.slow
def test_ranges_all_over_the_time_do_not_stop_the_team() -> None:
    """A robot whose messages are nonsense: 5,000 ranges between any two moments of its life."""
    team = small_team(9, robots=3, count=400)
    rng = np.random.default_rng(10)
    n = rng.integers(0, 400, (5000, 2))
    nonsense = tuple(
        range_item(int(team.n[2][i]), team.chains[1], int(team.n[1][j]), 3.0) for i, j in n
    )
    team.graph.insert(team.chains[2], GraphEntry(9, ranges=nonsense))
    group = group_of(team.graph)
    began = time.process_time()
    estimate = solved(team.graph, group)
    assert time.process_time() - began < 30
    assert np.isfinite(estimate.trajectories[0].poses).all()


@pytest.mark.slow
def test_a_robot_that_waited_while_the_others_drove_costs_little() -> None:
    team = small_team(11, robots=2, count=900)
    waits = Chain(2, 77)
    place = np.array([1.0, 2.0, 0.5])
    # it moves for a moment at the beginning and at the end, and stands for a quarter of an hour
    frames = keyframes([0, 10, 8990], [place, place + [0.3, 0, 0], place + [0.6, 0, 0]])
    ranges = []
    for k in range(2, 890):
        apart = team.truth[0][k, :2] - (place + [0.3, 0, 0])[:2]
        ranges.append(range_item(10, team.chains[0], int(team.n[0][k]), float(np.hypot(*apart))))
    item = closure(
        0,
        10,
        team.chains[0],
        int(team.n[0][1]),
        product(inverted(place + [0.3, 0, 0]), team.truth[0][1]),
    )
    team.graph.insert(waits, GraphEntry(0, None, frames, tuple(ranges), (item,)))
    members = {Segment(*c, 0) for c in (*team.chains.values(), waits)}
    group = Group(members, Segment(*team.chains[0], 0))
    began = time.process_time()
    estimate = None
    for _ in range(4):  # as on the robot: each solve goes on from the one before
        estimate = solved(team.graph, group, estimate)
    assert estimate
    assert time.process_time() - began < 10
    assert estimate.converged
    true = product(inverted(team.truth[0][0]), place + [0.3, 0, 0])
    assert np.hypot(*(estimate.trajectories[2].poses[1] - true)[:2]) < 0.5
