"""What is claimed of poses whose edges err together."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slam_scenes import NOISE, closure, group_of, keyframes, model_of

from drslamd.conventions import GRID_HZ, Chain
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.optimizer.closures.claimed import (
    NOBODY,
    WINDOW_N,
    EdgeErrors,
    WholeGraph,
    claim,
)
from drslamd.slam.se2 import Array

ONE, OTHER = Chain(3, 1), Chain(8, 1)
SIGMA, METRES = 0.05, 20
"""Of a closure, m and rad; how far both drive, a keyframe a metre."""


def straight_team(closures_at: list[int], step_m: float = 1.0) -> WholeGraph:
    """Two robots drive ahead side by side, 3 m apart; closures at some of their keyframes."""
    n = GRID_HZ * np.arange(METRES + 1)
    poses = np.zeros((METRES + 1, 3))
    poses[:, 0] = step_m * np.arange(METRES + 1)
    graph = PoseGraph()
    for chain in (ONE, OTHER):
        graph.insert(chain, GraphEntry(0, model_of(NOISE), keyframes(n, poses)))
    for k in closures_at:
        item = closure(k, int(n[k]), OTHER, int(n[k]), np.array([0.0, 3.0, 0.0]), SIGMA)
        graph.insert(ONE, GraphEntry(1 + k, closures=(item,)))
    return WholeGraph.of(graph, group_of(graph))


def last_of(whole: WholeGraph, robot: int) -> Array:
    """(3, 3) claimed of a robot's last pose."""
    return whole.joint([int(whole.places.of_robot(robot)[-1])])


def test_a_wrong_wheel_is_wrong_in_all_links_alike() -> None:
    """20 m of a scale, in line, are 20 times one; of a yaw rate the turn grows as the way, and what
    lies across as the square of it."""
    found = last_of(straight_team([0]), ONE.robot)
    way = float(METRES)
    random_m, random_rad = NOISE.translation_per_sqrt_m**2 * way, NOISE.yaw_rad_per_sqrt_m**2 * way
    assert found[0, 0] == pytest.approx((NOISE.scale * way) ** 2 + random_m, rel=0.02)
    assert found[2, 2] == pytest.approx((NOISE.yaw_rad_per_m * way) ** 2 + random_rad, rel=0.02)
    across = (NOISE.yaw_rad_per_m * way**2 / 2) ** 2 + NOISE.yaw_rad_per_sqrt_m**2 * way**3 / 3
    assert found[1, 1] == pytest.approx(across + random_m, rel=0.02)


def test_closures_of_one_window_are_one_witness() -> None:
    """Ten within a decimetre say hardly more than one of them."""
    sigmas = []
    for places in ([METRES], list(range(METRES - 9, METRES + 1))):
        whole = straight_team(places, step_m=0.01)
        a, b = (int(whole.places.of_robot(robot)[-1]) for robot in (ONE.robot, OTHER.robot))
        joint = whole.joint([a, b])
        away = np.hstack([-np.eye(3), np.eye(3)])
        sigmas.append(math.sqrt((away @ joint @ away.T)[0, 0]))
    alone, together = sigmas
    assert alone == pytest.approx(SIGMA, rel=0.05)
    assert together == pytest.approx(alone, rel=0.1)


@pytest.mark.parametrize(("apart", "shared"), [(WINDOW_N // 2, 2.0), (WINDOW_N // 2 + 1, 1.0)])
def test_closures_share_what_was_ranged_up_to_half_a_window_apart(
    apart: int, shared: float
) -> None:
    n = np.array([0, apart])
    graph = PoseGraph()
    for chain in (ONE, OTHER):
        graph.insert(chain, GraphEntry(0, model_of(NOISE), keyframes(n, np.zeros((2, 3)))))
    for k, at in enumerate(n.tolist()):
        item = closure(k, at, OTHER, at, np.array([0.0, 3.0, 0.0]), SIGMA)
        graph.insert(ONE, GraphEntry(1 + k, closures=(item,)))
    errors = WholeGraph.of(graph, group_of(graph)).errors
    of_closures = errors.random[errors.robot == NOBODY]
    assert of_closures[:, 0, 0] == pytest.approx([shared * SIGMA**2] * 2)


def test_what_is_claimed_is_what_many_teams_err() -> None:
    """Poses that follow edges as `gains` say, of edges that err as told, a thousand times."""
    rng = np.random.default_rng(4)
    gains, count = rng.normal(size=(6, 3, 6)), 4000
    random = np.stack([a @ a.T for a in rng.normal(size=(6, 3, 3))])
    robot = np.array([NOBODY, 3, 3, 3, 8, 8])
    constant = rng.normal(size=(6, 2, 3)) * (robot != NOBODY)[:, None, None]
    own = np.linalg.cholesky(random) @ rng.normal(size=(count, 6, 3, 1))
    swing = {r: rng.normal(size=(count, 2)) for r in (3, 8, NOBODY)}
    each = np.stack([swing[int(r)] @ constant[m] for m, r in enumerate(robot)], axis=1)
    poses = np.einsum("nma,mac->nc", own[..., 0] + each, gains)
    found = claim(gains, EdgeErrors(random, robot, constant))
    sigma = np.sqrt(np.diag(found))
    off = (np.cov(poses.T) - found) / np.outer(sigma, sigma)
    assert np.abs(off).max() < 0.1
