"""Closures that contradict everybody else: their weights, and what is left without them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import chi2
from slam_problems import pose_edges
from slam_scenes import Array, product, same_pose, wander

from drslamd.slam.optimizer.closures import gnc
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.problem import BetweenFactors

KEYFRAMES, ROBOTS = 30, 3
SIGMA = (0.05, 0.05, 0.02)


class Ring:
    """Three robots; the first pair and the second are right, the third one is misled."""

    def __init__(self, seed: int, false: int, shift: float = 2.0) -> None:
        rng = np.random.default_rng(seed)
        paths = [wander(rng, KEYFRAMES, 0.4) + [3.0 * r, 0, 0] for r in range(ROBOTS)]
        self.truth = np.stack(paths, axis=1).reshape(-1, 3)
        chain = [(k, k + ROBOTS) for k in range(ROBOTS * (KEYFRAMES - 1))]
        right = [
            (ROBOTS * k + a, ROBOTS * k + a + 1) for k in range(0, KEYFRAMES, 3) for a in (0, 1)
        ]
        wrong = [(ROBOTS * (k + 5), ROBOTS * (k + 5) + 2) for k in range(false)]
        parts = [
            pose_edges(rng, self.truth, chain, (0.01, 0.01, 0.005)),
            pose_edges(rng, self.truth, right, SIGMA),
            self._misled(wrong, shift),
        ]
        self.good = ComplexFactors.joined([ComplexFactors.of(p) for p in parts[:2]])
        self.edges = ComplexFactors.joined([ComplexFactors.of(p) for p in parts])
        self.doubted = np.arange(len(self.edges)) >= len(chain)
        self.wrong = np.arange(len(self.edges)) >= len(chain) + len(right)

    def _misled(self, ends: list[tuple[int, int]], shift: float) -> BetweenFactors:
        """As if robot 2 stood elsewhere all the time: they agree with its odometry."""
        origin = np.array([shift, -shift / 2, 0.3 * shift])
        moved = np.array([product(origin, pose) for pose in self.truth])
        exact = pose_edges(np.random.default_rng(0), self.truth, ends, SIGMA, 0.0)
        seen = [product(_inverse(self.truth[i]), moved[j]) for i, j in ends]
        return BetweenFactors(exact.i, exact.j, np.reshape(seen, (-1, 3)), exact.covariance)

    def off(self, poses: Array) -> float:
        """Largest distance from the truth, the first poses laid on each other, m."""
        carry = product(self.truth[0], _inverse(poses[0]))
        laid = np.array([product(carry, pose) for pose in poses])
        return float(np.hypot(*(laid - self.truth)[:, :2].T).max())


def _inverse(pose: Array) -> Array:
    x, y, theta = pose
    cos, sin = math.cos(theta), math.sin(theta)
    return np.array([-cos * x - sin * y, sin * x - cos * y, -theta])


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("false", [1, 5])
def test_what_is_left_is_the_answer_without_the_false_ones(seed: int, false: int) -> None:
    ring = Ring(seed, false)
    count = len(ring.truth)
    answer, weighed = gnc.solve(ring.edges, count, ring.doubted, None)
    assert (weighed.tau[ring.wrong] < 1e-5 * ring.edges.tau[ring.wrong]).all()
    true = ring.doubted & ~ring.wrong
    assert (weighed.tau[true] == ring.edges.tau[true]).mean() > 0.9
    plain = PoseGraphSolver(ring.edges, count).solve()
    assert ring.off(answer.poses) < 0.3
    assert false == 1 or ring.off(plain.poses) > 0.5
    assert answer.steps > plain.steps


def test_those_that_are_more_than_the_rest_of_their_loop_win() -> None:
    """What nobody could tell: fifteen against ten of each other pair."""
    ring = Ring(1, 15)
    weighed = gnc.solve(ring.edges, len(ring.truth), ring.doubted, None)[1]
    assert (weighed.tau[ring.wrong] == ring.edges.tau[ring.wrong]).all()


def test_where_all_agree_the_plain_solution_stays() -> None:
    ring = Ring(4, 0)
    kept = gnc.squared_errors(ring.good, PoseGraphSolver(ring.good, 90).solve().poses)
    good = ring.good.chosen(~ring.doubted | (kept < 0.5 * gnc.BELIEVABLE))
    answer, weighed = gnc.solve(good, 90, np.arange(len(good)) >= 87, None)
    assert weighed is good
    for ours, theirs in zip(answer.poses, PoseGraphSolver(good, 90).solve().poses, strict=True):
        assert same_pose(ours, theirs, 1e-9)


def test_odometry_is_never_doubted() -> None:
    """A false odometry edge keeps its weight; the closures pay for it."""
    ring = Ring(5, 5)
    _, weighed = gnc.solve(ring.edges, 90, ring.doubted, None)
    assert np.array_equal(weighed.tau[~ring.doubted], ring.edges.tau[~ring.doubted])


def test_the_answer_is_a_minimum_of_the_truncated_cost() -> None:
    """No small move of any pose makes sum odometry + sum min(r^2, c^2) less."""
    ring = Ring(6, 8)
    poses = gnc.solve(ring.edges, 90, ring.doubted, None)[0].poses

    def cost(x: Array) -> float:
        # 4 sin^2 of `chordal` and the square of an angle differ by less than what is looked for
        squares = gnc.squared_errors(ring.edges, x)
        capped = np.minimum(squares, gnc.BELIEVABLE)
        return float(np.where(ring.doubted, capped, squares).sum())

    best, rng = cost(poses), np.random.default_rng(7)
    for _ in range(50):
        assert cost(poses + rng.normal(0, 2e-3, poses.shape)) > best


def test_a_closure_is_believed_up_to_its_99_percent() -> None:
    assert pytest.approx(chi2.ppf(0.99, 3)) == gnc.BELIEVABLE
    c2 = gnc.BELIEVABLE
    late = gnc.weights(np.array([0.99 * c2, 1.01 * c2]), 1e6)
    assert late.tolist() == [1.0, 0.0]


@pytest.mark.parametrize("mu", [0.01, 1.0, 30.0])
def test_weights_are_those_of_the_published_cost(mu: float) -> None:
    """Equation 14 of Yang et al., case by case."""
    c2 = gnc.BELIEVABLE
    low, high = mu / (mu + 1) * c2, (mu + 1) / mu * c2
    middle = (low + high) / 2
    found = gnc.weights(np.array([0.0, 0.999 * low, middle, 1.001 * high]), mu)
    assert found[[0, 1, 3]].tolist() == [1.0, 1.0, 0.0]
    assert found[2] == pytest.approx(math.sqrt(c2 / middle * mu * (mu + 1)) - mu)
    assert 0 < found[2] < 1
