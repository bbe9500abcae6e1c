"""Planar motions against 3 x 3 matrices and against the matrix exponential."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from slam_scenes import matrix, pose_of

from drslamd.slam import se2

lengths = st.floats(-1e3, 1e3)
angles = st.floats(-20.0, 20.0)
poses = st.tuples(lengths, lengths, angles).map(np.array)


def close(a: se2.Array, b: se2.Array, tolerance: float = 1e-9) -> bool:
    return bool(np.allclose(matrix(a), matrix(b), atol=tolerance * (1 + np.abs(b[:2]).max())))


def hat(twist: se2.Array) -> se2.Array:
    x, y, theta = twist
    return np.array([[0, -theta, x], [theta, 0, y], [0, 0, 0]])


@given(poses, poses)
def test_compose_is_the_product_of_matrices(a: se2.Array, b: se2.Array) -> None:
    assert close(se2.compose(a, b), pose_of(matrix(a) @ matrix(b)))


@given(poses)
def test_inverse_is_the_inverse_matrix(a: se2.Array) -> None:
    assert close(se2.inverse(a), pose_of(np.linalg.inv(matrix(a))), 1e-8)


@given(poses, poses)
def test_between_leads_from_the_first_to_the_second(a: se2.Array, b: se2.Array) -> None:
    assert close(se2.compose(a, se2.between(a, b)), b, 1e-8)


@given(poses, poses, poses)
def test_it_does_not_matter_which_product_is_taken_first(
    a: se2.Array, b: se2.Array, c: se2.Array
) -> None:
    one = se2.compose(se2.compose(a, b), c)
    other = se2.compose(a, se2.compose(b, c))
    assert np.allclose(one, other, atol=1e-8)


def test_angles_of_products_count_on() -> None:
    half_turn = np.array([0.0, 0.0, 3.0])
    assert se2.compose(half_turn, half_turn)[2] == 6.0
    assert se2.between(np.array([0, 0, -3.0]), half_turn)[2] == 6.0


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [
        (math.pi, math.pi),
        (-math.pi, math.pi),
        (3 * math.pi, math.pi),
        (-math.pi + 1e-12, -math.pi + 1e-12),
        (math.nextafter(math.pi, 4), math.pi),
        (0.0, 0.0),
        (2 * math.pi + 0.25, 0.25),
        (-2 * math.pi - 0.25, -0.25),
    ],
)
def test_wrapped_angles_lie_above_minus_pi_and_up_to_pi(angle: float, wrapped: float) -> None:
    assert float(se2.wrap(angle)) == pytest.approx(wrapped, abs=1e-15)
    assert -math.pi < float(se2.wrap(angle)) <= math.pi


@given(st.floats(-1e6, 1e6))
def test_wrapping_keeps_the_direction(angle: float) -> None:
    wrapped = float(se2.wrap(angle))
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@given(st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.14, 3.14)).map(np.array))
def test_log_is_the_inverse_of_the_matrix_exponential(twist: se2.Array) -> None:
    assert np.allclose(se2.log(pose_of(expm(hat(twist)))), twist, atol=1e-7)


@pytest.mark.parametrize("theta", [0.0, 1e-9, 1.9e-4, 2.1e-4, -2.1e-4, math.pi, 3.5])
def test_log_is_right_beside_its_series_and_where_it_wraps(theta: float) -> None:
    pose = np.array([1.5, -0.5, theta])
    assert np.allclose(expm(hat(se2.log(pose))), matrix(pose), atol=1e-12)


@given(
    st.tuples(st.floats(-20, 20), st.floats(-20, 20), angles).map(np.array),
    st.tuples(*[st.floats(-1, 1)] * 3).map(np.array),
)
@settings(max_examples=50)
def test_adjoint_moves_a_twist_across_a_pose(pose: se2.Array, twist: se2.Array) -> None:
    """T exp(xi) = exp(Ad_T xi) T."""
    one = matrix(pose) @ expm(hat(twist))
    other = expm(hat(se2.adjoint(pose) @ twist)) @ matrix(pose)
    assert np.allclose(one, other, atol=1e-9)


@given(poses, st.tuples(lengths, lengths).map(np.array))
def test_transform_is_the_matrix_times_the_point(pose: se2.Array, point: se2.Array) -> None:
    assert np.allclose(se2.transform(pose, point), (matrix(pose) @ [*point, 1.0])[:2], atol=1e-8)


def test_everything_works_on_stacks_as_on_single_poses() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 4, 5, 3))
    for f in (se2.compose, se2.between):
        assert np.array_equal(f(a, b)[2, 3], f(a[2, 3], b[2, 3]))
    for g in (se2.inverse, se2.log, se2.adjoint):
        assert np.allclose(g(a)[2, 3], g(a[2, 3]), atol=1e-15)
    assert np.allclose(se2.compose(a[0, 0], b)[1, 2], se2.compose(a[0, 0], b[1, 2]), atol=1e-15)


def test_a_turned_covariance_is_that_of_turned_samples() -> None:
    rng = np.random.default_rng(2)
    root = rng.normal(size=(3, 3))
    covariance = root @ root.T
    for theta in (0.3, -2.0, math.pi / 2):
        turn = matrix((0, 0, theta))
        assert np.allclose(se2.turned(covariance, theta), turn @ covariance @ turn.T)
    quarter = se2.turned(np.diag([1.0, 4.0, 9.0]), math.pi / 2)
    assert np.allclose(quarter, np.diag([4.0, 1.0, 9.0]))


def test_packed_covariances_come_back() -> None:
    full = np.array([[1.0, 2, 3], [2, 4, 5], [3, 5, 6]])
    assert se2.packed(full) == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert np.array_equal(se2.unpacked(se2.packed(full)), full)
