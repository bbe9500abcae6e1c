"""Routines of LAPACK, against scipy's own wrappers: the same bits."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from scipy.linalg.lapack import dpotrf, dpotrs, dtbtrs

from drslamd.slam.lapack.routines import (
    cholesky_banded,
    cholesky_banded_solved,
    small_cholesky,
    small_cholesky_solved,
    triangular_banded,
)

RNG = np.random.default_rng(1)


def band(n: int, width: int) -> np.ndarray:
    out = RNG.normal(size=(width, n))
    out[0] = 2 * width + np.abs(out[0])
    return out


@pytest.mark.parametrize(("n", "width"), [(1, 1), (5, 3), (40, 7)])
def test_the_factor_is_that_of_scipy(n: int, width: int) -> None:
    a = band(n, width)
    before = a.copy()
    expected = scipy.linalg.cholesky_banded(a, lower=True, check_finite=False)
    assert np.array_equal(cholesky_banded(a), expected)
    assert np.array_equal(a, before)


def test_what_is_not_positive_definite_is_said() -> None:
    a = band(6, 2)
    a[0, 3] = -1.0
    with pytest.raises(np.linalg.LinAlgError):
        cholesky_banded(a)


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("order", ["C", "F"])
def test_solutions_are_those_of_scipy(transposed: bool, order: str) -> None:
    lower = cholesky_banded(band(30, 4))
    columns = np.array(RNG.normal(size=(30, 5)), order=order)  # type: ignore[call-overload]
    expected, _ = dtbtrs(lower, columns, uplo="L", trans="T" if transposed else "N")
    assert np.array_equal(triangular_banded(lower, columns, transposed), expected)


@pytest.mark.parametrize("shape", [(30, 0), (0, 3)])
def test_nothing_is_solved_of_nothing(shape: tuple[int, int]) -> None:
    lower = band(shape[0], 1)
    assert triangular_banded(lower, np.zeros(shape)).shape == shape


@pytest.mark.parametrize("dtype", [float, complex])
@pytest.mark.parametrize("shape", [(40,), (40, 3)])
def test_a_band_is_solved_as_by_scipy(dtype: type, shape: tuple[int, ...]) -> None:
    a: np.ndarray = band(40, 4).astype(dtype)
    columns = RNG.normal(size=shape)
    if dtype is complex:
        a[1:] += 1j * RNG.normal(size=a[1:].shape)
        columns = columns + 1j * RNG.normal(size=shape)
    expected = scipy.linalg.cholesky_banded(a, lower=True)
    assert np.array_equal(cholesky_banded(a), expected)
    solved = scipy.linalg.cho_solve_banded((expected, True), columns)
    assert np.array_equal(cholesky_banded_solved(expected, columns), solved)


def test_small_matrices_are_factorised_and_solved_as_by_scipy() -> None:
    roots = RNG.normal(size=(3, 20, 20))
    matrices = roots @ roots.transpose(0, 2, 1)
    matrices[1, 4, 4] = -1.0
    before, columns = matrices.copy(), RNG.normal(size=(3, 5, 20))
    factors, sound = small_cholesky(matrices)
    assert sound.tolist() == [True, False, True]
    assert np.array_equal(matrices, before)
    for at in (0, 2):
        expected, _ = dpotrf(matrices[at].T)
        assert np.array_equal(np.tril(factors[at]), expected.T)
    solved = small_cholesky_solved(list(factors[[0, 2]]), columns[[0, 2]])
    for at, one in zip((0, 2), solved, strict=True):
        expected, _ = dpotrs(factors[at].T, columns[at].T)
        assert np.array_equal(one, expected)
        assert np.allclose(matrices[at] @ one, columns[at].T, rtol=0, atol=1e-8)
