"""The order of a graph's poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_graph
from lab.benchmark.graphs import Graph


@pytest.fixture
def team(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Graph:
    return small_graph.loaded(tmp_path, monkeypatch)


def test_poses_of_one_time_are_neighbours(team: Graph) -> None:
    assert team.place[:2].tolist() == [0, small_graph.ROBOTS]
    assert team.place[small_graph.EACH] == 1
    assert np.abs(team.edges.i - team.edges.j).max() == small_graph.ROBOTS
