"""Loops as rows of numbers, against the same on small matrices."""

from __future__ import annotations

import numpy as np
import pytest
from slam_scenes import NOISE, Array, wander

from drslamd.slam import se2
from drslamd.slam.consistency.loops import (
    carried_covariance,
    columns,
    squared_length,
    twists,
)
from drslamd.slam.odometry.noise import covariance_between, growth, twist_covariance

RNG = np.random.default_rng(2)
POSES = RNG.normal(0, 2, (50, 3))
ROOTS = RNG.normal(size=(50, 3, 3))
COVARIANCES = ROOTS @ np.swapaxes(ROOTS, 1, 2) + 0.01 * np.eye(3)


def rows(covariances: Array) -> Array:
    """(6, m) of (m, 3, 3)."""
    return np.asarray(np.array([se2.packed(c) for c in covariances]).T)


def test_twists_are_logarithms() -> None:
    one, other = POSES, POSES[::-1]
    expected = se2.log(se2.compose(one, se2.inverse(other)))
    np.testing.assert_allclose(np.stack(twists(one.T, other.T), axis=1), expected, atol=1e-12)


@pytest.mark.parametrize("turn", [0.0, 1e-9, 1e-6, 1e-5])
def test_twists_of_small_turns_lose_no_digits(turn: float) -> None:
    earlier = np.array([1.0, 2.0, 0.5])
    step = np.array([0.3, -0.2, turn])
    later = se2.compose(step, earlier)
    expected = se2.log(step)
    found = np.concatenate(twists(later[:, None], earlier[:, None]))
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_covariances_are_carried_by_the_adjoint() -> None:
    adjoint = se2.adjoint(POSES)
    expected = adjoint @ COVARIANCES @ np.swapaxes(adjoint, 1, 2)
    np.testing.assert_allclose(
        carried_covariance(POSES.T, rows(COVARIANCES)), rows(expected), rtol=1e-9
    )
    one = carried_covariance(POSES[:1].T, rows(COVARIANCES))
    expected = adjoint[0] @ COVARIANCES @ adjoint[0].T
    np.testing.assert_allclose(one, rows(expected), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("k", [0, 60, 119])
def test_odometry_adds_the_same_noise_in_both_directions(k: int) -> None:
    path = wander(np.random.default_rng(k), 120, 0.2)
    sums = growth(path)
    i = np.arange(120)
    way, grown = path[k, :2] - path[:, :2], sums[k] - sums
    expected = covariance_between(NOISE, path, sums, i, k)
    np.testing.assert_allclose(
        twist_covariance(NOISE, way.T, grown.T), rows(expected), rtol=1e-9, atol=1e-15
    )


def test_one_column_stands_beside_any_number() -> None:
    table = np.arange(12.0).reshape(3, 4)
    assert columns(table, 2).tolist() == [[2.0], [6.0], [10.0]]
    assert columns(table, slice(2)).shape == columns(table, np.array([0, 3])).shape == (3, 2)


def test_squared_lengths_are_those_of_solved_systems() -> None:
    error = RNG.normal(size=(50, 3))
    expected = [e @ np.linalg.solve(c, e) for e, c in zip(error, COVARIANCES, strict=True)]
    x, y, theta = error.T
    assert np.allclose(squared_length((x, y, theta), rows(COVARIANCES)), expected)


@pytest.mark.parametrize(
    "covariance", [np.zeros((3, 3)), np.diag([1.0, -1.0, 1.0]), np.full((3, 3), np.nan)]
)
def test_a_covariance_that_is_none_agrees_with_nothing(covariance: Array) -> None:
    one = np.ones(1)
    assert squared_length((one, one, one), rows(covariance[None])).tolist() == [np.inf]
