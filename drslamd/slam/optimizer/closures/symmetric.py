"""Sparse symmetric positive definite systems: a band where the pattern is one, else SuperLU.

The pattern is given once, as places in the lower or upper triangle that may repeat; each
factorisation then takes the values for those places and sums them. Unknowns are eliminated in their
order, so whoever numbers them decides how fast that is (`elimination_order`).
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from drslamd.slam.lapack.routines import cholesky_banded, cholesky_banded_solved
from drslamd.slam.se2 import Array, Index

NARROW = 96
"""Diagonals up to which a band is worth it: 30 robots in the order of time."""
BLOCK = 3
"""Unknowns of a pose."""


class Factor(Protocol):
    """A factorised matrix."""

    def solve(self, right: Array) -> Array:
        """Solution for right-hand sides (n,) or (n, k)."""


class Symmetric:
    """Real symmetric or Hermitian (n, n) with known places of its entries."""

    def __init__(self, size: int, row: Index, column: Index) -> None:
        """
        Args:
            row, column: (m,) places; each stands for its mirror image too.
        """
        self._size = size
        self._upper = row < column
        low, self._off = np.minimum(row, column), np.abs(row - column)
        self._width = int(self._off.max(initial=0)) + 1
        self._pattern: _Sparse | None = None
        if self._width > NARROW:
            self._pattern = _Sparse(size, low + self._off, low)
        else:
            self._flat = low * self._width + self._off

    def factor(self, values: Array, damping: float = 0.0) -> Factor | None:
        """Factorise; None when the matrix is not positive definite (as far as that is found).

        Args:
            values: (m,) for the places, as they stand there (not in their mirror image).
            damping: relative increase of the diagonal.
        """
        if np.iscomplexobj(values):
            values = np.where(self._upper, values.conj(), values)
        if self._pattern:
            return self._pattern.factor(values, damping)
        band = _sums(self._flat, values, self._size * self._width)
        band = band.reshape(self._size, self._width)
        band[:, 0] *= 1 + damping
        return _Band.of(band)


def _sums(at: Index, values: Array, length: int) -> Array:
    if np.iscomplexobj(values):
        return _sums(at, values.real, length) + 1j * _sums(at, values.imag, length)
    return np.bincount(at, values, length)


class _Band:
    """LAPACK's banded Cholesky."""

    def __init__(self, lower: Array) -> None:
        self._lower = lower

    @staticmethod
    def of(band: Array) -> _Band | None:
        """
        Args:
            band: (n, w), row k holds column k of the lower triangle from the diagonal down.
        """
        try:
            return _Band(cholesky_banded(band.T))
        except np.linalg.LinAlgError:
            return None

    def solve(self, right: Array) -> Array:
        return cholesky_banded_solved(self._lower, right)


class _Sparse:
    """SuperLU without pivoting, unknowns eliminated in their order."""

    def __init__(self, size: int, row: Index, column: Index) -> None:
        """
        Args:
            row, column: (m,) in the lower triangle.
        """
        self._size = size
        self._off = np.flatnonzero(row != column)
        rows = np.concatenate([row, column[self._off]])
        columns = np.concatenate([column, row[self._off]])
        places, self._sum_at = np.unique(columns * size + rows, return_inverse=True)
        self._rows = (places % size).astype(np.int32)
        starts = np.searchsorted(places, np.arange(size + 1) * size)
        self._starts = starts.astype(np.int32)
        self._diagonal = np.flatnonzero(places % size == places // size)

    def factor(self, values: Array, damping: float) -> Factor | None:
        both = np.concatenate([values, values[self._off].conj()])
        data = _sums(self._sum_at, both, len(self._rows))
        data[self._diagonal] *= 1 + damping
        factor: Factor | None = _factorised(data, self._rows, self._starts, "NATURAL")
        return factor


def _factorised(data: Array, rows: Array, starts: Array, order: str) -> Any:
    """SuperLU's object for a symmetric matrix by columns, None where it is singular."""
    # only graphs with loops in space come here; the others need not load scipy.sparse
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    matrix = csc_matrix((data, rows, starts), (len(starts) - 1, len(starts) - 1))
    options = {"SymmetricMode": True}
    try:
        return splu(matrix, permc_spec=order, diag_pivot_thresh=0.0, options=options)
    except RuntimeError:
        return None


def elimination_order(i: Index, j: Index, count: int) -> Index:
    """(count,) vertices of a graph with edges (m,), in an order that leaves factors sparse.

    As they are where that is a band; otherwise by minimum degree.
    """
    if np.abs(i - j).max(initial=0) < NARROW // BLOCK:
        return np.arange(count)
    diagonal = np.arange(count)
    places = np.unique(np.concatenate([i * count + j, j * count + i, diagonal * (count + 1)]))
    rows, columns = places % count, places // count
    starts = np.searchsorted(columns, np.arange(count + 1))
    data = np.where(rows == columns, np.bincount(columns, minlength=count)[columns], -1.0)
    factor = _factorised(data, rows.astype(np.int32), starts.astype(np.int32), "MMD_AT_PLUS_A")
    return np.asarray(np.argsort(factor.perm_c))
