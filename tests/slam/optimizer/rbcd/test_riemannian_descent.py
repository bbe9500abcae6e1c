"""The relaxation of one block: its cost, its steps, and how certain a pose is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import least_squares
from slam_problems import pose_edges
from slam_scenes import Array, inverted, product, same_pose, wander

from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.optimizer.rbcd.riemannian_descent import (
    ENOUGH,
    block,
    descend,
    leaned,
    lift,
    moved,
    retract,
    rounded,
    rows,
    stacked,
    tangent,
)

OURS, THEIRS = 6, 3
SIGMA = (0.05, 0.05, 0.03)


class Scene:
    """Six poses of ours in a chain; two closures lead to poses of others, one comes from one."""

    def __init__(self, seed: int = 0, rank: int = 3, error: float = 1.0) -> None:
        rng = np.random.default_rng(seed)
        self.truth = wander(rng, OURS, 0.4)
        self.others = wander(rng, THEIRS, 0.4) + [2.0, 1.0, 0.5]
        both = np.concatenate([self.truth, self.others])
        own = [(k, k + 1) for k in range(OURS - 1)] + [(0, 3)]
        self.edges = [
            shifted(pose_edges(rng, both, pairs, SIGMA, error), i, j)
            for pairs, i, j in (
                (own, 0, 0),
                ([(1, OURS), (4, OURS + 1)], 0, OURS),
                ([(OURS + 2, 5)], OURS, 0),
            )
        ]
        self.neighbours = lift(self.others, rank)
        self.rank = rank
        own_factors, out, back = (ComplexFactors.of(edges) for edges in self.edges)
        self.problem = block(own_factors, out, back, self.neighbours, OURS)

    def somewhere(self, seed: int = 1) -> Array:
        """A point on the spheres in which nothing is zero."""
        rng = np.random.default_rng(seed)
        shape = (2 * OURS, self.rank)
        return retract(rng.normal(size=shape) + 1j * rng.normal(size=shape))

    def plain_cost(self, x: Array) -> float:
        """Of rotations z and places p, relative pose by relative pose."""
        ours = [(x[2 * k], x[2 * k + 1]) for k in range(OURS)]
        theirs = [(row[: self.rank], row[self.rank :]) for row in self.neighbours]
        cost = 0.0
        ends = ((ours, ours), (ours, theirs), (theirs, ours))
        for edges, (first, second) in zip(self.edges, ends, strict=True):
            for i, j, (mx, my, turn), v in zip(
                edges.i, edges.j, edges.measured, edges.covariance, strict=True
            ):
                (z_i, p_i), (z_j, p_j) = first[i], second[j]
                kappa, tau = 2 / v[2, 2], 2 / (v[0, 0] + v[1, 1])
                cost += kappa * np.sum(np.abs(z_j - z_i * np.exp(1j * turn)) ** 2)
                cost += tau * np.sum(np.abs(p_j - p_i - z_i * (mx + 1j * my)) ** 2)
        return float(cost)


def shifted(edges: BetweenFactors, i: int, j: int) -> BetweenFactors:
    """The same edges, their ends counted from there on."""
    return BetweenFactors(edges.i - i, edges.j - j, edges.measured, edges.covariance)


# the cost and its derivatives


@pytest.mark.parametrize("rank", [1, 3])
def test_the_cost_is_that_of_the_relative_poses_one_by_one(rank: int) -> None:
    scene = Scene(rank=rank)
    for seed in range(3):
        x = scene.somewhere(seed)
        assert scene.problem.cost(x) == pytest.approx(scene.plain_cost(x))


def test_without_noise_the_truth_costs_nothing() -> None:
    scene = Scene(error=0.0)
    assert scene.problem.cost(stacked(lift(scene.truth, 3))) == pytest.approx(0.0, abs=1e-7)


def test_the_gradient_is_half_of_what_finite_differences_say() -> None:
    scene = Scene()
    x, h = scene.somewhere(), 1e-6
    gradient = scene.problem.gradient(x)
    for place in np.ndindex(x.shape):
        for unit in (1.0, 1j):
            step = np.zeros_like(x)
            step[place] = h * unit
            slope = (scene.plain_cost(x + step) - scene.plain_cost(x - step)) / (2 * h)
            expected = 2 * (gradient[place] * np.conj(unit)).real
            assert slope == pytest.approx(expected, rel=1e-5, abs=1e-2)


def test_a_tangent_vector_leaves_the_lengths_of_rotations_as_they_are() -> None:
    scene = Scene()
    x, v = scene.somewhere(1), scene.somewhere(2)
    flat, h = tangent(x, v), 1e-6
    length = np.linalg.norm((x + h * flat)[0::2], axis=1)
    assert np.allclose(length, 1.0, atol=1e-11)
    assert np.array_equal(flat[1::2], v[1::2])
    assert np.allclose(tangent(x, flat), flat)
    # what was taken off points along the rotation
    off = (v - flat)[0::2]
    assert np.allclose(off, np.sum(x[0::2].conj() * off, axis=1).real[:, None] * x[0::2])


def test_a_retraction_goes_where_the_tangent_vector_points() -> None:
    scene = Scene()
    x, h = scene.somewhere(1), 1e-6
    flat = tangent(x, scene.somewhere(2))
    ahead, behind = retract(x + h * flat), retract(x - h * flat)
    assert np.allclose((ahead - behind) / (2 * h), flat, atol=1e-6)
    far = retract(x + 5 * flat)
    assert np.allclose(np.linalg.norm(far[0::2], axis=1), 1.0)
    assert np.array_equal(far[1::2], (x + 5 * flat)[1::2])


# the descent


@pytest.mark.parametrize("seed", range(4))
def test_a_round_lowers_the_cost_of_the_block_and_stays_on_the_spheres(seed: int) -> None:
    scene = Scene(seed)
    x = scene.somewhere(seed)
    after, _ = descend(scene.problem, x)
    assert scene.plain_cost(after) < 0.9 * scene.plain_cost(x)
    assert np.allclose(np.linalg.norm(after[0::2], axis=1), 1.0)


def test_more_steps_never_cost_more() -> None:
    scene, costs = Scene(), []
    for steps in range(8):
        costs.append(scene.plain_cost(descend(scene.problem, scene.somewhere(), steps)[0]))
    assert (np.diff(costs) <= 0).all()
    assert costs[0] == scene.plain_cost(scene.somewhere())


@pytest.mark.parametrize("seed", [0, 1, pytest.param(2, marks=pytest.mark.slow)])
def test_many_steps_end_where_least_squares_over_planar_poses_end(seed: int) -> None:
    """From anywhere: with three directions to turn in there are no other minima."""
    scene = Scene(seed)

    def residuals(x: Array) -> Array:
        poses = x.reshape(-1, 3)
        out: list[complex] = []
        ends = ((poses, poses), (poses, scene.others), (scene.others, poses))
        for edges, (first, second) in zip(scene.edges, ends, strict=True):
            for i, j, (mx, my, turn), v in zip(
                edges.i, edges.j, edges.measured, edges.covariance, strict=True
            ):
                a, b = first[i], second[j]
                z = np.exp(1j * a[2])
                place = complex(*b[:2]) - complex(*a[:2]) - z * (mx + 1j * my)
                out.append(math.sqrt(2 / v[2, 2]) * (np.exp(1j * b[2]) - z * np.exp(1j * turn)))
                out.append(math.sqrt(2 / (v[0, 0] + v[1, 1])) * place)
        return np.array([[value.real, value.imag] for value in out]).ravel()

    best = least_squares(residuals, scene.truth.ravel(), method="lm")
    found, steps = scene.somewhere(seed), 1
    while steps:
        found, steps = descend(scene.problem, found, 400)
    assert scene.plain_cost(found) == pytest.approx(2 * best.cost, rel=1e-4)
    poses = rounded(rows(found), lift(np.zeros((1, 3)), 3)[0])
    for ours, theirs in zip(poses, best.x.reshape(-1, 3), strict=True):
        assert same_pose(ours, theirs, 2e-3)


def test_where_nothing_can_be_gained_nothing_moves() -> None:
    scene = Scene(error=0.0)
    x = stacked(lift(scene.truth, 3))
    assert np.allclose(descend(scene.problem, x)[0], x, atol=1e-6)


def test_it_ends_when_a_step_gains_hardly_anything_or_after_so_many() -> None:
    scene = Scene()
    x = scene.somewhere()
    nearly, steps = descend(scene.problem, x, 400)
    assert 1 < steps < 400
    assert descend(scene.problem, x, 2)[1] == 2
    before, _ = descend(scene.problem, x, steps - 1)
    gain = scene.plain_cost(before) - scene.plain_cost(nearly)
    assert gain <= ENOUGH * (scene.plain_cost(x) - scene.plain_cost(before)) * 1.01


def test_the_change_of_the_cost_is_the_difference_of_two() -> None:
    scene = Scene()
    x, y = scene.somewhere(1), scene.somewhere(2)
    found = scene.problem.change(scene.problem.gradient(x), y - x)
    assert found == pytest.approx(scene.plain_cost(y) - scene.plain_cost(x), rel=1e-9)


# beyond the minimum


def test_past_the_minimum_the_cost_is_still_below_that_of_the_start() -> None:
    """Where it is quadratic, all the way to twice as far; there it is the same again."""
    scene = Scene()
    x = stacked(lift(scene.truth + [0.01, -0.02, 0.0], 3))
    y, steps = x, 1
    while steps:
        y, steps = descend(scene.problem, y, 400)
    costs = [scene.plain_cost(leaned(scene.problem, x, y, lean)) for lean in (0.0, 0.5, 0.9)]
    assert costs == sorted(costs)
    assert costs[-1] < scene.plain_cost(x)
    quadratic = costs[0] + 0.9**2 * (scene.plain_cost(x) - costs[0])
    assert costs[-1] == pytest.approx(quadratic, rel=0.1)


def test_as_far_past_the_minimum_as_is_asked_for() -> None:
    scene = Scene()
    x = stacked(lift(scene.truth + [0.01, 0.0, 0.0], 3))
    y, _ = descend(scene.problem, x)
    beyond = leaned(scene.problem, x, y, 0.6)
    assert np.allclose((beyond - y)[1::2], 0.6 * (y - x)[1::2])


def test_where_it_would_cost_more_than_at_the_start_it_goes_less_far() -> None:
    scene = Scene()
    x, y = scene.somewhere(1), stacked(lift(scene.truth, 3))
    # beyond four times the way to the minimum even a quadratic cost is above that of the start
    beyond = leaned(scene.problem, x, y, 4.0)
    assert scene.plain_cost(beyond) <= scene.plain_cost(x)
    assert np.linalg.norm((beyond - y)[1::2]) < 3.9 * np.linalg.norm((y - x)[1::2])


# poses in the plane and lifted ones


def test_lifted_poses_move_as_planar_ones_do() -> None:
    poses = wander(np.random.default_rng(3), 4, 1.0)
    steps = wander(np.random.default_rng(4), 4, 1.0)
    expected = [product(pose, step) for pose, step in zip(poses, steps, strict=True)]
    found = rounded(moved(lift(poses, 3), steps), lift(np.zeros((1, 3)), 3)[0])
    for one, other in zip(found, expected, strict=True):
        assert same_pose(one, other)


def test_lifted_poses_are_seen_from_an_anchor_however_all_of_them_are_turned() -> None:
    poses = wander(np.random.default_rng(5), 4, 1.0)
    rng = np.random.default_rng(6)
    turn = np.linalg.qr(rng.normal(size=(3, 3)) + 1j * rng.normal(size=(3, 3)))[0]
    shift = rng.normal(size=3) + 1j * rng.normal(size=3)
    x = stacked(lift(poses, 3)) @ turn
    x[1::2] += shift
    found = rounded(rows(x), rows(x)[0])
    for one, pose in zip(found, poses, strict=True):
        assert same_pose(one, product(inverted(poses[0]), pose))


def test_rows_and_stacks_hold_the_same() -> None:
    lifted = lift(wander(np.random.default_rng(7), 4), 3)
    assert stacked(lifted).shape == (8, 3)
    assert np.array_equal(rows(stacked(lifted)), lifted)
    assert np.array_equal(stacked(lifted)[3], lifted[1, 3:])
