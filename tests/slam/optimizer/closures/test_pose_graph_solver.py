"""The exact solver of pose graphs, against scipy's least squares and by its own laws."""

from pathlib import Path

import numpy as np
import pytest
from lab.recordings import g2o
from places import SHARED
from scipy.optimize import least_squares

from drslamd.slam import se2
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.problem import BetweenFactors

Array = np.ndarray


def edges_of(i: Array, j: Array, measured: Array, kappa: Array, tau: Array) -> ComplexFactors:
    shift = measured[:, 0] + 1j * measured[:, 1]
    return ComplexFactors(i, j, np.exp(1j * measured[:, 2]), shift, kappa, tau)


def graph(count: int, loops: int, noise: float, seed: int, reach: int = 6) -> ComplexFactors:
    """A chain that winds about, with loops, measured with some noise (m and rad)."""
    rng = np.random.default_rng(seed)
    steps = np.column_stack([np.ones(count), np.zeros(count), rng.normal(0, 0.5, count)])
    poses = np.zeros((count, 3))
    for k in range(1, count):
        poses[k] = se2.compose(poses[k - 1], steps[k])
    a = rng.integers(0, count - reach, loops)
    i = np.concatenate([np.arange(count - 1), a])
    j = np.concatenate([np.arange(1, count), a + rng.integers(2, reach + 1, loops)])
    flip = rng.random(len(i)) < 0.3
    i, j = np.where(flip, j, i), np.where(flip, i, j)
    measured = se2.between(poses[i], poses[j]) + noise * rng.normal(size=(len(i), 3))
    weights = rng.uniform(0.5, 2, (2, len(i)))
    return edges_of(i, j, measured, weights[0] * 100, weights[1] * 50)


def by_scipy(edges: ComplexFactors, start: Array) -> float:
    """Least cost by scipy, the cost written down once more."""

    def residuals(x: Array) -> Array:
        theta, p = x[0::3], x[1::3] + 1j * x[2::3]
        z = np.exp(1j * theta)
        turn = np.sqrt(edges.kappa) * (z[edges.j] - z[edges.i] * edges.turn)
        move = np.sqrt(edges.tau) * (p[edges.j] - p[edges.i] - z[edges.i] * edges.shift)
        return np.concatenate([turn.real, turn.imag, move.real, move.imag])

    x = start[:, [2, 0, 1]].ravel()
    found = least_squares(residuals, x, method="lm", xtol=1e-14, ftol=1e-14)
    return float(2 * found.cost)


@pytest.mark.parametrize("seed", range(3))
def test_the_minimum_is_that_of_scipy(seed: int) -> None:
    edges = graph(40, 30, 0.05, seed)
    answer = PoseGraphSolver(edges, 40).solve()
    assert answer.converged
    assert answer.cost == pytest.approx(by_scipy(edges, answer.poses), rel=1e-9)
    assert by_scipy(edges, PoseGraphSolver(edges, 40).chordal_start()) >= answer.cost * (1 - 1e-9)


def test_without_noise_the_chordal_start_is_the_answer() -> None:
    edges = graph(200, 100, 0.0, 7)
    solver = PoseGraphSolver(edges, 200)
    assert solver.cost(solver.chordal_start()) < 1e-12
    assert solver.solve().steps <= 2


def test_a_start_that_is_far_off_ends_in_a_minimum_as_well() -> None:
    edges = graph(60, 60, 0.05, 3)
    solver = PoseGraphSolver(edges, 60)
    start = solver.solve().poses + np.random.default_rng(0).normal(0, 0.5, (60, 3))
    answer = solver.solve(start)
    assert answer.converged
    assert answer.cost == pytest.approx(solver.solve().cost, rel=1e-8)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("reach", [6, 38])
def test_no_start_is_so_wild_that_the_cost_ever_rises(seed: int, reach: int) -> None:
    edges = graph(50, 30, 0.05, seed, reach)
    solver = PoseGraphSolver(edges, 50)
    start = np.random.default_rng(seed).normal(0, 4, (50, 3))
    costs = [solver.cost(start)] + [solver.solve(start, most=k).cost for k in range(1, 40)]
    assert np.diff(costs).max() <= 1e-9 * costs[0]
    answer = solver.solve(start, most=500)
    assert answer.converged
    # a minimum, though perhaps not the least: no direction leads down
    around = [solver.cost(answer.poses + step.reshape(50, 3)) for step in 1e-4 * np.eye(150)]
    assert min(around) > answer.cost * (1 - 1e-7)


def test_near_the_minimum_a_few_steps_are_enough_however_large_the_noise() -> None:
    """Newton's Hessian takes five from here, that of Gauss and Newton many more."""
    edges = graph(100, 100, 0.3, 4)
    solver = PoseGraphSolver(edges, 100)
    there = solver.solve(tolerance=1e-12)
    start = there.poses + np.random.default_rng(1).normal(0, 0.02, (100, 3))
    answer = solver.solve(start)
    assert answer.steps <= 5
    assert answer.cost == pytest.approx(there.cost, rel=1e-9)


def test_a_cost_that_is_stated_falls_with_every_pose_that_moves() -> None:
    edges = graph(30, 20, 0.05, 5)
    solver = PoseGraphSolver(edges, 30)
    answer = solver.solve()
    assert solver.cost(answer.poses) == pytest.approx(answer.cost, rel=1e-12)
    rng = np.random.default_rng(0)
    for _ in range(20):
        assert solver.cost(answer.poses + rng.normal(0, 1e-3, (30, 3))) > answer.cost


def test_two_closures_between_the_same_two_poses_both_count() -> None:
    once = edges_of(
        np.array([0, 0]),
        np.array([1, 1]),
        np.array([[1.0, 0, 0], [2.0, 0, 0]]),
        np.ones(2),
        np.array([1.0, 3.0]),
    )
    answer = PoseGraphSolver(once, 2).solve()
    # the weighted mean of both, and its scatter: 1 * 0.75^2 + 3 * 0.25^2
    assert answer.poses[1, 0] - answer.poses[0, 0] == pytest.approx(1.75)
    assert answer.cost == pytest.approx(0.75)


def test_the_order_of_the_poses_does_not_change_the_cost() -> None:
    edges = graph(200, 150, 0.05, 2)
    narrow = PoseGraphSolver(edges, 200).solve()
    order = np.random.default_rng(0).permutation(200)
    mixed = ComplexFactors(
        order[edges.i], order[edges.j], edges.turn, edges.shift, edges.kappa, edges.tau
    )
    wide = PoseGraphSolver(mixed, 200).solve()
    assert wide.cost == pytest.approx(narrow.cost, rel=1e-10)


@pytest.mark.parametrize("gauge", [0, 17])
@pytest.mark.parametrize("reach", [6, 38])
def test_edges_as_wrong_as_they_weigh_make_a_block_of_the_dense_inverse(
    gauge: int, reach: int
) -> None:
    """G' W^-1 G is H^-1: information summed edge by edge, the gauge's rows and columns left out."""
    edges = graph(40, 30, 0.0, 11, reach)
    solver = PoseGraphSolver(edges, 40, gauge)
    poses = solver.solve().poses
    information = np.zeros((120, 120))
    for i, j, shift, kappa, tau in zip(
        edges.i, edges.j, edges.shift, edges.kappa, edges.tau, strict=True
    ):
        arm = np.exp(1j * poses[i, 2]) * shift
        j_i = np.array([[-1, 0, arm.imag], [0, -1, -arm.real], [0, 0, -1]])
        jacobian = np.zeros((3, 120))
        jacobian[:, 3 * i : 3 * i + 3], jacobian[:, 3 * j : 3 * j + 3] = j_i, np.eye(3)
        information += jacobian.T @ np.diag([tau, tau, kappa]) @ jacobian
    free = np.delete(np.arange(120), 3 * gauge + np.arange(3))
    inverse = np.zeros((120, 120))
    inverse[np.ix_(free, free)] = np.linalg.inv(information[np.ix_(free, free)])
    wanted = [39, 3, 20]
    at = (3 * np.array(wanted)[:, None] + np.arange(3)).ravel()
    expected = inverse[np.ix_(at, at)]
    sigma = np.sqrt(np.diag(expected))
    wrong = np.sqrt(1 / np.stack([edges.tau, edges.tau, edges.kappa], axis=-1))
    moved = (wrong[:, :, None] * solver.gains(poses, wanted)).reshape(-1, 9)
    off = (moved.T @ moved - expected) / np.outer(sigma, sigma)
    assert np.abs(off).max() < 1e-5


@pytest.mark.parametrize("gauge", [0, 5])
def test_poses_follow_what_edges_measure_by_their_gains(gauge: int) -> None:
    """Against the solver itself, each measurement a little more and a little less: turned poses,
    loops, and errors told in the frame of the first pose of each edge."""
    rng, count, wanted = np.random.default_rng(3), 12, [11, 7]
    poses = np.cumsum(rng.normal(size=(count, 3)), axis=0)
    i, j = np.r_[np.arange(count - 1), 0, 3, 9], np.r_[np.arange(1, count), 7, 11, 1]
    measured = se2.between(poses[i], poses[j])
    spread = np.tile(0.04 * np.eye(3), (len(i), 1, 1)) * rng.uniform(0.5, 2, (len(i), 1, 1))

    def solved(measured: Array) -> tuple[PoseGraphSolver, Array]:
        edges = ComplexFactors.of(BetweenFactors(i, j, measured, spread))
        solver = PoseGraphSolver(edges, count, gauge)
        found = solver.solve(poses, tolerance=1e-14).poses
        w_T_any = se2.compose(poses[gauge], se2.inverse(found[gauge]))
        return solver, se2.compose(w_T_any[None], found)

    solver, found = solved(measured)
    gains = solver.gains(found, wanted)
    for edge in (0, 4, len(i) - 1):
        for axis in range(3):
            moved = []
            for by in (1e-4, -1e-4):
                other = measured.copy()
                other[edge, axis] += by
                moved.append(solved(other)[1][wanted])
            off = moved[0] - moved[1]
            off[:, 2] = se2.wrap(off[:, 2])
            assert off.ravel() / 2e-4 == pytest.approx(gains[edge, axis], abs=1e-5)


CERTIFIED = {
    "team3_400": 1992.71324672,
    "CSAIL": 31.4703316653,
    "input_MITb_g2o": 61.1541155245,
    "input_INTEL_g2o": 393.652540982,
}
"""Optima certified by SE-Sync."""


@pytest.mark.parametrize("name", CERTIFIED)
def test_public_graphs_are_solved_to_their_certified_optimum(name: str) -> None:
    path = SHARED / "data" / "posegraphs" / f"{name}.g2o"
    if not path.exists():
        pytest.skip(f"no {path}")
    read = g2o.read(Path(path))
    spread = np.trace(np.linalg.inv(read.information[:, :2, :2]), axis1=1, axis2=2)
    edges = edges_of(read.i, read.j, read.measured, 2 * read.information[:, 2, 2], 2 / spread)
    answer = PoseGraphSolver(edges, len(read.ids)).solve()
    assert abs(answer.cost / CERTIFIED[name] - 1) < 1e-8
