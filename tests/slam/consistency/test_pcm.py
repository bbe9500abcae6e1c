"""Equation 2 against direct composition of the loop, and what follows from its gate."""

from __future__ import annotations

import numpy as np
import pytest
from slam_scenes import NOISE, Array, inverted, matrix, pose_of, product, wander

from drslamd.slam import se2
from drslamd.slam.chi_squared import quantile3
from drslamd.slam.consistency import pcm
from drslamd.slam.consistency.incremental_clique import IncrementalClique
from drslamd.slam.consistency.pcm import Candidate, PairConsistency
from drslamd.slam.odometry.noise import growth

EPSILON = 0.1


class Drive:
    """Two robots on known paths; closures between their poses of the same moment."""

    def __init__(self, seed: int, count: int = 300, step_m: float = 0.1) -> None:
        rng = np.random.default_rng(seed)
        self.a, self.b = wander(rng, count, step_m), wander(rng, count, step_m)
        self.a_sums, self.b_sums = growth(self.a), growth(self.b)
        self.rng = rng

    def true(self, k: int) -> Array:
        """a_T_b when both odometry frames coincide with the world."""
        return product(inverted(self.a[k]), self.b[k])

    def candidate(
        self, closure: int, k: int, a_T_b: Array | None = None, sigma: float = 0.1
    ) -> Candidate:
        covariance = np.diag([sigma**2, (2 * sigma) ** 2, (sigma / 3) ** 2])
        covariance[0, 1] = covariance[1, 0] = sigma**2 / 2
        pose = self.true(k) if a_T_b is None else a_T_b
        return Candidate(
            closure, pose, covariance, self.a[k], self.b[k], self.a_sums[k], self.b_sums[k]
        )


def judged(*candidates: Candidate) -> PairConsistency:
    pair = PairConsistency(NOISE, NOISE, EPSILON)
    for candidate in candidates:
        pair.add(candidate)
    return pair


def test_a_loop_without_errors_has_no_length() -> None:
    drive = Drive(0)
    pair = judged(*(drive.candidate(k, 30 * k) for k in range(10)))
    assert np.abs(pair.distances(9)).max() < 1e-15
    assert pair.kept() == list(range(10))


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_distances_are_those_of_the_loop_composed_step_by_step(seed: int) -> None:
    """The loop of equation 2 on matrices; its covariance by drawing every link of it."""
    drive = Drive(seed)
    i, k = 40, 230
    rng = drive.rng
    off = rng.normal(0, [0.3, 0.3, 0.1])
    early = drive.candidate(0, i)
    late = drive.candidate(1, k, product(drive.true(k), off))

    def loop(z_i: Array, z_k: Array, a_ki: Array, b_ik: Array) -> Array:
        """x_a^{k,i} + x_ab^i + x_b^{i,k} - x_ab^k."""
        return matrix(a_ki) @ matrix(z_i) @ matrix(b_ik) @ np.linalg.inv(matrix(z_k))

    def log(m: Array) -> Array:
        return se2.log(pose_of(m))

    a_ki = product(inverted(drive.a[k]), drive.a[i])
    b_ik = product(inverted(drive.b[i]), drive.b[k])
    error = log(loop(early.a_T_b, late.a_T_b, a_ki, b_ik))
    draws = []
    for _ in range(3000):
        noisy_a, noisy_b = (drawn(rng, path, i, k) for path in (drive.a, drive.b))
        z_i = early.a_T_b + rng.multivariate_normal(np.zeros(3), early.covariance)
        z_k = late.a_T_b + rng.multivariate_normal(np.zeros(3), late.covariance)
        m = loop(z_i, z_k, inverted(noisy_a), noisy_b)
        draws.append(log(m) - error)
    covariance = np.array(draws).T @ np.array(draws) / len(draws)
    expected = float(error @ np.linalg.solve(covariance, error))
    # the draws are small, but not infinitely small, and there are 3000 of them
    assert judged(early, late).distances(1)[0] == pytest.approx(expected, rel=0.12)


def drawn(rng: np.random.Generator, path: Array, i: int, k: int) -> Array:
    """The motion from pose i to pose k as noisy odometry has it."""
    n = NOISE
    scale, bend = 1 + rng.normal(0, n.scale), rng.normal(0, n.yaw_rad_per_m)
    step = se2.between(path[i:k], path[i + 1 : k + 1])
    length = np.hypot(step[:, 0], step[:, 1])
    turn = bend * length + rng.normal(0, 1, k - i) * n.yaw_rad_per_sqrt_m * np.sqrt(length)
    shift = rng.normal(0, 1, (k - i, 2)) * n.translation_per_sqrt_m * np.sqrt(length)[:, None]
    heading = np.concatenate([[0], np.cumsum(step[:, 2] + turn)])
    way = (scale * step[:, :2] + shift) @ [1, 1j]
    place = np.sum(np.exp(1j * (heading[:-1] + turn / 2)) * way)
    return np.array([place.real, place.imag, heading[-1]])


def test_closures_far_apart_in_time_may_differ_by_what_odometry_lost_between() -> None:
    drive = Drive(4)
    off = np.array([0.8, 0.0, 0.0])
    lengths = []
    for k in (21, 270):
        late = drive.candidate(1, k, product(drive.true(k), off))
        lengths.append(float(judged(drive.candidate(0, 20), late).distances(1)[0]))
    assert lengths[1] < quantile3(1 - EPSILON) < lengths[0]


@pytest.mark.row("M10")
@pytest.mark.parametrize(("factor", "agree"), [(0.99, True), (1.01, False)])
@pytest.mark.parametrize("epsilon", [0.1, 0.01])
def test_a_closure_agrees_just_inside_the_gate(factor: float, agree: bool, epsilon: float) -> None:
    drive = Drive(5)
    direction = np.array([0.5, -0.3, 0.1])

    def length(size: float) -> float:
        late = drive.candidate(1, 200, product(drive.true(200), size * direction))
        return float(judged(drive.candidate(0, 50), late).distances(1)[0])

    gate = quantile3(1 - epsilon)
    low, high = 0.0, 20.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if length(middle) < factor * gate else (low, middle)
    assert length(low) == pytest.approx(factor * gate, rel=1e-6)
    pair = PairConsistency(NOISE, NOISE, epsilon)
    pair.add(drive.candidate(0, 50))
    pair.add(drive.candidate(1, 200, product(drive.true(200), low * direction)))
    assert (pair.kept() == [0, 1]) is agree


def test_hypotheses_of_one_window_exclude_each_other() -> None:
    drive = Drive(6)
    twins = [drive.candidate(7, 100), drive.candidate(7, 100)]
    pair = judged(*twins)
    assert pair.distances(1)[0] < 1e-15
    assert pair.kept() == [7]
    pair.add(drive.candidate(8, 130))
    assert pair.kept() == [7, 8]
    assert len(pair.kept_vertices()) == 2


def test_the_true_ones_of_ambiguous_windows_are_kept() -> None:
    """Each window names the truth and a mirror image; only the truth agrees with itself."""
    drive = Drive(7)
    pair = judged()
    for number, k in enumerate(range(10, 290, 20)):
        mirror = drive.true(k) * [1, -1, -1]
        for pose in (mirror, drive.true(k)):
            pair.add(drive.candidate(number, k, pose))
    assert pair.kept_vertices() == list(range(1, 28, 2))
    assert pair.rivals() < 7


def test_rivals_are_the_largest_set_among_the_others() -> None:
    drive = Drive(8)
    wrong = np.array([3.0, 0, 0])
    pair = judged(*(drive.candidate(k, 20 * k + 5) for k in range(6)))
    for k in range(6, 10):
        # shifted in the common frame, so that they agree with each other
        b = product(wrong, drive.b[20 * k])
        pair.add(drive.candidate(k, 20 * k, product(inverted(drive.a[20 * k]), b)))
    assert pair.kept() == list(range(6))
    assert pair.rivals() == 4


def test_forgetting_keeps_what_is_known_of_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pcm, "MAX_VERTICES", 20)
    monkeypatch.setattr(pcm, "FORGET", 5)
    drive = Drive(9)
    candidates = [drive.candidate(k, 10 * k) for k in range(23)]
    candidates[3] = drive.candidate(3, 30, product(drive.true(30), [9.0, 0, 0]))
    candidates[12] = drive.candidate(12, 120, product(drive.true(120), [9.0, 0, 0]))
    pair = judged(*candidates)
    assert (len(pair), pair.forgotten) == (18, 5)
    assert pair.kept() == [k for k in range(5, 23) if k != 12]
    fresh = judged(*candidates[5:])
    assert np.allclose(pair.distances(17), fresh.distances(17))
    assert pair.graph.adjacency == fresh.graph.adjacency


def test_renewed_sums_make_the_way_between_longer() -> None:
    """Keyframes between two candidates came late, so more may have been lost on the way."""
    drive = Drive(12)
    late = drive.candidate(1, 200, product(drive.true(200), [0.5, 0, 0]))
    pair = judged(drive.candidate(0, 50), late)
    before = float(pair.distances(1)[0])
    longer = drive.a_sums[[200]] + 3 * (drive.a_sums[200] - drive.a_sums[50])
    pair.renew_sums(np.array([1]), longer, drive.b_sums[[200]])
    assert pair.distances(1)[0] < 0.7 * before


def test_a_set_that_is_no_clique_is_never_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    drive = Drive(14)
    pair = judged(drive.candidate(0, 10))

    def wrong(graph: IncrementalClique, neighbours: int) -> None:
        add(graph, neighbours)
        graph.clique = 0b11

    add = IncrementalClique.add
    monkeypatch.setattr(IncrementalClique, "add", wrong)
    with pytest.raises(AssertionError, match="not a clique"):
        pair.add(drive.candidate(1, 100, product(drive.true(100), [9.0, 0, 0])))
