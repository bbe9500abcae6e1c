"""The paper's column of tools/reproduce: consistency and NLS as printed."""

from __future__ import annotations

import networkx as nx
import numpy as np
from lab.reproduce import experiment, paper_column
from lab.score import metrics

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
