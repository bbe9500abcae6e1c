"""The paper's module 3, against truth, finite differences and the daemon's RBCD."""

from __future__ import annotations

import numpy as np
import pytest
from lab.recordings.recording import Array
from lab.reproduce import dpgo
from lab.reproduce.experiment import PAIRS
from lab.reproduce.paper_column import Closures
from lab.score import metrics

from drslamd.slam.optimizer.rbcd import riemannian_descent

POSES = 40


def paths(rng: np.random.Generator, wrong: float) -> tuple[dict[int, Array], dict[int, Array]]:
    """True poses of three robots and what their odometry says of them."""
    truth, odometry = {}, {}
    for robot in range(3):
        step = np.column_stack(
            [np.full(POSES, 0.2), np.zeros(POSES), np.cumsum(rng.normal(0, 0.1, POSES)) * 0.3]
        )
        poses = [rng.uniform(-3, 3, 3)]
        reckoned = [np.zeros(3)]
        for move in step[1:]:
            poses.append(metrics.compose(poses[-1], move))
            error = rng.normal(0, wrong, 3) * [1, 1, 0.5]
            reckoned.append(metrics.compose(reckoned[-1], move + error))
        truth[robot], odometry[robot] = np.array(poses), np.array(reckoned)
    return truth, odometry


def closures(
    rng: np.random.Generator, truth: dict[int, Array], wrong: float
) -> dict[tuple[int, int], Closures]:
    out = {}
    for a, b in PAIRS:
        k = np.arange(0, POSES, 4)
        true = metrics.relative(truth[a][k], truth[b][k])
        noise = rng.normal(0, wrong, true.shape)
        out[a, b] = Closures(k, true + noise, np.tile(0.01 * np.eye(3), (len(k), 1, 1)))
    return out


def test_dpgo_finds_the_truth_when_nothing_is_wrong() -> None:
    rng = np.random.default_rng(1)
    truth, odometry = paths(rng, 0.0)
    solved = dpgo.solve(dpgo.graph(odometry, closures(rng, truth, 0.0)))
    for robot in range(3):
        expected = metrics.relative(truth[0][:1], truth[robot])
        # odometry is rounded to 0.1 mm and 0.1 mrad
        assert solved[robot][:, :2] == pytest.approx(expected[:, :2], abs=5e-3)


def test_riemannian_descent_finds_nothing_below_the_minimum() -> None:
    rng = np.random.default_rng(2)
    truth, odometry = paths(rng, 0.02)
    problem = dpgo.graph(odometry, closures(rng, truth, 0.1))
    poses = dpgo.minimum(problem, dpgo.chordal(problem))
    nothing = problem.edges.chosen(np.zeros(0, dtype=np.int64))
    block = riemannian_descent.block(
        problem.edges, nothing, nothing, np.zeros((0, 10), dtype=complex), problem.size
    )
    reached = riemannian_descent.stacked(riemannian_descent.lift(poses, 5))
    start = riemannian_descent.stacked(riemannian_descent.lift(dpgo.chordal(problem), 5))
    assert block.cost(reached) < block.cost(start)
    # from another rank too: the relaxation has no lower point nearby
    shaken = riemannian_descent.retract(reached + 0.01 * rng.normal(size=reached.shape))
    assert block.cost(riemannian_descent.descend(block, shaken, 300)[0]) > block.cost(reached) * (
        1 - 1e-6
    )


def test_dpgos_slope_is_that_of_its_error() -> None:
    rng = np.random.default_rng(3)
    truth, odometry = paths(rng, 0.02)
    problem = dpgo.graph(odometry, closures(rng, truth, 0.1))
    poses = rng.normal(size=(problem.size, 3))
    _, slope = dpgo._linearised(problem, poses)
    direction = rng.normal(size=poses.shape)
    direction[0] = 0
    ahead, _ = dpgo._linearised(problem, poses + 1e-6 * direction)
    behind, _ = dpgo._linearised(problem, poses - 1e-6 * direction)
    expected = (ahead - behind) / 2e-6
    assert slope @ direction.ravel()[3:] == pytest.approx(expected, rel=1e-5, abs=1e-3)
