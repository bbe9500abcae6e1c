"""Algorithm 1 of the paper against its literal text, and its refinement against MINPACK."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import least_squares
from slam_scenes import Array, curved_window, matrix, same_pose, wander, window_of

from drslamd.slam.relative_pose.algorithm_1 import coarse_search, solve
from drslamd.slam.relative_pose.estimate import Verdict
from drslamd.slam.relative_pose.window import Window


def noisy_window(seed: int, tau: int, sigma: float = 0.1) -> Window:
    rng = np.random.default_rng(seed)
    window, _ = curved_window(rng, 4.0, tau, 0.05, step_s=0.1)
    ranges = window.ranges + rng.normal(0, sigma, tau)
    return Window(
        window.t, ranges, window.a_poses, window.b_poses, window.a_antenna, window.b_antenna
    )


def algorithm_1(window: Window, delta: float) -> tuple[Array, float]:
    """Lines 1 to 19 as printed."""
    minimum, best = math.inf, np.zeros(3)
    w = math.ceil(math.pi / delta)
    r_t = float(window.ranges[-1])
    a, b = window.a_points.tolist(), window.b_points.tolist()
    ranges = window.ranges.tolist()
    for i_phi in range(-w, w + 1):
        for i_theta in range(-w, w + 1):
            x, y = r_t * math.cos(delta * i_phi), r_t * math.sin(delta * i_phi)
            cos, sin = math.cos(delta * i_theta), math.sin(delta * i_theta)
            r = 0.0
            for (ax, ay), (bx, by), measured in zip(a, b, ranges, strict=True):
                dx, dy = x + cos * bx - sin * by - ax, y + sin * bx + cos * by - ay
                r += (math.hypot(dx, dy) - measured) ** 2
                if r >= minimum:
                    break
            if r < minimum:
                minimum = r
                best = np.array([x, y, delta * i_theta])
    return best, minimum


@pytest.mark.parametrize("tau", [10, 25, 50, 100])
@pytest.mark.parametrize("delta", [0.1, 0.4])
def test_the_coarse_search_finds_the_point_that_the_loops_find(tau: int, delta: float) -> None:
    for seed in range(2):
        window = noisy_window(seed, tau)
        best, _ = algorithm_1(window, delta)
        ours = coarse_search(window.a_points, window.b_points, window.ranges, delta)
        assert np.allclose(ours, best, atol=1e-12)


def test_of_points_that_cost_the_same_the_first_one_counts() -> None:
    """A standing peer: its angle does not matter, and the loops keep their first, -w."""
    rng = np.random.default_rng(3)
    a = wander(rng, 40, 0.05)
    window, _ = window_of(a, np.tile([3.0, 1.0, 0.0], (40, 1)))
    best, _ = algorithm_1(window, 0.3)
    ours = coarse_search(window.a_points, window.b_points, window.ranges, 0.3)
    assert best[2] == pytest.approx(-11 * 0.3)
    assert np.allclose(ours, best, atol=1e-12)


def test_the_grid_is_inclusive_on_both_sides() -> None:
    """-w .. w with w = ceil(pi / delta): at 0.8 from -3.2 to 3.2, both found when best."""
    rng = np.random.default_rng(4)
    for theta in (-3.2, 3.2):
        a, b = wander(rng, 60, 0.2), wander(rng, 60, 0.2)
        window, _ = window_of(a, b)
        phi = 0.8
        pose = np.array([5 * math.cos(phi), 5 * math.sin(phi), theta])
        seen = np.array([(matrix(pose) @ [*q, 1.0])[:2] for q in window.b_points])
        ranges = np.hypot(*(seen - window.a_points).T)
        assert ranges[-1] == pytest.approx(5)
        found = coarse_search(window.a_points, window.b_points, ranges, 0.8)
        assert np.allclose(found[:2], pose[:2])
        assert found[2] == pytest.approx(theta)


@pytest.mark.parametrize("seed", range(8))
def test_the_refinement_is_levenberg_and_marquardt_on_equation_1(seed: int) -> None:
    window = noisy_window(seed, 100)
    start, _ = algorithm_1(window, 0.2)

    def error(x: Array) -> Array:
        moved = np.array([(matrix(x) @ [*q, 1.0])[:2] for q in window.b_points])
        return np.asarray(np.hypot(*(moved - window.a_points).T) - window.ranges)

    theirs = least_squares(error, start, method="lm", xtol=1e-12, ftol=1e-12)
    estimate = solve(window, 0.1, 0.2)
    ours = estimate.hypotheses[0]
    assert estimate.verdict is Verdict.UNIQUE
    assert same_pose(ours.a_T_b, theirs.x, 1e-4)
    assert ours.chi2 == pytest.approx(2 * theirs.cost / 0.1**2, rel=1e-6)
    covariance = 0.1**2 * np.linalg.inv(theirs.jac.T @ theirs.jac)
    assert np.allclose(ours.covariance, covariance, rtol=2e-3, atol=1e-8)


@pytest.mark.parametrize(("count", "verdict"), [(3, Verdict.TOO_FEW), (4, Verdict.UNIQUE)])
def test_four_measurements_are_the_fewest(count: int, verdict: Verdict) -> None:
    assert solve(noisy_window(0, count), 0.1, 0.3).verdict is verdict


def test_a_window_that_says_nothing_has_a_covariance_that_can_be_sent() -> None:
    nothing = np.zeros((10, 3))
    window = Window(
        np.arange(-9.0, 1.0), np.full(10, 3.0), nothing, nothing, np.zeros(2), np.zeros(2)
    )
    (hypothesis,) = solve(window, 0.1, 0.3).hypotheses
    assert np.isfinite(hypothesis.a_T_b).all()
    assert np.linalg.eigvalsh(hypothesis.covariance)[-1] <= 100.0**2 * 1.0001
