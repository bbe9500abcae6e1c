"""The columns of tools/reproduce: consistency of the paper, claims of this system."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
from lab.reproduce import experiment, paper_column, table2, team_column, window_columns
from lab.reproduce.tally import Tally
from lab.score import metrics
from lab.score.outcome import Closure

from drslamd.slam.chi_squared import quantile3


def lengths(n: int, wrong: set[int]) -> list[np.ndarray]:
    """Squared lengths of n closures of which some agree with nobody."""
    return [
        np.array([1e6 if {k, i} & wrong else 1.0 for i in range(k)], dtype=float) for k in range(n)
    ]


def test_closures_that_agree_with_nobody_are_left_out() -> None:
    assert paper_column.inliers(lengths(9, {2, 5}), 0.1).tolist() == [0, 1, 3, 4, 6, 7, 8]


def test_the_gate_is_the_quantile_for_one_minus_epsilon() -> None:
    gate = quantile3(0.9)
    assert paper_column.inliers([np.zeros(0), np.array([gate * 1.001])], 0.1).tolist() == [0]
    assert paper_column.inliers([np.zeros(0), np.array([gate * 0.999])], 0.1).tolist() == [0, 1]


def test_the_inliers_are_a_clique_almost_as_large_as_the_largest() -> None:
    rng = np.random.default_rng(5)
    rows = [rng.uniform(0, 12, k) for k in range(30)]
    found = paper_column.inliers(rows, 0.1).tolist()
    graph = nx.Graph()
    graph.add_nodes_from(range(30))
    graph.add_edges_from(
        (k, i) for k, row in enumerate(rows) for i in range(k) if row[i] <= quantile3(0.9)
    )
    assert all(graph.has_edge(i, k) for i in found for k in found if i < k)
    assert len(found) >= 0.75 * max(len(c) for c in nx.find_cliques(graph))


def test_nls_ends_where_the_slope_vanishes() -> None:
    window = experiment.trial(0).window((0, 1), 100, 100)
    assert window is not None
    pose = paper_column.nls(window, 3)
    again = paper_column.nls(window, 3)
    assert pose.tolist() == again.tolist()

    def cost(x: np.ndarray) -> float:
        turned = metrics.compose(x[None], np.column_stack([window.b_points, np.zeros(len(window))]))
        distance = np.hypot(*(turned[:, :2] - window.a_points).T)
        return float(np.sum((distance - window.ranges) ** 2))

    for axis in np.eye(3):
        assert cost(pose) <= cost(pose + 1e-3 * axis) + 1e-9
        assert cost(pose) <= cost(pose - 1e-3 * axis) + 1e-9


def test_joint_ate_does_not_see_where_the_frame_is() -> None:
    rng = np.random.default_rng(6)
    truth = [rng.normal(size=(20, 3)) for _ in range(3)]
    moved = [metrics.compose(np.array([[4.0, -2.0, 1.0]]), t) for t in truth]
    assert table2.joint_ate(moved, truth) == pytest.approx(0.0, abs=1e-12)
    moved[0] = moved[0] + [0.3, 0.0, 0.0]
    assert 0.05 < table2.joint_ate(moved, truth) < 0.3


def test_a_claim_counts_on_the_right_side_of_each_threshold() -> None:
    covariance = np.diag([0.04, 0.04, 0.01])
    for squared, below, wild in ((14.1, 1, 0), (14.3, 0, 0), (50.1, 0, 1)):
        tally = Tally()
        pose = np.array([0.2 * np.sqrt(squared), 0.0, 0.0])
        team_column.claim(tally, "x", pose, covariance, np.zeros(3))
        assert tally["x/nees"].mean == pytest.approx(squared / 3)
        assert tally["x/below"].mean == below
        assert tally["x/wild"].mean == wild


def test_a_mahalanobis_error_crosses_the_half_turn_and_leaves_its_arguments() -> None:
    pose, truth = np.array([0.0, 0.0, 3.1]), np.array([0.0, 0.0, -3.1])
    squared = team_column.mahalanobis(pose, np.eye(3), truth)
    assert squared == pytest.approx((2 * np.pi - 6.2) ** 2)
    assert pose[2] == 3.1


def test_only_closures_that_name_one_pose_are_held_to_their_claim() -> None:
    trial = experiment.trial(0)
    truth = trial.true_pairs(0, 1)[30]
    t = float(experiment.POSE_TIMES[30])
    one = np.array([truth + [0.1, 0.0, 0.0]])
    covariance = np.array([np.eye(3)])
    two = np.concatenate([one, one + 5])
    found = [
        Closure(t, 0, 1, "unique", one, covariance, True),
        Closure(t, 0, 1, "ambiguous", two, np.concatenate([covariance, covariance]), True),
        Closure(t, 0, 1, "not enough motion", np.zeros((0, 3)), np.zeros((0, 3, 3)), False),
    ]
    tally = Tally()
    team_column.closures(tally, trial, found)
    assert tally["drslamd/before/m"].n == 1
    assert tally["drslamd/before/m"].mean == pytest.approx(0.1, abs=1e-6)
    assert tally["drslamd/claim/nees"].n == 1
    assert tally["drslamd/keeps"].n == 2
    assert tally["drslamd/verdict/not enough motion"].n == 1


def test_windows_are_answered_by_every_way_and_by_both_columns() -> None:
    tally = window_columns.table1(experiment.trial(0), 332, 332)
    for tau in window_columns.TAUS:
        for way in ("nls", "coarse", "both"):
            assert tally[f"table1/{tau}/{way}/m"].n == 6
        assert tally[f"table1/{tau}/drslamd/unique"].n == 6
