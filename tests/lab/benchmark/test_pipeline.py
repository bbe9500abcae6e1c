"""One update of the whole team: the made-up graph is as wrong as its weights say."""

from __future__ import annotations

import numpy as np
import pytest
from lab.benchmark import pipeline, timing
from lab.benchmark.pipeline import PAIRS, ROBOTS, SECONDS, Update

from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver


def test_errors_of_the_team_graph_are_those_of_its_sigmas() -> None:
    """Chi-squared of the least squares solution, over its degrees of freedom, is near 1."""
    edges = pipeline._team_edges(np.random.default_rng(1))
    count = ROBOTS * SECONDS
    assert len(edges) == ROBOTS * (SECONDS - 1) + len(PAIRS) * SECONDS
    answer = PoseGraphSolver(edges, count).solve()
    assert answer.converged
    freedom = 3 * len(edges) - 3 * (count - 1)
    assert answer.cost / freedom == pytest.approx(1.0, abs=0.2)


def test_every_call_hands_each_pair_one_more_closure() -> None:
    update = Update()
    before = [len(pair.kept()) for pair in update._pairs]
    for _ in range(20):
        update()
    grown = [len(pair.kept()) - b for pair, b in zip(update._pairs, before, strict=True)]
    # four of five are good, and a gate at 90 % refuses some of them
    assert all(5 <= more <= 20 for more in grown)


def test_its_row_is_the_median_beside_what_the_paper_says(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    once = timing.in_turns
    monkeypatch.setattr(timing, "in_turns", lambda programs, most, s: once(programs, 3, s))
    (row,) = pipeline.rows(quick=True)
    assert row.unit == "ms"
    assert 0 < row.value < 1_000
    here, paper = row.peers
    assert (paper.value, paper.here) == (81.0, False)
    assert here.here
    assert row.is_met is (here.value >= 2.0 * row.value)
