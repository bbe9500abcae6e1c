"""A shared pose graph of relative poses: order and loss do not matter."""

from __future__ import annotations

import numpy as np
import pytest
from lab.benchmark.over_messages.relative_graph import components, solve
from lab.benchmark.over_messages.relative_poses import EDGE, RelativePoses

from drslamd.slam import se2
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.complex_factors import ComplexFactors

A, B = 2, 5
LENGTH = 12
RNG = np.random.default_rng(4)
W_T_K = {c: RNG.normal(0, 3, (LENGTH, 3)) for c in (A, B)}


def entry(
    seq: int, a: int, b: int, a_n: list[int], b_n: list[int], noise: float = 0.0
) -> tuple[tuple[int, int], RelativePoses]:
    """True relative poses with some noise, by origin and number."""
    measured = se2.between(W_T_K[a][a_n], W_T_K[b][b_n])
    measured += noise * np.random.default_rng(len(a_n)).normal(size=measured.shape)
    edges = np.empty(len(a_n), EDGE)
    edges["a_n"], edges["b_n"] = a_n, b_n
    edges["x"], edges["y"], edges["theta"] = measured.T
    edges["tau"] = 1.0 + np.arange(len(a_n))
    edges["kappa"] = 3.0 * edges["tau"]
    return (a, seq), RelativePoses(seq, b, edges)


STEPS = list(range(LENGTH - 1)), list(range(1, LENGTH))


def entries(noise: float) -> dict[tuple[int, int], RelativePoses]:
    return dict(
        [
            entry(0, A, A, *STEPS, noise),
            entry(0, B, B, *STEPS, noise),
            entry(1, A, B, [1, 5, 9], [1, 5, 9], noise),
        ]
    )


def test_without_noise_everybody_is_where_he_was() -> None:
    solved = solve(entries(0.0), A)
    assert solved is not None
    assert solved.converged
    assert len(solved.n) == 2 * LENGTH
    truth = np.array([W_T_K[r][n] for r, n in zip(solved.robot, solved.n, strict=True)])
    moved = se2.between(truth[:1], truth), se2.between(solved.poses[:1], solved.poses)
    np.testing.assert_allclose(moved[0][:, :2], moved[1][:, :2], atol=1e-7)
    np.testing.assert_allclose(se2.wrap(moved[0][:, 2] - moved[1][:, 2]), 0, atol=1e-7)


def test_the_order_of_arrival_changes_nothing() -> None:
    parts = entries(0.1)
    one, other = solve(parts, A), solve(dict(reversed(parts.items())), B)
    assert one is not None
    assert other is not None
    assert one.poses.tolist() == other.poses.tolist()


def test_two_measurements_of_one_relative_pose_both_count() -> None:
    twice = entries(0.1) | dict([entry(2, A, B, [5, 5], [5, 5], 0.3)])
    solved = solve(twice, A)
    assert solved is not None
    names = zip(solved.robot.tolist(), solved.n.tolist(), strict=True)
    at = {name: k for k, name in enumerate(names)}
    rows = [
        (at[origin, a_n], at[poses.peer, b_n], x + 1j * y, theta, tau, kappa)
        for (origin, _), poses in twice.items()
        for a_n, b_n, x, y, theta, tau, kappa in poses.edges.tolist()
    ]
    i, j, shift, theta, tau, kappa = (np.array(column) for column in zip(*rows, strict=True))
    edges = ComplexFactors(i, j, np.exp(1j * theta), shift, kappa, tau)
    assert len(edges) == 2 * (LENGTH - 1) + 3 + 2
    assert solved.cost == pytest.approx(PoseGraphSolver(edges, len(at)).cost(solved.poses))


def test_what_is_not_connected_to_us_waits() -> None:
    apart = {name: poses for name, poses in entries(0.0).items() if name != (A, 1)}
    solved = solve(apart, B)
    assert solved is not None
    assert set(solved.robot.tolist()) == {5}


def test_nothing_is_solved_from_nothing() -> None:
    assert solve({}, A) is None
    assert solve({(A, 0): entries(0.0)[A, 0]}, B) is None


def test_a_pose_relative_to_itself_says_nothing() -> None:
    name, ring = entry(7, A, A, [3], [3])
    ring.edges["x"], ring.edges["theta"] = 5.0, 1.0
    before, after = solve(entries(0.1), A), solve(entries(0.1) | {name: ring}, A)
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
