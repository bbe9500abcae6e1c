"""The descent on the ranges of one window, against the same cost written down plainly."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from slam_scenes import Array, curved_window, matrix, wander, window_of
from window_scenes import fit_between, fit_of

from drslamd.slam.range_model import LINKTRACK, RangeNoise
from drslamd.slam.relative_pose.descent import (
    HOPELESS,
    HOPELESS_CHI2,
    ITERATIONS,
    SETTLED_CHI2,
    Descent,
)
from drslamd.slam.relative_pose.range_fit import stepped
from drslamd.slam.relative_pose.window import Window

NOISE = RangeNoise(0.1, 0.3)


def noisy_window(seed: int, burst_m: float = 0.0) -> tuple[Window, Array]:
    """Fifty ranges with white noise, a tenth of them too long, and the true pose."""
    rng = np.random.default_rng(seed)
    window, true = curved_window(rng, 6.0, 50, 0.2, bias=0.2)
    ranges = window.ranges + rng.normal(0, NOISE.sigma, 50)
    ranges[20:25] += burst_m
    return replace(window, ranges=ranges), true


def descended(window: Window, seeds: Array) -> Descent:
    fit = fit_of(window)
    descent = Descent(fit, fit.centred(seeds), [NOISE])
    descent.run(ITERATIONS)
    return descent


def plain_cost(window: Window, unknowns: Array) -> float:
    """Huber's cost of x, y, theta and a bias, one range after the other."""
    pose, bias = matrix(unknowns[:3]), float(unknowns[3])
    cost = (bias / NOISE.bias_sigma) ** 2
    for a, b, measured in zip(window.a_points, window.b_points, window.ranges, strict=True):
        apart = (pose @ [*b, 1.0])[:2] - a
        e = abs(math.hypot(*apart) + bias - measured) / NOISE.sigma
        c = LINKTRACK.huber_sigmas
        cost += e * e if e < c else 2 * c * e - c * c
    return cost


@pytest.mark.parametrize("burst_m", [0.0, 1.0])
@pytest.mark.parametrize("seed", [0, 1])
def test_it_ends_where_a_general_minimiser_ends(seed: int, burst_m: float) -> None:
    window, true = noisy_window(seed, burst_m)
    best = minimize(lambda x: plain_cost(window, x), np.append(true, 0.2), method="BFGS")
    found = descended(window, (true + [0.5, -0.4, 0.2])[None]).minima()[0]
    assert best.fun - 1e-3 < found.chi2[0] < best.fun + SETTLED_CHI2
    pose = fit_of(window).poses(found.centred)[0]
    spread = np.sqrt(np.diag(best.hess_inv)[:3] * 2)
    assert np.abs((pose - best.x[:3]) / spread).max() < math.sqrt(SETTLED_CHI2)


def test_the_covariance_is_the_dense_inverse_with_the_bias_left_unknown() -> None:
    rng = np.random.default_rng(3)
    window, true = curved_window(rng, 6.0, 50, 0.2)
    fit, h = fit_of(window), 1e-6
    centred = fit.centred(true[None])

    def distances(step: Array) -> Array:
        pose = matrix(fit.poses(stepped(centred, step[None]))[0])
        places = np.array([(pose @ [*b, 1.0])[:2] for b in window.b_points])
        return np.asarray(np.hypot(*(places - window.a_points).T))

    columns = [(distances(s * h) - distances(-s * h)) / (2 * h) for s in np.eye(3)]
    j = np.column_stack([*columns, np.ones(50)])
    information = j.T @ j / NOISE.sigma**2 + np.diag([0, 0, 0, NOISE.bias_sigma**-2])
    found = descended(window, true[None]).minima()[0]
    assert np.allclose(found.covariance[0], np.linalg.inv(information)[:3, :3], rtol=1e-4)


def at_distances(*metres: float) -> Descent:
    """Two robots that stand four metres apart; seeds at other distances, no step taken."""
    still = np.zeros((6, 2))
    fit = fit_between(still, still, np.full(6, 4.0))
    return Descent(fit, fit.centred(np.array([[d, 0.0, 0.0] for d in metres])), [NOISE])


@pytest.mark.parametrize(
    ("best_sigmas", "sigmas", "is_left"),
    [(0.0, 3.24, True), (0.0, 3.26, False), (1.0, 4.24, True), (1.0, 4.26, False)],
)
def test_what_is_far_worse_than_the_best_is_left_out(
    best_sigmas: float, sigmas: float, is_left: bool
) -> None:
    """Six ranges k sigmas off cost 6 (5 k - 6.25) beyond Huber's 2.5; 6 at one sigma."""
    best = 6 * best_sigmas**2
    worse = 6 * (5 * sigmas - 6.25)
    assert (worse < HOPELESS * best + HOPELESS_CHI2) is is_left
    found = at_distances(4 + 0.1 * sigmas, 4 + 0.1 * best_sigmas).minima()[0]
    assert found.chi2 == pytest.approx([best, worse] if is_left else [best])


def test_minima_come_best_first() -> None:
    found = at_distances(4.3, 4.0, 3.9, 4.2).minima()[0]
    assert np.abs(found.centred[:, 0]) == pytest.approx([4.0, 3.9, 4.2, 4.3])


def test_no_step_makes_a_seed_worse() -> None:
    window, true = noisy_window(5)
    fit = fit_of(window)
    seeds = fit.centred(true + np.random.default_rng(6).normal(0, 0.7, (8, 3)))
    descent = Descent(fit, seeds, [NOISE])
    costs = [descent.minima()[0].chi2[0]]
    for _ in range(ITERATIONS):
        descent.run(1)
        costs.append(descent.minima()[0].chi2[0])
    assert (np.diff(costs) <= 0).all()


def test_a_window_that_says_nothing_leaves_finite_minima() -> None:
    """Nobody moves: direction and heading are anything."""
    descent = at_distances(4.0, 5.0)
    descent.run(ITERATIONS)
    found, _ = descent.minima()
    assert np.isfinite(found.chi2).all()
    assert np.isfinite(found.covariance).all()
    assert found.covariance[0, 2, 2] > 1e6


def test_a_valley_is_followed_around_its_arc() -> None:
    """A standing peer says nothing of its heading: any is as good, and the way there is short."""
    rng = np.random.default_rng(4)
    window, true = window_of(wander(rng, 50, 0.2), np.tile([5.0, 1.0, 0.3], (50, 1)))
    fit = fit_of(window)
    seeds = np.array([true + [0.5, -0.4, 0.0], true + [0.5, -0.4, 2.0]])
    descent = Descent(fit, fit.centred(seeds), [NOISE])
    descent.run(ITERATIONS)
    refined = fit.poses(descent.minima()[0].centred)
    assert len(refined) == 2
    assert np.hypot(*(refined[:, :2] - true[:2]).T).max() < 0.05


def test_a_descent_that_is_settled_does_nothing_more() -> None:
    rng = np.random.default_rng(6)
    window, true = curved_window(rng, 6.0, 50, 0.2)
    fit = fit_of(window)
    once, twice = (Descent(fit, fit.centred(true[None]), [NOISE]) for _ in range(2))
    once.run(ITERATIONS)
    twice.run(ITERATIONS)
    twice.run(ITERATIONS)
    assert np.array_equal(once.minima()[0].centred, twice.minima()[0].centred)


def test_ranges_that_are_known_to_scatter_less_leave_a_window_less_vague() -> None:
    rng = np.random.default_rng(6)
    window, true = curved_window(rng, 6.0, 50, 0.2)
    fit = fit_of(window)
    plain, quiet, loud = (
        Descent(fit, fit.centred(true[None]), [replace(NOISE, scatter=scatter)]).minima()[0]
        for scatter in (1.0, 0.5, 2.0)
    )
    assert np.allclose(quiet.covariance, plain.covariance / 4)
    assert np.array_equal(quiet.centred, plain.centred)
    # the look must not be gloomier than the whole truth: that is for the refine to say
    assert np.array_equal(loud.covariance, plain.covariance)
