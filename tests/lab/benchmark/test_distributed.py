"""Module 3 over messages: every robot ends with the optimum that scipy finds, also under loss."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_graph
from lab.benchmark.graphs import Graph
from lab.benchmark.over_messages import distributed


@pytest.fixture
def team(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Graph:
    return small_graph.loaded(tmp_path, monkeypatch)


def test_one_round_is_enough_where_nothing_is_lost(team: Graph) -> None:
    outcome = distributed.run(team, 0.0, 1e-6, 5)
    assert outcome.rounds == 1
    assert abs(outcome.gap) < 1e-7
    edges = len(team.read.i)
    # one datagram for the odometry of each robot, and for what 0 saw of 1 and 1 of 2
    assert outcome.megabytes * 1e6 == 48 * edges + 5 * (45 + 8 + len("DRSLAM_EDGES_000") + 1)


def test_with_loss_everybody_arrives_at_the_same(team: Graph) -> None:
    outcomes = [distributed.run(team, 0.3, 1e-6, 8, seed) for seed in range(5)]
    assert all(outcome.rounds is not None for outcome in outcomes)
    assert all(abs(outcome.gap) < 1e-7 for outcome in outcomes)
    assert sorted(outcome.rounds or 99 for outcome in outcomes)[2] == 2


def test_where_all_is_lost_nobody_has_the_team(team: Graph) -> None:
    outcome = distributed.run(team, 1.0, 1e-6, 2)
    assert outcome.rounds is None
    assert outcome.gap == np.inf
