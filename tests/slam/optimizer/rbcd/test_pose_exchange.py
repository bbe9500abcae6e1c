"""Whose turn it is, what is said, and that the team's cost falls whatever happens on the way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lab.play import block_team
from lab.play.block_team import BlockRobot, SplitGraph
from lab.play.turns import Air, Turns
from slam_scenes import Array
from split_graphs import plain_cost, split_graph

from drslamd.conventions import SECOND_US, Chain
from drslamd.slam.graph.estimate import Lifted, TeamEstimate
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.rbcd.pose_exchange import (
    ASK_LATER_US,
    ASK_US,
    LEAP,
    MOST_QUESTIONS,
    PATIENCE_US,
    REPEAT_US,
    PoseExchange,
)

A, B, C = Chain(1, 4), Chain(2, 5), Chain(3, 6)
WEIGHTS = np.array([[1.0, 1.0], [1.0, 1.0]])


def state(shift: float = 0.0, which: int = 1, rank: int = 2) -> Lifted:
    """Two public poses of which one is moved; in the plane."""
    rows = np.zeros((2, 2 * rank), dtype=complex)
    rows[:, 0] = 1.0
    rows[which, rank] = shift
    n = np.array([10, 20])
    anchor = rows[0].copy()
    return Lifted(n, rows, anchor, np.zeros(3), n, WEIGHTS, ends=2, quiet=0, gain=1.0)


def said(
    move: int, since: int = 0, numbers: tuple[int, ...] = (30,), **more: object
) -> PublicPoses:
    values = np.zeros((len(numbers) + 1, 2), dtype=complex)
    values[:, 0] = 1.0
    public = PublicPoses(1, 4, 1, numbers, values, round=move, since=since)
    return replace(public, **more)  # type: ignore[arg-type]


def question(move: int, held: int, of: Chain = A) -> PublicPoses:
    return said(move, since=move, numbers=(), asks=True, held=((of.robot, held),))


def moved(exchange: PoseExchange, shift: float, which: int = 1) -> list[PublicPoses]:
    return exchange.moved(A, state(shift, which), 0)


# whose turn it is


def test_who_has_no_neighbours_may_always_move() -> None:
    assert PoseExchange(A).begin([], 0)


def test_before_the_first_move_nobody_waits_for_anybody() -> None:
    assert PoseExchange(B).begin([A, C], 0)


def test_after_a_move_each_neighbour_moves_first() -> None:
    exchange = PoseExchange(A)
    assert exchange.begin([B, C], 0)
    moved(exchange, 1.0)
    assert not exchange.begin([B, C], 0)
    exchange.hear(B, said(2))
    assert not exchange.begin([B, C], 0)
    exchange.hear(C, said(2))
    assert exchange.begin([B, C], 0)
    moved(exchange, 2.0)
    assert exchange.round == 3
    assert not exchange.begin([B, C], 0)


@pytest.mark.parametrize(("own", "other", "is_ours"), [(A, B, True), (B, A, False)])
def test_of_two_equal_moves_the_lower_robot_goes_on(
    own: Chain, other: Chain, is_ours: bool
) -> None:
    exchange = PoseExchange(own)
    moved(exchange, 1.0)
    exchange.hear(other, said(1))
    assert exchange.begin([other], 0) is is_ours


def test_a_move_of_which_a_part_is_missing_is_waited_for() -> None:
    exchange = PoseExchange(A)
    moved(exchange, 1.0)
    exchange.hear(B, said(5, parts=2, part=1, numbers=(40,)))
    assert not exchange.begin([B], 0)
    exchange.hear(B, said(5, parts=2, part=0))
    assert exchange.begin([B], 0)


def test_a_move_that_is_only_known_of_is_waited_for_too() -> None:
    exchange = PoseExchange(A)
    moved(exchange, 1.0)
    exchange.hear(B, said(5))
    exchange.hear(B, question(7, held=1))
    assert not exchange.begin([B], 0)
    exchange.hear(B, said(7, since=5))
    assert exchange.begin([B], 0)


def test_who_does_not_answer_for_long_is_left_alone() -> None:
    exchange = PoseExchange(A)
    moved(exchange, 1.0)
    assert not exchange.begin([B], SECOND_US)
    assert not exchange.begin([B], SECOND_US + PATIENCE_US - 1)
    assert exchange.begin([B], SECOND_US + PATIENCE_US)
    # what it says later counts again
    exchange.hear(B, said(1, numbers=(30, 40)))
    assert exchange.begin([B], SECOND_US + PATIENCE_US)
    moved(exchange, 2.0)
    assert not exchange.begin([B], SECOND_US + PATIENCE_US)


def test_a_later_start_of_a_robot_is_another_one() -> None:
    exchange, again = PoseExchange(A), Chain(B.robot, 9)
    moved(exchange, 1.0)
    exchange.hear(B, said(7))
    exchange.hear(again, said(3))
    assert exchange.begin([again], 0)
    assert set(exchange.held()) == {B.robot}
    exchange.keep(set())
    assert exchange.held() == {}


def test_no_number_from_outside_lifts_ours_by_more_than_a_leap() -> None:
    exchange = PoseExchange(A)
    exchange.hear(B, said(2**62 - 1))
    assert exchange.begin([B], 0)
    moved(exchange, 1.0)
    assert exchange.round == LEAP + 1


# what is said


def test_the_first_move_says_all_public_poses_and_later_ones_say_what_moved() -> None:
    exchange = PoseExchange(A)
    (first,) = moved(exchange, 1.0)
    assert (first.keyframes, first.round, first.since) == ((10, 20), 1, 0)
    (second,) = moved(exchange, 1.0 + 2e-5)
    assert (second.keyframes, second.round, second.since) == ((20,), 2, 1)
    assert second.table()[20][1] == 1.0 + 2e-5


def test_what_moved_by_less_than_matters_is_not_said_until_it_adds_up() -> None:
    """By a hundred-thousandth of a sigma; here sigma is 1."""
    exchange = PoseExchange(A)
    moved(exchange, 1.0)
    assert moved(exchange, 1.0 + 0.9e-5) == []
    assert exchange.round == 1
    (news,) = moved(exchange, 1.0 + 1.8e-5)
    assert news.keyframes == (20,)


def test_in_another_frame_everything_is_said_anew() -> None:
    exchange = PoseExchange(A)
    moved(exchange, 1.0)
    (first,) = exchange.moved(C, state(1.0), 0)
    assert (first.frame, first.keyframes, first.since) == (C.robot, (10, 20), 0)


def test_without_closures_nothing_is_said() -> None:
    none = np.zeros(0, dtype=np.int64)
    lifted = replace(state(), carriers=none, weights=np.zeros((0, 2)))
    assert PoseExchange(A).moved(A, lifted, 0) == []


def test_poses_of_the_plane_are_said_in_one_direction() -> None:
    (first,) = PoseExchange(A).moved(A, state(1.0, rank=5), 0)
    assert first.rank == 1
    assert first.values.shape == (3, 2)


def test_who_waits_asks_what_it_lacks_and_again_until_it_has_it() -> None:
    exchange = PoseExchange(A)
    moved(exchange, 1.0)
    exchange.hear(B, said(1))
    exchange.hear(B, said(4, since=3))
    assert not exchange.begin([B, C], 0)
    assert exchange.answers(ASK_US - 1, at_rest=False) == []
    (asked,) = exchange.answers(ASK_US, at_rest=False)
    assert asked.asks
    assert asked.held == ((B.robot, 1), (C.robot, 0))
    assert exchange.answers(ASK_US + 1, at_rest=False) == []
    assert len(exchange.answers(2 * ASK_US, at_rest=False)) == 1
    # that it has no reason to move itself does not help: it must hold what it knows of
    exchange.rest(2 * ASK_US)
    assert len(exchange.answers(3 * ASK_US, at_rest=False)) == 1
    exchange.hear(B, said(4, since=1))
    exchange.rest(3 * ASK_US)
    assert not exchange.is_waiting


def test_what_somebody_lacks_is_said_again_from_there_on_and_once_for_all() -> None:
    exchange = PoseExchange(A)
    moved(exchange, 1.0)
    moved(exchange, 2.0)
    moved(exchange, 3.0, which=0)
    exchange.hear(B, question(9, held=2))
    exchange.hear(C, question(9, held=1))
    (again,) = exchange.answers(SECOND_US, at_rest=True)
    assert (again.keyframes, again.round, again.since) == ((10, 20), 3, 1)
    exchange.hear(B, question(9, held=2))
    assert exchange.answers(SECOND_US + REPEAT_US - 1, at_rest=True) == []
    (later,) = exchange.answers(SECOND_US + REPEAT_US, at_rest=True)
    assert (later.keyframes, later.since) == ((10, 20), 2)


def test_who_has_no_reason_to_move_passes_its_turn_on() -> None:
    exchange = PoseExchange(A)
    assert exchange.begin([B], 0)
    moved(exchange, 1.0)
    exchange.hear(B, question(3, held=1))
    # it would say that it holds a move that it only knows of
    assert exchange.answers(0, at_rest=True) == []
    exchange.hear(B, said(3))
    assert exchange.answers(0, at_rest=False) == []
    (passed,) = exchange.answers(0, at_rest=True)
    assert (passed.keyframes, passed.since, passed.round) == ((), 1, 4)
    assert exchange.is_at_rest
    assert exchange.answers(9 * SECOND_US, at_rest=True) == []


def test_who_does_not_know_that_its_last_move_was_heard_asks_each_second_for_a_while() -> None:
    exchange = PoseExchange(A)
    assert exchange.begin([B, C], 0)
    moved(exchange, 1.0)
    exchange.rest(0)
    assert not exchange.is_at_rest
    assert exchange.answers(ASK_LATER_US - 1, at_rest=True) == []
    (asked,) = exchange.answers(ASK_LATER_US, at_rest=True)
    assert asked.held == ((B.robot, 0), (C.robot, 0))
    exchange.hear(B, said(2))
    exchange.hear(C, said(1))
    assert len(exchange.answers(2 * ASK_LATER_US, at_rest=True)) == 1
    exchange.hear(C, said(2, since=1))
    assert exchange.is_at_rest
    assert exchange.answers(3 * ASK_LATER_US, at_rest=True) == []


def test_nobody_asks_for_ever() -> None:
    exchange = PoseExchange(A)
    assert exchange.begin([B], 0)
    moved(exchange, 1.0)
    asked = [exchange.answers(k * ASK_LATER_US, at_rest=True) for k in range(1, 200)]
    assert sum(len(messages) for messages in asked) == MOST_QUESTIONS
    assert exchange.is_at_rest


def test_who_learns_by_a_question_what_it_missed_asks_back() -> None:
    exchange = PoseExchange(B)
    assert exchange.begin([A], 0)
    moved(exchange, 1.0)
    exchange.hear(A, said(2))
    exchange.rest(0)
    assert exchange.is_at_rest
    exchange.hear(A, question(5, held=1, of=B))
    exchange.rest(0)
    (asked,) = exchange.answers(ASK_US, at_rest=False)
    assert asked.held == ((A.robot, 2),)


def test_a_turn_that_is_passed_on_is_no_news_to_its_neighbours() -> None:
    exchange = PoseExchange(B)
    exchange.hear(A, said(1, numbers=(30,)))
    before = exchange.news
    exchange.hear(A, said(2, since=1, numbers=()))
    assert exchange.news == before
    assert exchange.held()[A.robot].round == 2
    exchange.hear(A, said(3, since=2, numbers=(30,)))
    assert exchange.news == before + 1


def test_questions_that_name_others_are_none_to_us() -> None:
    exchange = PoseExchange(A)
    moved(exchange, 1.0)
    exchange.hear(B, question(3, held=0, of=C))
    assert exchange.answers(SECOND_US, at_rest=True) == []


def test_only_poses_of_one_frame_are_asked_for_by_it() -> None:
    exchange = PoseExchange(C)
    exchange.hear(A, said(1))
    exchange.hear(B, replace(said(1), frame=7))
    assert set(exchange.held(Chain(1, 4))) == {A.robot}
    assert set(exchange.held()) == {A.robot, B.robot}


# the whole team


class Watched(BlockRobot):
    """A robot after each of whose moves somebody writes down what the team costs."""

    team: dict[int, Watched]
    graph: SplitGraph
    costs: list[float]

    def on_solution(self, result: TeamEstimate, utime: int) -> list[PublicPoses]:
        out = super().on_solution(result, utime)
        found = block_team.lifted(self.team, self.graph)
        if found is not None:
            self.costs.append(self.graph.cost(found))
        return out


def watched(graph: SplitGraph) -> tuple[dict[int, Watched], list[float]]:
    team: dict[int, Watched] = {}
    costs: list[float] = []
    for robot, plain in block_team.split(graph).items():
        team[robot] = Watched(plain._own, plain._frame)
        team[robot].team, team[robot].graph, team[robot].costs = team, graph, costs
    return team, costs


def least(graph: SplitGraph) -> Array:
    """By another solver, which knows all edges."""
    return PoseGraphSolver(graph.edges, len(graph.robot)).solve().poses


SHAPES = [
    [(0, 1)],
    [(0, 1), (1, 2)],
    [(0, 2), (1, 2)],
    [(0, 1), (0, 2), (1, 2)],
    [(0, 3), (1, 3), (2, 3), (1, 2)],
    [(0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (2, 4)],
]
airs = st.builds(
    Air,
    loss=st.sampled_from([0.0, 0.1, 0.3, 0.5]),
    latest=st.integers(0, 20),
    takes=st.integers(0, 5),
)


@pytest.mark.slow
@given(st.integers(0, 1_000), st.sampled_from(SHAPES), airs, st.sampled_from([0.3, 1.0, 3.0]))
@settings(derandomize=True, max_examples=40, deadline=None)
def test_no_move_lets_the_cost_of_the_team_rise_whatever_is_lost_or_late(
    seed: int, pairs: list[tuple[int, int]], air: Air, error: float
) -> None:
    """Datagrams come in any order, moves take their time; in the end all rest at the minimum."""
    graph = split_graph(seed, pairs, error=error)
    team, costs = watched(graph)
    turns = Turns(team, air, seed)
    rounds = 0
    while turns.round():
        rounds += 1
        assert rounds < 300
    rises = np.diff(costs) / (1 + np.array(costs[:-1]))
    assert rises.max(initial=0.0) < 1e-9
    assert costs[-1] < plain_cost(graph, least(graph)) * (1 + 1e-6) + 1e-6


def test_robots_that_move_at_once_would_let_it_rise() -> None:
    """So the property above is none that every descent has."""
    graph = split_graph(3, SHAPES[3], closures=40)
    team, costs = watched(graph)
    for member in team.values():
        member.exchange.begin = lambda neighbours, utime: True  # type: ignore[method-assign]
    turns = Turns(team, Air(takes=45), 3)
    for _ in range(30):
        turns.round()
    assert np.diff(costs).max() > 1e-3 * costs[-1]


def test_at_rest_nobody_says_anything() -> None:
    graph = split_graph(1, SHAPES[3])
    team, _ = watched(graph)
    turns = Turns(team, Air(loss=0.3), 1)
    while turns.round():
        pass
    before = turns.bytes_sent
    for _ in range(20):
        assert not turns.round()
    assert turns.bytes_sent == before
