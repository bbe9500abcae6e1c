"""Factors and errors of the team's problem, against the same written down plainly."""

from __future__ import annotations

import numpy as np
import pytest
from slam_problems import no_ranges, pose_edges, team_problem

from drslamd.slam.optimizer.problem import BetweenFactors, Doubted, RangeFactors


def test_covariances_that_rounding_has_broken_are_inverted_all_the_same() -> None:
    """One direction a billion times better known than the others, and correlated with them."""
    lever = np.array([[1.0, 0, -1e4], [0, 1, 1e4], [0, 0, 1]])
    bad = lever @ np.diag([1e-8, 1e-8, 1.0]) @ lever.T
    edges = BetweenFactors(np.array([0]), np.array([1]), np.zeros((1, 3)), bad[None])
    information = edges.information[0]
    assert np.array_equal(information, information.T)
    scale = np.sqrt(np.diag(bad))
    assert np.linalg.eigvalsh(information * np.outer(scale, scale))[0] > 0
    np.linalg.cholesky(information * np.outer(scale, scale))


def test_ordinary_covariances_are_inverted_as_they_are() -> None:
    edges = pose_edges(np.random.default_rng(18), np.zeros((2, 3)), [(0, 1)], (0.1, 0.05, 0.02))
    assert np.allclose(edges.information[0] @ edges.covariance[0], np.eye(3), atol=1e-7)


def test_doubts_are_of_any_track_or_antenna() -> None:
    none, one = np.zeros(2, dtype=bool), np.array([False, True])
    assert not Doubted.none(2).any()
    assert Doubted.none(2).track.tolist() == Doubted.none(2).antenna.tolist() == [False, False]
    assert Doubted(one, none).any()
    assert Doubted(none, one).any()


def test_some_of_the_factors_are_chosen_with_all_their_columns() -> None:
    problem, _ = team_problem(3, robots=2, count=5, is_thinned=True)
    which = np.array([True, True, False, False, True])
    few = problem.ranges.chosen(which)
    assert len(few) == 3
    # of five the second and the last were carried
    assert problem.ranges.is_carried.tolist() == [False, True, False, False, True]
    assert few.carried.rows.tolist() == [1, 2]
    assert np.array_equal(few.carried.moves, problem.ranges.carried.moves)
    one = problem.ranges.chosen(~which | (np.arange(5) == 4)).carried
    assert one.rows.tolist() == [2]
    assert np.array_equal(one.moves, problem.ranges.carried.moves[1:])
    for name in ("i", "j", "q_i", "q_j", "measured", "sigma", "pair", "robots", "turned"):
        assert np.array_equal(getattr(few, name), getattr(problem.ranges, name)[which])
    closures = problem.closures.chosen(np.array([False, True, False]))
    assert np.array_equal(closures.measured, problem.closures.measured[1:2])
    assert len(no_ranges().chosen(np.zeros(0, dtype=bool))) == 0
    assert isinstance(few, RangeFactors)


def test_what_errors_cost_is_their_information() -> None:
    edges = pose_edges(
        np.random.default_rng(5), np.zeros((3, 3)), [(0, 1), (1, 2)], (0.1, 0.2, 0.3)
    )
    errors = np.array([[0.1, -0.2, 0.3], [0.0, 0.4, -0.1]])
    expected = sum(
        float(e @ np.linalg.solve(c, e)) for e, c in zip(errors, edges.covariance, strict=True)
    )
    assert edges.cost(errors) == pytest.approx(expected, rel=1e-6)
    assert edges.chosen(np.zeros(2, dtype=bool)).cost(np.zeros((0, 3))) == 0
