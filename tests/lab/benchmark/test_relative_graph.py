"""A shared pose graph of relative poses: order, loss and starts of the team do not matter."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lab.benchmark.relative_graph import components, solve

from drslamd.conventions import Chain
from drslamd.slam import se2
from drslamd.slam.graph.measurements import GraphEntry, RelativePoses
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.complex_factors import ComplexFactors

A, B = Chain(2, 10), Chain(5, 20)
LENGTH = 12
RNG = np.random.default_rng(4)
W_T_K = {c: RNG.normal(0, 3, (LENGTH, 3)) for c in (A, B)}


def batch(a: Chain, b: Chain, a_n: list[int], b_n: list[int], noise: float = 0.0) -> RelativePoses:
    """True relative poses with some noise."""
    measured = se2.between(W_T_K[a][a_n], W_T_K[b][b_n])
    measured += noise * np.random.default_rng(len(a_n)).normal(size=measured.shape)
    x, y, theta = (tuple(column) for column in measured.T.tolist())
    weight = tuple(1.0 + k for k in range(len(a_n)))
    return RelativePoses(b, tuple(a_n), tuple(b_n), x, y, theta, weight, weight)


STEPS = list(range(LENGTH - 1)), list(range(1, LENGTH))


def entries(noise: float) -> list[tuple[Chain, GraphEntry]]:
    return [
        (A, GraphEntry(0, relative=(batch(A, A, *STEPS, noise),))),
        (B, GraphEntry(0, relative=(batch(B, B, *STEPS, noise),))),
        (A, GraphEntry(1, relative=(batch(A, B, [1, 5, 9], [1, 5, 9], noise),))),
    ]


def filled(parts: list[tuple[Chain, GraphEntry]]) -> PoseGraph:
    graph = PoseGraph()
    for origin, entry in parts:
        graph.insert(origin, entry)
    return graph


def test_without_noise_everybody_is_where_he_was() -> None:
    solved = solve(filled(entries(0.0)), A)
    assert solved is not None
    assert solved.converged
    assert len(solved.n) == 2 * LENGTH
    truth = np.array(
        [W_T_K[A if r == 2 else B][n] for r, n in zip(solved.robot, solved.n, strict=True)]
    )
    moved = se2.between(truth[:1], truth), se2.between(solved.poses[:1], solved.poses)
    np.testing.assert_allclose(moved[0][:, :2], moved[1][:, :2], atol=1e-7)
    np.testing.assert_allclose(se2.wrap(moved[0][:, 2] - moved[1][:, 2]), 0, atol=1e-7)


def test_order_and_repetition_change_nothing() -> None:
    parts = entries(0.1)
    one, other = solve(filled(parts), A), solve(filled([*parts[::-1], *parts]), B)
    assert one is not None
    assert other is not None
    assert one.poses.tolist() == other.poses.tolist()


def test_two_measurements_of_one_relative_pose_both_count() -> None:
    twice = [*entries(0.1), (A, GraphEntry(2, relative=(batch(A, B, [5, 5], [5, 5], 0.3),)))]
    solved = solve(filled(twice), A)
    assert solved is not None
    batches = [(o, b) for o, e in twice for b in e.relative]
    names = zip(solved.robot.tolist(), solved.n.tolist(), strict=True)
    at = {name: k for k, name in enumerate(names)}
    rows = [
        (at[o.robot, b.a_n[k]], at[b.chain.robot, b.b_n[k]], b.x[k] + 1j * b.y[k], b.theta[k],
         b.tau[k], b.kappa[k])
        for o, b in batches for k in range(len(b.a_n))
    ]  # fmt: skip
    i, j, shift, theta, tau, kappa = (np.array(column) for column in zip(*rows, strict=True))
    edges = ComplexFactors(i, j, np.exp(1j * theta), shift, kappa, tau)
    assert len(edges) == 2 * (LENGTH - 1) + 3 + 2
    assert solved.cost == pytest.approx(PoseGraphSolver(edges, len(at)).cost(solved.poses))


def test_what_is_not_connected_to_us_waits() -> None:
    solved = solve(filled(entries(0.0)[:2]), B)
    assert solved is not None
    assert set(solved.robot.tolist()) == {5}


def test_nothing_is_solved_from_nothing() -> None:
    assert solve(PoseGraph(), A) is None
    assert solve(filled(entries(0.0)[:1]), B) is None


def test_edges_to_an_earlier_start_of_a_peer_no_longer_count() -> None:
    graph = filled(entries(0.0))
    graph.insert(Chain(5, 21), GraphEntry(0))
    solved = solve(graph, A)
    assert solved is not None
    assert set(solved.robot.tolist()) == {2}


@pytest.mark.parametrize(
    "harm",
    [{"x": 1e9}, {"theta": -1e300}, {"tau": 1e12}, {"tau": 1e-9}, {"kappa": 1e12}, {"kappa": 1e-9}],
)
def test_a_batch_with_nonsense_in_it_moves_nobody(harm: dict[str, float]) -> None:
    graph = filled(entries(0.1))
    before = solve(graph, A)
    wild = batch(A, B, [2, 6], [2, 6])
    columns: dict[str, Any] = {
        name: (value, getattr(wild, name)[1]) for name, value in harm.items()
    }
    graph.insert(A, GraphEntry(7, relative=(replace(wild, **columns),)))
    after = solve(graph, A)
    assert before is not None
    assert after is not None
    assert after.poses.tolist() == before.poses.tolist()


def test_the_largest_noise_and_the_smallest_are_still_believed() -> None:
    graph = filled(entries(0.1))
    for seq, weight in enumerate((1.2e-5, 0.9e8), start=8):
        stiff = replace(batch(A, B, [2], [2]), tau=(weight,), kappa=(weight,))
        graph.insert(A, GraphEntry(seq, relative=(stiff,)))
        assert graph.chains[A.robot].relative[seq]


def test_a_pose_relative_to_itself_says_nothing() -> None:
    graph = filled(entries(0.1))
    before = solve(graph, A)
    ring = replace(batch(A, A, [3], [3]), x=(5.0,), theta=(1.0,))
    graph.insert(A, GraphEntry(7, relative=(ring,)))
    after = solve(graph, A)
    assert before is not None
    assert after is not None
    assert after.poses.tolist() == before.poses.tolist()


def test_components_are_those_of_a_flood() -> None:
    rng = np.random.default_rng(0)
    i, j = rng.integers(0, 300, (2, 200))
    label = components(i, j, 300)
    expected = np.arange(300)
    for _ in range(300):
        low = np.minimum(expected[i], expected[j])
        np.minimum.at(expected, i, low)
        np.minimum.at(expected, j, low)
    assert label.tolist() == expected.tolist()
