"""Symmetric systems: band and sparse give what a dense solver gives."""

import numpy as np
import pytest

from drslamd.slam.optimizer.closures.symmetric import NARROW, Symmetric, elimination_order

Parts = tuple[Symmetric, np.ndarray, np.ndarray]


def system(size: int, reach: int, complex_values: bool, seed: int = 0) -> Parts:
    """A positive definite matrix with entries up to `reach` off its diagonal, some given twice."""
    rng = np.random.default_rng(seed)
    i = rng.integers(0, size - reach, 3 * size)
    j = i + rng.integers(1, reach + 1, 3 * size)
    i, j = np.append(i, 0), np.append(j, reach)
    low_first = rng.random(len(i)) < 0.5
    row, column = np.where(low_first, i, j), np.where(low_first, j, i)
    off = rng.normal(size=len(i)) + 1j * rng.normal(size=len(i)) * complex_values
    weight = np.abs(off)
    diagonal = np.arange(size)
    rows = np.concatenate([row, row, column, diagonal])
    columns = np.concatenate([column, row, column, diagonal])
    values = np.concatenate([off, weight, weight, np.ones(size)])
    values = values if complex_values else values.real
    dense = np.zeros((size, size), dtype=values.dtype)
    np.add.at(dense, (row, column), values[: len(row)])
    np.add.at(dense, (column, row), values[: len(row)].conj())
    np.add.at(dense, (rows[len(row) :], rows[len(row) :]), values[len(row) :])
    return Symmetric(size, rows, columns), values, dense


@pytest.mark.parametrize("complex_values", [False, True])
@pytest.mark.parametrize("reach", [NARROW - 1, NARROW])
def test_band_and_sparse_solve_as_a_dense_solver_does(reach: int, complex_values: bool) -> None:
    matrix, values, dense = system(300, reach, complex_values)
    factor = matrix.factor(values)
    assert factor is not None
    right = np.random.default_rng(1).normal(size=300).astype(values.dtype)
    np.testing.assert_allclose(factor.solve(right), np.linalg.solve(dense, right), atol=1e-10)


@pytest.mark.parametrize("reach", [3, 150])
def test_damping_adds_to_the_diagonal_only(reach: int) -> None:
    matrix, values, dense = system(200, reach, False)
    factor = matrix.factor(values, damping=0.5)
    assert factor is not None
    damped = dense + 0.5 * np.diag(np.diag(dense))
    right = np.arange(200.0)
    np.testing.assert_allclose(factor.solve(right), np.linalg.solve(damped, right), atol=1e-10)


def test_an_indefinite_band_is_none() -> None:
    matrix, values, _ = system(50, 3, False)
    values[-50] = -1e3
    assert matrix.factor(values) is None


def test_a_singular_sparse_matrix_is_none() -> None:
    matrix, values, _ = system(200, 150, False)
    assert matrix.factor(np.zeros_like(values)) is None


def test_an_order_of_elimination_is_kept_where_it_is_a_band() -> None:
    i = np.arange(100)
    assert elimination_order(i, i + 1, 101).tolist() == list(range(101))
    # up to 31 poses apart three unknowns of each still fit the band
    reach = np.array([NARROW // 3 - 1])
    assert elimination_order(np.zeros(1, dtype=np.int64), reach, 101).tolist() == list(range(101))


def test_an_order_of_elimination_keeps_factors_sparse() -> None:
    """A star: its middle first would join all the others, its middle last joins nobody."""
    count = 200
    i, j = np.zeros(count - 1, dtype=np.int64), np.arange(1, count)
    order = elimination_order(i, j, count)
    assert sorted(order.tolist()) == list(range(count))
    assert 0 in order[-2:]
