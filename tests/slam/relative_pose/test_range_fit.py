"""Poses about centroids: there and back, how they step, and what a step does to the ranges."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigvalsh
from slam_scenes import Array, curved_window, matrix, same_pose
from window_scenes import fit_between, fit_of, of_one

from drslamd.slam.relative_pose import range_fit
from drslamd.slam.relative_pose.range_fit import Minima, RangeFit, stepped


def scene(seed: int, apart: float = 6.0) -> tuple[RangeFit, Array, Array, Array]:
    """A window's fit, its points a, b, and its true pose."""
    rng = np.random.default_rng(seed)
    window, true = curved_window(rng, apart, 50, 0.2)
    a, b = window.a_points, window.b_points
    return fit_of(window), a, b, true


def some_poses(true: Array) -> Array:
    return np.array([true, true + [1.0, -2.0, 0.5], true * [-1.0, 1.0, -1.0]])


def test_a_centred_pose_has_the_centroid_of_b_in_the_frame_of_a() -> None:
    fit, a, b, true = scene(0)
    for pose, (place, heading) in zip(some_poses(true), fit.centred(some_poses(true)), strict=True):
        expected = (matrix(pose) @ [*b.mean(axis=0), 1.0])[:2] - a.mean(axis=0)
        assert [place.real, place.imag] == pytest.approx(expected)
        assert heading == pytest.approx(np.exp(1j * pose[2]))


def test_what_was_centred_comes_back() -> None:
    fit, _, _, true = scene(1)
    for pose, back in zip(some_poses(true), fit.poses(fit.centred(some_poses(true))), strict=True):
        assert same_pose(pose, back, 1e-12)


@pytest.mark.parametrize("distance", [0.0, 0.5, 0.99, 1.01, 7.0])
def test_a_step_goes_away_and_around_and_turns(distance: float) -> None:
    at, little = distance * np.exp(0.6j), 1e-6
    centred = np.array([[at, np.exp(0.2j)]])
    moves = [stepped(centred, row[None] * little)[0] for row in np.eye(3)]
    away = np.exp(0.6j) if distance else 1.0
    assert (moves[0][0] - at) / little == pytest.approx(away, abs=1e-4)
    assert (moves[1][0] - at) / little == pytest.approx(1j * away, abs=1e-4)
    assert moves[2][0] == pytest.approx(at, abs=1e-12)
    assert np.angle(moves[2][1]) == pytest.approx(0.2 + little)


def test_a_long_step_around_keeps_the_distance_beyond_a_metre() -> None:
    around = np.array([[0.0, 1.5, 0.0]])
    for distance, kept in ((range_fit.AROUND_M * 1.01, True), (range_fit.AROUND_M * 0.99, False)):
        moved = stepped(np.array([[distance + 0j, 1.0 + 0j]]), around)[0, 0]
        assert bool(abs(moved) == pytest.approx(distance)) is kept


@pytest.mark.parametrize("apart", [0.0, 6.0])
def test_the_derivatives_are_those_of_finite_differences(apart: float) -> None:
    fit, a, b, true = scene(2, apart)
    centred, h = fit.centred(some_poses(true)), 1e-6
    u, rows = fit.linear(centred)
    by_step = fit.by_step(centred)
    for k, pose in enumerate(some_poses(true)):
        sight = np.array([(matrix(pose) @ [*q, 1.0])[:2] for q in b]) - a
        assert np.allclose(u[k], sight @ [1, 1j] / np.hypot(*sight.T))
    for part in range(3):
        step = np.tile(np.eye(3)[part] * h, (3, 1))
        ahead, behind = stepped(centred, step), stepped(centred, -step)
        change = (fit.linear(ahead)[1][:, 4] - fit.linear(behind)[1][:, 4]) / (2 * h)
        assert np.allclose(rows[:, part], change, atol=1e-7)
        moved = (fit.poses(ahead) - fit.poses(behind)) / (2 * h)
        assert np.allclose(by_step[..., part], moved, atol=1e-7)
    assert np.all(rows[:, 3] == 1.0)
    assert np.allclose(rows[0, 4], 0.0)


@pytest.mark.parametrize(
    ("apart", "sigmas", "shared"),
    [
        (6.0, (0.05, 0.8, 0.15), 0.06),
        (6.0, (0.02, 0.8, 0.02), 0.0),
        (1.1, (0.5, 0.25, 0.02), 0.0),
        (0.5, (0.02, 0.4, 0.02), 0.0),
        (0.5, (0.05, 0.05, 0.12), 0.0),
    ],
)
def test_a_long_valley_is_as_wide_as_its_arc_is_deep(
    apart: float, sigmas: tuple[float, ...], shared: float
) -> None:
    """Poses drawn about the centroids, and their spread about the pose in x, y and heading."""
    fit, centred = scene(5)[0], np.array([[apart * np.exp(0.6j), np.exp(0.2j)]])
    covariance = np.diag(sigmas) ** 2
    covariance[1, 2] = covariance[2, 1] = shared
    steps = np.random.default_rng(6).multivariate_normal(np.zeros(3), covariance, 400_000)
    off = fit.poses(stepped(np.repeat(centred, len(steps), axis=0), steps)) - fit.poses(centred)
    off[:, 2] = np.angle(np.exp(1j * off[:, 2]))
    seen = off.T @ off / len(off)
    m = fit.by_step(centred)[0]
    straight = m @ covariance @ m.T
    claimed = fit.covariances(Minima(centred, covariance[None], np.zeros(1)))[0]
    assert eigvalsh(claimed, seen) == pytest.approx(np.ones(3), abs=0.1)
    assert np.array_equal(claimed[2], straight[2])


@pytest.mark.parametrize("part", [0, 1, 2])
@pytest.mark.parametrize(
    ("times", "chi2", "vague"),
    [
        (0.99, 0.0, False),
        (1.01, 0.0, True),
        (1.01, 0.99, True),
        (1.01, 1.01, False),
    ],
)
def test_a_window_is_vague_as_soon_as_one_minimum_that_counts_is(
    part: int, times: float, chi2: float, vague: bool
) -> None:
    """Seen from the centroids, which lie at the antennas of two robots that did not move."""
    still = np.zeros((6, 2))
    fit = fit_between(still, still, np.full(6, 4.0))
    limit = [range_fit.MAX_SIGMA_M, range_fit.MAX_SIGMA_M, range_fit.MAX_SIGMA_RAD][part]
    covariance = np.tile(1e-4 * np.eye(3), (2, 1, 1))
    covariance[1, part, part] = (times * range_fit.VAGUE * limit) ** 2
    centred = fit.centred(np.array([[4.0, 0.0, 1.0], [4.0, 0.0, -1.0]]))
    worse = 7.0 + np.array([0.0, chi2 * range_fit.SURELY_CHI2])
    assert fit.is_vague(Minima(centred, covariance, worse), of_one(2)).tolist() == [vague] * 2


@pytest.mark.parametrize(("share", "vague"), [(0.999, True), (1.001, False)])
def test_a_window_that_fits_nothing_is_not_called_vague(share: float, vague: bool) -> None:
    """Sensors that contradict each other are another verdict than too little motion."""
    still = np.zeros((9, 2))
    fit = fit_between(still, still, np.full(9, 4.0))
    covariance = np.tile(100.0 * np.eye(3), (1, 1, 1))
    chi2 = np.array([share * range_fit.POOR_FIT * (9 - 3)])
    minima = Minima(fit.centred(np.array([[4.0, 0.0, 1.0]])), covariance, chi2)
    assert fit.is_vague(minima, of_one(1)).tolist() == [vague]


def test_the_other_side_is_as_far_away_where_both_were_nearest() -> None:
    rng = np.random.default_rng(11)
    window, true = curved_window(rng, 1.0, 50, 0.2)
    fit = fit_of(window)
    other = fit.poses(fit.other_side(fit.centred(true[None])))[0]
    n = int(np.argmin(window.ranges))
    before, after = (
        pose[:2] + matrix(pose)[:2, :2] @ window.b_points[n] - window.a_points[n]
        for pose in (true, other)
    )
    assert np.allclose(after, -before)
    assert other[2] == pytest.approx(true[2])
