"""A split pose graph: what each robot is told of it, and how the team comes down."""

from __future__ import annotations

import numpy as np
import pytest
from lab.play import block_team
from lab.play.block_team import Descent
from lab.play.turns import Air
from split_graphs import COUNT, plain_cost, split_graph

from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.rbcd import riemannian_descent

PAIRS = [(0, 1), (0, 2), (1, 2)]


def test_the_cost_is_that_of_the_edges_one_by_one() -> None:
    graph = split_graph(1, PAIRS)
    poses = np.random.default_rng(2).normal(size=(3 * COUNT, 3))
    lifted = riemannian_descent.lift(poses, 4)
    assert graph.cost(lifted) == pytest.approx(plain_cost(graph, poses))


def test_every_edge_is_told_to_the_robots_at_its_ends_and_to_nobody_else() -> None:
    graph = split_graph(1, PAIRS, closures=7)
    team = block_team.split(graph)
    for robot, member in team.items():
        own = member._own
        assert own.n.tolist() == list(range(COUNT))
        assert len(own.links) == COUNT - 1
        assert sum(len(closures.mine) for closures in own.shared) == 14
        assert all(closures.leaves is (robot < closures.other.robot) for closures in own.shared)
    first, second = team[0]._own.shared[0], team[1]._own.shared[0]
    assert first.mine.tolist() == second.far.tolist()
    assert np.array_equal(first.measured, second.measured)


def test_the_team_comes_to_the_minimum_that_another_solver_finds() -> None:
    graph = split_graph(4, PAIRS)
    best = PoseGraphSolver(graph.edges, 3 * COUNT).solve()
    found = block_team.descend(graph, 200, Air(loss=0.2), seed=1)
    assert found.at_rest
    assert found.worst_rise() < 1e-9
    assert found.costs[-1] == pytest.approx(best.cost, rel=1e-6)
    assert plain_cost(graph, found.poses()) == pytest.approx(best.cost, rel=1e-6)
    assert found.megabytes > 0


def test_after_so_many_rounds_it_is_broken_off() -> None:
    found = block_team.descend(split_graph(4, PAIRS, error=3.0), 2)
    assert (len(found.costs), found.at_rest) == (2, False)


def test_rounds_are_counted_from_one_and_rises_are_relative() -> None:
    found = Descent([np.inf, 50.0, 20.0, 22.0, 10.0], None, at_rest=False, megabytes=1.0)
    assert [found.rounds_to(most) for most in (60.0, 20.0, 10.0, 9.0)] == [2, 3, 5, None]
    assert found.worst_rise() == pytest.approx(0.1)
    assert Descent([np.inf], None, at_rest=False, megabytes=0.0).worst_rise() == 0.0
