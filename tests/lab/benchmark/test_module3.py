"""The peers of module 3 on a small graph."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_graph
from lab.benchmark import module3
from lab.benchmark.graphs import Graph

from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver


@pytest.fixture
def team(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Graph:
    return small_graph.loaded(tmp_path, monkeypatch)


def test_gtsam_solves_the_same_graph(team: Graph) -> None:
    gtsam = pytest.importorskip("gtsam")
    start = PoseGraphSolver(team.edges, team.count).chordal_start()
    found = module3.gtsam_solver(team, start)[module3.GTSAM]()
    assert isinstance(found, gtsam.Values)
    poses = [found.atPose2(k) for k in range(team.count)]
    cost = PoseGraphSolver(team.edges, team.count).cost(
        np.array([(p.x(), p.y(), p.theta()) for p in poses])
    )
    # it weighs an angle once where the benchmark's cost counts it twice
    assert -1e-9 < team.gap(cost) < 0.05


def test_where_there_is_no_gtsam_the_rows_are_without_it(
    team: Graph, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    rows = list(module3.in_space(team))
    assert [row.peers for row in rows] == [(), ()]
    assert rows[1].is_met


def test_block_descent_comes_down_slowly(team: Graph) -> None:
    few, many = (next(module3.plain_block_descent(team, k)).value for k in (5, 200))
    assert 0 < many < few / 10
    assert many > 1e-12
