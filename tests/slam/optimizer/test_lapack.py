"""Two routines of LAPACK, against scipy's own wrappers: the same bits."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from scipy.linalg.lapack import dtbtrs

from drslamd.slam.optimizer.lapack import cholesky_banded, triangular_banded

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
