"""The last word on a pose against scipy, on the dense covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigvalsh
from scipy.optimize import least_squares
from slam_scenes import NOISE, Array, curved_window, matrix, same_pose
from window_scenes import fit_of, noise_of, of_one

from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose import gls
from drslamd.slam.relative_pose.range_fit import RangeFit
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.relative_pose.window_noise import WindowNoise
from drslamd.slam.se2 import Index

RANGES = RangeNoise(0.1, 0.3)
ONE = np.zeros(1, dtype=np.int64)


def noisy(seed: int) -> tuple[Window, Array]:
    rng = np.random.default_rng(seed)
    window, true = curved_window(rng, 8.0)
    return replace(window, ranges=window.ranges + rng.normal(0, 0.04, 60) + 0.2), true


def parts(window: Window, ranges: RangeNoise = RANGES) -> tuple[RangeFit, WindowNoise]:
    return fit_of(window), noise_of(window, ranges, NOISE, NOISE)


def refine(fit: RangeFit, noise: WindowNoise, centred: Array) -> gls.Refined | None:
    """Of the only window; None where it is vague."""
    refined = gls.refine(fit, noise, centred, of_one(len(centred)))
    return refined if len(refined.e) else None


def whitened(window: Window, noise: WindowNoise, at: Array) -> Array:
    """L with L L' the inverse of the covariance at a pose, no range thinned out."""
    e = at[:2] + window.b_points @ matrix(at)[:2, :2].T - window.a_points
    u = e @ [1, 1j] / np.hypot(*e.T)
    lower = noise.covariance(ONE, u[None], np.exp(1j * at[2:]), np.ones((1, len(u))))[0]
    return np.linalg.cholesky(np.linalg.inv(np.tril(lower) + np.tril(lower, -1).T))


@pytest.mark.parametrize("seed", range(6))
def test_the_pose_and_its_covariance_are_those_of_generalised_least_squares(seed: int) -> None:
    window, true = noisy(seed)
    fit, noise = parts(window)
    judged = refine(fit, noise, fit.centred(true[None]))
    assert judged is not None
    pose = fit.poses(judged.minima.centred)[0]
    root = whitened(window, noise, pose)

    def errors(x: Array) -> Array:
        moved = x[:2] + window.b_points @ matrix(x)[:2, :2].T
        return np.asarray(root.T @ (np.hypot(*(moved - window.a_points).T) - window.ranges))

    theirs = least_squares(errors, true, x_scale="jac", xtol=1e-12)
    covariance = np.linalg.inv(theirs.jac.T @ theirs.jac)
    off = pose - theirs.x
    assert off @ np.linalg.solve(covariance, off) < 0.1**2  # a tenth of a sigma
    assert judged.minima.chi2[0] == pytest.approx(2 * theirs.cost, rel=0.02)
    m = fit.by_step(judged.minima.centred)[0]
    ratios = eigvalsh(m @ judged.minima.covariance[0] @ m.T, covariance)
    assert np.abs(ratios - 1).max() < 0.1


@pytest.mark.parametrize("scatter", [0.5, 1.5])
def test_claims_follow_what_ranges_scatter_and_weights_do_not(scatter: float) -> None:
    """Noise drawn as it is claimed, through the weights that were kept: a sandwich."""
    window, true = noisy(7)
    fit, noise = parts(window)
    start = fit.centred(true[None])
    judged = refine(fit, noise, start)
    as_known = refine(fit, parts(window, replace(RANGES, scatter=scatter))[1], start)
    assert judged is not None
    assert as_known is not None
    plain, claimed = judged.minima, as_known.minima
    assert np.array_equal(plain.centred, claimed.centred)
    assert np.array_equal(plain.chi2, claimed.chi2)
    # the linear estimate, written out
    pose = fit.poses(plain.centred)[0]
    root = whitened(window, noise, pose)
    truly = whitened(window, parts(window, replace(RANGES, sigma=0.1 * scatter))[1], pose)
    j = fit.linear(plain.centred)[1][0, :3].T
    gain = np.linalg.pinv(root.T @ j) @ root.T
    draws = np.linalg.inv(truly.T) @ np.random.default_rng(8).normal(size=(60, 20_000))
    ratios = eigvalsh(claimed.covariance[0], np.cov(gain @ draws))
    assert np.abs(ratios - 1).max() < 0.1
    assert np.abs(eigvalsh(plain.covariance[0], np.cov(gain @ draws)) - 1).max() > 0.3


@pytest.mark.parametrize("seed", range(8))
def test_a_pose_that_was_named_stays_where_it_is_when_it_is_judged_again(seed: int) -> None:
    """Odometry that is a quarter too long: on the way the noise of the window is made anew."""
    window, true = noisy(20 + seed)
    a, b = window.a_poses * [1.25, 1.25, 1], window.b_poses * [0.8, 0.8, 1]
    wrong = replace(window, a_poses=a, b_poses=b)
    fit, noise = parts(wrong)
    once = refine(fit, noise, fit.centred((true + [1.5, -1.5, 0.3])[None]))
    assert once is not None
    again = refine(fit, noise, once.minima.centred)
    assert again is not None
    m = fit.by_step(again.minima.centred)[0]
    off = fit.poses(again.minima.centred)[0] - fit.poses(once.minima.centred)[0]
    assert off @ np.linalg.solve(m @ again.minima.covariance[0] @ m.T, off) < 1.0


def test_candidates_do_not_disturb_each_other() -> None:
    window, true = noisy(0)
    fit, noise = parts(window)
    starts = fit.centred(np.array([true, true + [0.4, 0.3, 0.1], true * [1, -1, -1]]))
    together = refine(fit, noise, starts)
    assert together is not None
    for k in range(3):
        alone = refine(fit, noise, starts[k : k + 1])
        assert alone is not None
        pose = fit.poses(alone.minima.centred)[0]
        twins = [same_pose(pose, other, 0.02) for other in fit.poses(together.minima.centred)]
        assert any(twins)
        assert alone.minima.chi2[0] == pytest.approx(
            together.minima.chi2[twins.index(True)], rel=0.02
        )


def test_minima_come_best_first_with_their_own_residuals() -> None:
    window, true = noisy(0)
    fit, noise = parts(window)
    judged = refine(fit, noise, fit.centred(np.array([true * [1, -1, -1], true])))
    assert judged is not None
    assert judged.minima.chi2[0] < judged.minima.chi2[1]
    assert same_pose(fit.poses(judged.minima.centred)[0], true, 0.5)
    assert np.ptp(judged.e[0]) < np.ptp(judged.e[1])


def test_a_window_that_stays_vague_under_its_noise_is_not_judged() -> None:
    """Odometry that may turn by anything: what the ranges say then holds for no heading."""
    window, true = noisy(0)
    fit, noise = parts(window)
    assert refine(fit, noise, fit.centred(true[None])) is not None
    lost = replace(NOISE, yaw_rad_per_sqrt_m=3.0)
    noise = noise_of(window, RANGES, lost, lost)
    assert refine(fit, noise, fit.centred(true[None])) is None


def test_a_covariance_that_is_none_leaves_an_infinite_misfit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    window, true = noisy(4)
    fit, noise = parts(window)
    plain = WindowNoise.covariance

    def spoiled(self: WindowNoise, of: Index, u: Array, heading: Array, weights: Array) -> Array:
        covariance = plain(self, of, u, heading, weights)
        covariance[0, 5, 5] = -1.0
        return covariance

    monkeypatch.setattr(WindowNoise, "covariance", spoiled)
    judged = refine(fit, noise, fit.centred(np.array([true, true])))
    assert judged is not None
    assert np.isfinite(judged.minima.chi2[0])
    assert judged.minima.chi2[1] == np.inf
