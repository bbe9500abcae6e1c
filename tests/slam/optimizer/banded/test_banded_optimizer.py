"""A group's graph, built as a problem, solved, and sorted by robot again."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from machine_speed import allowed_s
from slam_scenes import (
    BANDED,
    NOISE,
    Array,
    SmallTeam,
    closure,
    group_of,
    inverted,
    keyframes,
    product,
    range_item,
    small_team,
)

from drslamd.conventions import Chain, Segment, node_chain
from drslamd.slam.graph.estimate import Lapse, Learned, TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import NO_HEADING
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.optimizer.banded import banded_solver
from drslamd.slam.optimizer.banded.banded_optimizer import (
    SCALE_TAILS,
    YAW_PRIOR_FLOOR,
    _is_near,
    build_problem,
)
from drslamd.slam.optimizer.banded.solution import Solution
from drslamd.slam.optimizer.bias_prior import BiasPrior
from drslamd.slam.optimizer.problem import Doubted, Freed
from drslamd.slam.optimizer.range_weights import STEADY
from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.robot_model import RobotModel

PLACE_ONLY = (0.04, 0.0, 0.0, 0.04, 0.0, float(NO_HEADING))


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
    assert estimate.joint.shape == (9, 9)
    for robot in range(3):
        covariance = estimate.covariance(robot)
        assert covariance is not None
        error = estimate.trajectories[robot].poses[-1] - product(
            inverted(team.truth[0][0]), team.truth[robot][-1]
        )
        error[2] = math.remainder(error[2], 2 * math.pi)
        assert error @ np.linalg.solve(covariance, error) < 14.2


def test_a_place_that_was_left_holds_those_who_measured_it_and_is_nobodys_any_more() -> None:
    """Until the next one is told, to which somebody has a range."""
    team, node, place = small_team(1, count=40), node_chain(77), np.array([2.0, 1.0])
    said = []
    for k in range(30):
        metres = float(np.hypot(*(place - team.truth[0][k, :2])))
        said.append(range_item(int(team.n[0][k]), node, 0, metres, sigma=0.05))
    seen = [*product(inverted(team.truth[0][5]), np.array([*place, 0.0]))[:2], 0.0]
    told = replace(closure(9, int(team.n[0][5]), node, 0, seen), covariance=PLACE_ONLY)
    team.graph.insert(team.chains[0], GraphEntry(2, None, (), tuple(said), (told,)))
    points = frozenset([Segment(*node, 0)])
    group = replace(group_of(team.graph), points=points)
    before = solved(team.graph, group)
    assert sorted(before.nodes) == [node.robot]
    assert before.joint.shape == (12, 12)
    away = range_item(int(team.n[0][39]), node, 1, 7.0)
    team.graph.insert(team.chains[0], GraphEntry(3, ranges=(away,)))
    after = solved(team.graph, group, before)
    assert after.nodes == {}
    assert after.covariance(node.robot) is None
    assert np.allclose(after.joint, before.joint[:9, :9], rtol=1e-3, atol=1e-9)
    assert after.left[node.robot].poses == pytest.approx(before.nodes[node.robot].poses, abs=1e-5)
    # a solution of the same keyframes is settled, whose place nobody claims or not
    assert solved(team.graph, group, after).settled
    again = replace(told, number=10, b_n=1)
    team.graph.insert(team.chains[0], GraphEntry(4, closures=(again,)))
    both = replace(group, points=points | {Segment(*node, 1)})
    found = solved(team.graph, both, after)
    assert found.nodes[node.robot].n.tolist() == [0, 1]
    assert found.left == {}
    assert found.joint.shape == (12, 12)


def test_what_is_claimed_is_named_by_its_robot_and_its_pair() -> None:
    """As the solver claims it of each last pose and of each constant by itself."""
    team = small_team(1, count=40)
    group = group_of(team.graph)
    estimate = solved(team.graph, group)
    built = build_problem(team.graph, group, None, BANDED)
    for robot in range(3):
        last = int(built.places.of_robot(robot)[-1])
        alone = banded_solver.solve(built.problem, built.start, (last,))
        covariance = estimate.covariance(robot)
        assert covariance is not None
        assert np.allclose(covariance, alone.joint, rtol=1e-6, atol=1e-12)
        assert alone.spread is not None
        assert estimate.scale[robot].sigma == pytest.approx(alone.spread.scale[robot])
        assert estimate.yaw[robot].sigma == pytest.approx(alone.spread.yaw[robot])
    assert alone.spread is not None
    for number, pair in enumerate([(0, 1), (0, 2), (1, 2)]):
        assert estimate.bias_m[pair] == pytest.approx(
            (alone.calibration.bias[number], alone.spread.bias[number])
        )
        assert estimate.scatter[pair] == pytest.approx(alone.scatter[number])
    common = alone.calibration.team_bias[0], alone.spread.team_bias[0]
    assert estimate.team_bias_m == pytest.approx(common)


def mounted(
    turn: dict[int, Learned] | None = None,
    antenna: dict[int, tuple[Learned, Learned]] | None = None,
) -> TeamEstimate:
    """A last solution in which three robots were, that says nothing of their ways."""
    nowhere = {
        robot: Trajectory(Chain(robot, 10 + robot), np.zeros(0, dtype=int), np.zeros((0, 3)))
        for robot in range(3)
    }
    return TeamEstimate(Segment(0, 10, 0), nowhere, turn=turn or {}, antenna_m=antenna or {})


def test_the_next_solution_begins_with_the_mountings_that_were_let_go() -> None:
    team = small_team(1, count=12)
    x, y = Learned(0.3, 0.02), Learned(-0.1, 0.02)
    previous = mounted({1: Learned(0.4, 0.05)}, {2: (x, y)})
    built = build_problem(team.graph, group_of(team.graph), previous, BANDED)
    assert built.problem.doubted.track.tolist() == [False, True, False]
    assert built.problem.doubted.antenna.tolist() == [False, False, True]
    assert built.start.turn.tolist() == [0, 0.4, 0]
    assert built.start.antenna.tolist() == [[0, 0], [0, 0], [0.3, -0.1]]
    first = build_problem(team.graph, group_of(team.graph), None, BANDED)
    assert not first.problem.doubted.any()


def test_who_was_not_solved_before_begins_with_the_mountings_of_its_closures() -> None:
    team = small_team(1, count=12)
    graph = PoseGraph()
    for chain, entry in team.entries:
        found = tuple(replace(c, corrected=(0.0, 0.0, 0.1, 0.4)) for c in entry.closures)
        graph.insert(chain, replace(entry, closures=found))
    built = build_problem(graph, group_of(graph), None, BANDED)
    assert built.problem.doubted.track.tolist() == [False, True, True]
    # of robot 2 two of two say so, of robot 1 half: those that it made itself
    assert built.start.turn.tolist() == [0, 0.2, 0.4]
    assert built.start.scale.tolist() == [0, 0.05, 0.1]


def test_the_next_solution_begins_with_the_lapses_that_were_found() -> None:
    team = small_team(1, count=12)
    first, last = (int(team.n[1][k]) for k in (4, 7))
    lapse = Lapse(1, first, last, stood=True)
    previous = replace(mounted(), lapses=(lapse,))
    built = build_problem(team.graph, group_of(team.graph), previous, BANDED)
    (freed,) = built.problem.freed
    odometry = built.problem.odometry
    assert (odometry.robot[freed.links] == 1).all()
    assert built.problem.n[odometry.i[freed.links]].tolist() == team.n[1][4:7].tolist()
    assert build_problem(team.graph, group_of(team.graph), None, BANDED).problem.freed == ()


def test_what_was_as_modelled_until_when_is_remembered_while_it_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    team = small_team(1, count=12)
    group = group_of(team.graph)
    first = solved(team.graph, group)
    last = {robot: int(n[-1]) for robot, n in team.n.items()}
    assert first.is_as_modelled
    assert first.fitted == last
    previous = replace(first, fitted={0: 5, 1: 7})
    problem = build_problem(team.graph, group, previous, BANDED).problem
    assert problem.fitted is not None
    assert problem.fitted.tolist() == [5, 7, 0]
    assert solved(team.graph, group, previous).fitted == last
    solve = banded_solver.solve

    def worse(*args: Any, **named: Any) -> Solution:
        answer = solve(*args, **named)
        return replace(answer, is_as_modelled=False)

    monkeypatch.setattr(banded_solver, "solve", worse)
    assert solved(team.graph, group, previous).fitted == {0: 5, 1: 7}
    # a first solution that is not has nothing to remember
    assert solved(team.graph, group).fitted == {}


def test_a_lapse_is_named_by_its_robot_and_keyframes(monkeypatch: pytest.MonkeyPatch) -> None:
    team = small_team(1, count=12)
    group = group_of(team.graph)
    built = build_problem(team.graph, group, None, BANDED)
    odometry = built.problem.odometry
    links = np.flatnonzero(odometry.robot == 2)[3:5]
    freed = Freed(2, links, np.zeros((2, 3, 3)), stands=False)
    solve = banded_solver.solve

    def freeing(*args: Any, **named: Any) -> Solution:
        return replace(solve(*args, **named), freed=(freed,))

    monkeypatch.setattr(banded_solver, "solve", freeing)
    first, last = int(team.n[2][3]), int(team.n[2][5])
    assert solved(team.graph, group).lapses == (Lapse(2, first, last, stood=False),)


def test_mountings_that_are_still_in_doubt_are_named_by_their_robots(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of the others nothing is said, whatever their unknowns are."""
    team = small_team(1, count=12)
    group = group_of(team.graph)
    plain = banded_solver.solve

    def solve(*args: Any, **how: Any) -> Solution:
        found = plain(*args, **how)
        assert found.spread is not None
        values = replace(
            found.calibration, turn=np.array([0.1, 0.2, 0.3]), antenna=np.arange(6.0).reshape(3, 2)
        )
        spread = replace(
            found.spread, turn=np.array([1.0, 2.0, 3.0]), antenna=np.arange(6.0, 12.0).reshape(3, 2)
        )
        doubted = Doubted(np.array([False, True, True]), np.array([True, False, False]))
        level = 3.0 + team_problem_links(team, group)
        return replace(
            found,
            blocked=np.array([False, True, False]),
            calibration=values,
            spread=spread,
            doubted=doubted,
            feared_level=level,
            late_level=level / 12,
        )

    monkeypatch.setattr(banded_solver, "solve", solve)
    estimate = solved(team.graph, group)
    assert estimate.turn == {1: Learned(0.2, 2.0), 2: Learned(0.3, 3.0)}
    assert estimate.antenna_m == {0: (Learned(0.0, 6.0), Learned(1.0, 7.0))}
    assert estimate.blocked == {(0, 2)}
    # of the last link of each robot, as far as it must be feared
    assert estimate.odometry_level == {0: 13.0, 1: 14.0, 2: 15.0}
    # and what is as configured is not named
    assert estimate.late_level == pytest.approx({0: 13 / 12, 1: 14 / 12, 2: 15 / 12})


def team_problem_links(team: SmallTeam, group: Group) -> Array:
    """A number of each link: of its robot, and ten more of the last one."""
    links = build_problem(team.graph, group, None, BANDED).problem.odometry
    is_last = np.isin(links.j, [links.j[links.robot == r].max() for r in range(3)])
    return np.asarray(links.robot + 10.0 * is_last)


def test_a_mounting_that_turns_out_as_configured_is_in_doubt_no_longer() -> None:
    team = small_team(1, count=60)
    group = group_of(team.graph)
    previous = replace(
        solved(team.graph, group),
        turn={1: Learned(0.3, 0.1)},
        antenna_m={0: (Learned(0.2, 0.1), Learned(0.0, 0.1))},
    )
    again = solved(team.graph, group, previous)
    assert again.converged
    assert again.turn == {}
    assert again.antenna_m == {}


def test_biases_are_named_by_their_pairs_and_scales_by_their_robots() -> None:
    true = {(0, 1): 0.4, (0, 2): 0.0, (1, 2): -0.3}
    team = small_team(3, count=150, range_sigma=0.01, biases=true)
    estimate = solved(team.graph, group_of(team.graph))
    for pair, bias in true.items():
        found = estimate.bias_m[pair]
        assert found.value == pytest.approx(bias, abs=0.15)
        assert abs(found.value - bias) < 2 * found.sigma < 0.6
    assert set(estimate.scale) == set(estimate.yaw) == {0, 1, 2}
    # what pairs have in common lies between them
    assert -0.3 < estimate.team_bias_m.value < 0.4


def test_what_strong_signals_do_is_one_constant_of_the_team() -> None:
    """Found where it may be large; its sigma is that of all that is known, the prior included."""
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
    # what was measured adds to a prior of 0.05 m as it did to one of a metre
    assert held.sigma**-2 == pytest.approx(free.sigma**-2 - 1 + 0.05**-2, rel=0.05)
    assert abs(held.value) < 2 * LINKTRACK.near_bias_sigma_m


def test_priors_are_those_of_the_robots_and_of_the_configuration() -> None:
    team = small_team(3)
    still = replace(NOISE, yaw_rad_per_m=1e-6, scale=0.07)
    team.graph.insert(team.chains[1], GraphEntry(9, RobotModel(still, half_track_m=0.115)))
    problem = build_problem(
        team.graph, group_of(team.graph), None, replace(BANDED, bias_sigma=0.25)
    ).problem
    # 0.27 and 0.07 of what is configured, and three degrees of freedom
    assert problem.priors.bias == BiasPrior(sigma=0.25, spread=0.0675, dof=3.0, team=0.0175)
    assert problem.priors.scale == pytest.approx([NOISE.scale, 0.07, NOISE.scale])
    assert problem.priors.scale_tails == SCALE_TAILS
    assert problem.priors.yaw == pytest.approx(
        [NOISE.yaw_rad_per_m, YAW_PRIOR_FLOOR, NOISE.yaw_rad_per_m]
    )
    assert problem.priors.near_bias == LINKTRACK.near_bias_sigma_m
    assert (problem.pairs, problem.range_sigma) == (3, 0.10)
    assert problem.half_track == pytest.approx([0.0, 0.115, 0.0])


@pytest.mark.parametrize(("robots", "wider"), [((1,), ()), ((0, 1), ((0, 1),))])
def test_ranges_weigh_less_between_robots_whose_headings_gyros_give(
    robots: tuple[int, ...], wider: tuple[tuple[int, int], ...]
) -> None:
    team = small_team(5, count=20)
    for robot in robots:
        by_gyro = replace(NOISE, gyro=GyroNoise(1e-4, 1e-4, 0))
        team.graph.insert(team.chains[robot], GraphEntry(9, RobotModel(by_gyro)))
    found = build_problem(team.graph, group_of(team.graph), None, BANDED)
    widths = dict(zip(found.pairs, found.problem.widths, strict=True))
    assert len(widths) == 3
    assert widths == {pair: STEADY if pair in wider else 1.0 for pair in widths}


def test_a_gyro_whose_noise_by_time_is_that_of_the_wheels_by_path_changes_nothing_else() -> None:
    """0.4 m/s all along: sigmas by path and by time can be the same."""
    team = small_team(5, count=60)
    group = group_of(team.graph)
    by_wheels = build_problem(team.graph, group, None, BANDED)
    gyro = GyroNoise(NOISE.yaw_rad_per_sqrt_m * math.sqrt(0.4), NOISE.yaw_rad_per_m * 0.4, 0)
    wheels = replace(NOISE, yaw_rad_per_sqrt_m=1e-6, yaw_rad_per_m=1e-6, gyro=gyro)
    team.graph.insert(team.chains[1], GraphEntry(9, RobotModel(wheels)))
    by_gyro = build_problem(team.graph, group, None, BANDED)
    assert by_gyro.problem.priors.yaw[1] == gyro.yaw_rad_per_s
    assert not by_wheels.by_gyro
    assert set(by_gyro.by_gyro) == {1}
    one, other = (banded_solver.solve(team.problem, team.start) for team in (by_wheels, by_gyro))
    assert other.poses == pytest.approx(one.poses, abs=0.02)
    of_path, of_time = one.calibration.yaw, other.calibration.yaw
    assert of_time[1] == pytest.approx(0.4 * of_path[1], rel=0.1)
    assert of_time[[0, 2]] == pytest.approx(of_path[[0, 2]], rel=0.1)
    # what is learned of the wheels has another unit
    estimate = solved(team.graph, group)
    assert (set(estimate.yaw), set(estimate.gyro_rate)) == ({0, 2}, {1})
    start = build_problem(team.graph, group, estimate, BANDED).start
    assert start.yaw.tolist() == [
        estimate.yaw[0].value,
        estimate.gyro_rate[1].value,
        estimate.yaw[2].value,
    ]


def test_the_next_solution_goes_on_from_the_last_one() -> None:
    team = small_team(4, count=60)
    group = group_of(team.graph)
    first = solved(team.graph, group)
    problem_and_start = build_problem(team.graph, group, first, BANDED)
    assert problem_and_start.start.scale.tolist() == [first.scale[r].value for r in range(3)]
    assert problem_and_start.start.near_bias.tolist() == [first.near_bias_m.value] != [0.0]
    assert problem_and_start.start.team_bias.tolist() == [first.team_bias_m.value] != [0.0]
    again = solved(team.graph, group, first)
    start = problem_and_start.start
    assert banded_solver.solve(problem_and_start.problem, start).iterations <= 2
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


def test_a_solution_is_settled_when_it_was_begun_from_one_of_the_same_keyframes() -> None:
    team = small_team(5, count=60)
    group = group_of(team.graph)
    first = solved(team.graph, group)
    again = solved(team.graph, group, first)
    assert (first.is_final, again.is_final) == (False, True)
    for changed in (
        replace(first, converged=False),
        replace(first, frame=Segment(*team.chains[1], 0)),
        replace(first, trajectories={r: t for r, t in first.trajectories.items() if r}),
    ):
        assert not solved(team.graph, group, changed).is_final
    assert solved(team.graph, group, again).iterations == 1


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
    covariance = estimate.covariance(2)
    assert covariance is not None
    sigma = math.sqrt(covariance[0, 0])
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
    took = time.process_time() - began
    assert took < allowed_s(30)
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
    took = time.process_time() - began
    assert took < allowed_s(10)
    assert estimate.converged
    true = product(inverted(team.truth[0][0]), place + [0.3, 0, 0])
    assert np.hypot(*(estimate.trajectories[2].poses[1] - true)[:2]) < 0.5


def test_what_is_narrower_is_named_by_its_robots_the_lower_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    team = small_team(1, count=12)
    group = group_of(team.graph)
    robots = [data.chain.robot for data in team.graph.view.chains.values()]
    shares = np.array([[1.0, 0.3, 0.4], [0.3, 0.8, 1.0], [0.4, 1.0, 1.0]])
    solve = banded_solver.solve

    def sharing(*args: Any, **named: Any) -> Solution:
        return replace(solve(*args, **named), shares=shares)

    monkeypatch.setattr(banded_solver, "solve", sharing)
    a, b, c = sorted(robots)[:3]
    assert solved(team.graph, group).narrower == {(b,): 0.8, (a, b): 0.3, (a, c): 0.4}


@pytest.mark.parametrize("robot", [0, 2])
def test_a_robot_that_turns_the_other_way_serves_the_others_as_if_it_did_not(robot: int) -> None:
    """A team and its twin, in which the odometry of one robot is the mirror image. Closures were
    found with the peer turning the other way, also where it is the owner that does."""
    team, twin = small_team(5), PoseGraph()
    for chain, entry in team.entries:
        frames, said = entry.keyframes, entry.closures
        if chain.robot == robot:
            frames = tuple(replace(k, y=-k.y, theta=-k.theta) for k in frames)
        if chain.robot == robot or any(c.peer.robot == robot for c in said):
            said = tuple(_as_of_twin(c, chain, robot) for c in said)
        twin.insert(chain, replace(entry, keyframes=frames, closures=said))
    odd = frozenset({Segment(*team.chains[robot], 0)})
    whole = group_of(team.graph)
    frame = min(whole.members - odd)
    right = solved(team.graph, replace(whole, frame=frame))
    found = solved(twin, Group(whole.members - odd, frame, mirrored=odd))
    assert found.points == found.mirrored.keys() == {robot}
    for other, path in right.trajectories.items():
        assert found.trajectories[other].poses == pytest.approx(path.poses, abs=1e-5)
    assert found.turn == {robot: Learned(-2.0, found.turn[robot].sigma)}
    assert found.covariance(robot)[2, 2] == NO_HEADING  # type: ignore[index]
    assert found.mirrored[robot] == pytest.approx(right.covariance(robot)[2, 2], rel=1e-3)  # type: ignore[index]
    again = solved(twin, Group(whole.members - odd, frame, mirrored=odd), found)
    for other, path in found.trajectories.items():
        assert again.trajectories[other].poses == pytest.approx(path.poses, abs=1e-5)


def _as_of_twin(c: ClosureMeasurement, owner: Chain, odd: int) -> ClosureMeasurement:
    if odd not in (owner.robot, c.peer.robot):
        return c
    x, y, theta = c.a_T_b
    seen = (x, -y, -theta) if owner.robot == odd else c.a_T_b
    return replace(c, a_T_b=seen, corrected=(0.0, 0.0, 0.0, -2.0))


@pytest.mark.parametrize(
    ("robots", "new", "is_near"), [(3, 5, True), (3, 6, False), (8, 8, True), (8, 9, False)]
)
def test_keyframes_that_are_new_since_a_solution_leave_it_near_more_of_them_in_a_large_team(
    robots: int, new: int, is_near: bool
) -> None:
    chains = [Chain(robot, 1) for robot in range(robots)]
    known, frame = np.arange(20), Segment(*chains[0], 0)
    paths = {c.robot: Trajectory(c, known, np.zeros((20, 3))) for c in chains}
    group = Group({Segment(*c, 0) for c in chains}, frame)
    now = {c: np.arange(20 + new) for c in chains}
    assert _is_near(TeamEstimate(frame, paths), group, now) is is_near
    worse = TeamEstimate(frame, paths, is_as_modelled=False)
    assert not _is_near(worse, group, now)
