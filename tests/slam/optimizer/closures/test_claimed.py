"""What is claimed of poses whose edges err together."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, closure, group_of, keyframes, model_of, small_team

from drslamd.conventions import GRID_HZ, Chain
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.closures.claimed import (
    NOBODY,
    WINDOW_N,
    EdgeErrors,
    WholeGraph,
    claim,
)
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
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
    return whole.joint([int(whole.places.of_robot(robot)[-1])], solved(whole))


def solved(whole: WholeGraph) -> Array:
    """(n, 3)."""
    return whole.in_frame(PoseGraphSolver(whole.edges, len(whole.places.n)).solve().poses)


def of_two(told: list[tuple[Chain, int, int]], window_n: int = WINDOW_N) -> WholeGraph:
    """Who told a closure of which samples on the clocks of both, robots that stand."""
    graph = PoseGraph()
    for chain, at in ((ONE, 1), (OTHER, 2)):
        n = np.array(sorted({t[at] for t in told}))
        graph.insert(chain, GraphEntry(0, model_of(NOISE), keyframes(n, np.zeros((len(n), 3)))))
    for k, (teller, n_one, n_other) in enumerate(told):
        is_one = teller == ONE
        peer, a_n, b_n = (OTHER, n_one, n_other) if is_one else (ONE, n_other, n_one)
        away = np.array([0.0, 3.0 if is_one else -3.0, 0.0])
        item = closure(k, a_n, peer, b_n, away, SIGMA)
        graph.insert(teller, GraphEntry(1 + k, closures=(item,)))
    return WholeGraph.of(graph, group_of(graph), window_n)


def shares(whole: WholeGraph) -> Array:
    """Of each closure, times its covariance."""
    return np.asarray(whole.errors.random[whole.errors.is_closure][:, 0, 0]) / SIGMA**2


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
        joint = whole.joint([a, b], solved(whole))
        away = np.hstack([-np.eye(3), np.eye(3)])
        sigmas.append(math.sqrt((away @ joint @ away.T)[0, 0]))
    alone, together = sigmas
    assert alone == pytest.approx(SIGMA, rel=0.05)
    assert together == pytest.approx(alone, rel=0.1)


@pytest.mark.parametrize("window_n", [WINDOW_N, 3 * WINDOW_N])
@pytest.mark.parametrize(("more", "shared"), [(0, 2.0), (1, 1.0)])
def test_closures_share_what_was_ranged_up_to_half_a_window_apart(
    more: int, shared: float, window_n: int
) -> None:
    later = window_n // 2 + more
    whole = of_two([(ONE, 0, 0), (ONE, later, later)], window_n)
    assert shares(whole) == pytest.approx([shared, shared])


def test_whoever_of_the_two_told_a_closure_and_whatever_his_clock_says() -> None:
    ahead = 36_000
    whole = of_two([(ONE, 0, ahead), (ONE, 1, ahead + 1), (OTHER, 2, ahead + 2)])
    assert shares(whole) == pytest.approx([3.0, 3.0, 3.0])


def test_closures_of_other_pairs_share_nothing() -> None:
    team = small_team(1, count=5)
    n, chains = team.n, team.chains
    for b in (1, 2):
        item = closure(b, int(n[0][2]), chains[b], int(n[b][2]), np.array([0.0, 3.0, 0.0]), SIGMA)
        team.graph.insert(chains[0], GraphEntry(1000 + b, closures=(item,)))
    places = factors.numbering(team.graph, group_of(team.graph).members)
    given = factors.closures(team.graph, places)
    whole = WholeGraph.of(team.graph, group_of(team.graph))
    mine = whole.errors.random[whole.errors.is_closure]
    pairs = np.sort(places.robot[np.stack([given.i, given.j])], axis=0).T.tolist()
    expected = np.array([pairs.count(pair) for pair in pairs])
    assert mine[:, 0, 0] / given.covariance[:, 0, 0] == pytest.approx(expected)
    assert 0 < expected.min() < len(given)


def test_who_hangs_on_closures_that_are_not_believed_is_not_known() -> None:
    """They weigh a millionth, and say as little of how wrong they are."""
    whole = of_two([(ONE, 0, 0)])
    edges = whole.edges
    weights = np.where(whole.errors.is_closure, 1e-6, 1.0)
    weighed = replace(edges, tau=weights * edges.tau, kappa=weights * edges.kappa)
    ends = [int(whole.places.of_robot(OTHER.robot)[-1])]
    poses = solved(whole)
    believed, doubted = (np.sqrt(whole.joint(ends, poses, w)[0, 0]) for w in (edges, weighed))
    assert believed == pytest.approx(SIGMA, rel=0.05)
    assert doubted == pytest.approx(1e3 * believed, rel=0.05)


def test_a_gyro_turns_links_by_time_and_not_by_way() -> None:
    """Five seconds of driving at 10 deg/h."""
    rate = math.radians(10) / 3600
    gyro = GyroNoise(yaw_rad_per_sqrt_s=1e-6, yaw_rad_per_s=rate, since=0)
    noise = replace(NOISE, gyro=gyro)
    assert noise.learns_gyro
    graph = PoseGraph()
    n = np.array([0, 5 * GRID_HZ])
    ahead = keyframes(n, np.array([[0.0, 0.0, 0.0], [2.5, 0.0, 0.0]]))
    graph.insert(ONE, GraphEntry(0, model_of(noise), ahead))
    constant = WholeGraph.of(graph, group_of(graph)).errors.constant
    assert constant[0, 1, 2] == pytest.approx(5 * rate, rel=1e-6)


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
