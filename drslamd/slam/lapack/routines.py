"""Routines of LAPACK, called through ctypes.

scipy's own wrappers hold the interpreter: in a team of fifty one of their calls takes a tenth of a
second, in which no sensor would be read. A call through ctypes lets other threads run meanwhile,
but where matrices are small (`small_*`): to let the interpreter go and get it back takes longer
than they do. The numbers are those of scipy to the last bit.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.lapack.loading import address, cython_lapack
from drslamd.slam.se2 import Array


def cholesky_banded(lower: Array) -> Array:
    """L of a symmetric or Hermitian matrix, both (w, n) in lower banded form (pbtrf).

    Raises:
        numpy.linalg.LinAlgError: it is not positive definite.
    """
    dtype, pbtrf = (complex, _zpbtrf) if np.iscomplexobj(lower) else (float, _dpbtrf)
    factor = np.array(lower, dtype=dtype, order="F")
    width, n = factor.shape
    info = ctypes.c_int(0)
    pbtrf(b"L", _int(n), _int(width - 1), _data(factor), _int(width), ctypes.byref(info))
    if info.value > 0:
        raise np.linalg.LinAlgError(f"leading minor {info.value} is not positive definite")
    _check("pbtrf", info)
    return factor


def cholesky_banded_solved(lower: Array, columns: Array) -> Array:
    """(L L')^-1 times columns (n,) or (n, c), of L (w, n) in lower banded form (pbtrs)."""
    is_complex = np.iscomplexobj(lower) or np.iscomplexobj(columns)
    dtype, pbtrs = (complex, _zpbtrs) if is_complex else (float, _dpbtrs)
    solved = np.array(columns, dtype=dtype, order="F")
    if not solved.size:  # of which LAPACK would write beyond its memory
        return solved
    factor = np.asfortranarray(lower, dtype=dtype)
    (width, n), count = factor.shape, solved.size // len(solved)
    info = ctypes.c_int(0)
    of_l = (_int(width - 1), _int(count), _data(factor), _int(width))
    pbtrs(b"L", _int(n), *of_l, _data(solved), _int(n), ctypes.byref(info))
    _check("pbtrs", info)
    return solved


def triangular_banded(lower: Array, columns: Array, transposed: bool = False) -> Array:
    """L^-1, or L'^-1, times columns (n, c), of L (w, n) in lower banded form (dtbtrs)."""
    solved = np.array(columns, dtype=np.float64, order="F")
    n, count = solved.shape
    if not solved.size:
        return solved
    factor = np.asfortranarray(lower, dtype=np.float64)
    width, info = len(factor), ctypes.c_int(0)
    of_l = (_int(width - 1), _int(count), _data(factor), _int(width))
    of_x = (_data(solved), _int(n), ctypes.byref(info))
    _dtbtrs(b"L", b"T" if transposed else b"N", b"N", _int(n), *of_l, *of_x)
    _check("dtbtrs", info)
    return solved


def inverse_triangular(lower: Array) -> Array:
    """(n, n) L^-1 of a lower triangular L (dtrtri); what stands above its diagonal is not read."""
    inverse = np.tril(lower)
    if not inverse.size:
        return inverse
    n, info = len(inverse), ctypes.c_int(0)
    # rows of numpy are columns of LAPACK, so that it sees L', an upper triangle
    _dtrtri(b"U", b"N", _int(n), _data(inverse), _int(n), ctypes.byref(info))
    _check("dtrtri", info)
    return inverse


def cholesky_solved(lower: Array, columns: Array) -> Array:
    """(L L')^-1 times columns (n, c), of a lower triangular L (n, n) (dpotrs)."""
    solved = np.array(columns, dtype=np.float64, order="F")
    n, count = solved.shape
    if not solved.size:
        return solved
    factor = np.ascontiguousarray(lower, dtype=np.float64)
    info = ctypes.c_int(0)
    of_x = (_data(solved), _int(n), ctypes.byref(info))
    _dpotrs(b"U", _int(n), _int(count), _data(factor), _int(n), *of_x)
    _check("dpotrs", info)
    return solved


def small_cholesky(matrices: Array) -> tuple[Array, NDArray[np.bool_]]:
    """L of symmetric matrices (k, n, n), and which of them have one (dpotrf).

    What is above diagonals is neither read nor written.
    """
    factors = np.array(matrices, dtype=np.float64, order="C")
    k, n, _ = factors.shape
    first, bytes_each = factors.ctypes.data, n * n * factors.itemsize
    size, info, infos = _int(n), ctypes.c_int(0), np.zeros(k, dtype=int)
    for at in range(k):
        _small_dpotrf(b"U", size, first + at * bytes_each, size, ctypes.byref(info))
        infos[at] = info.value
    return factors, infos == 0


def small_cholesky_solved(factors: Sequence[Array], columns: Array) -> Array:
    """(k, n, c) (L L')^-1 times columns, of k lower triangular L (n, n) row by row (dpotrs).

    Args:
        columns: (k, c, n).
    """
    solved = np.array(columns, dtype=np.float64, order="C")
    _, count, n = solved.shape
    first, bytes_each = solved.ctypes.data, count * n * solved.itemsize
    size, counted, info = _int(n), _int(count), _int(0)
    for at, factor in enumerate(factors):
        at_x = first + at * bytes_each
        _small_dpotrs(b"U", size, counted, factor.ctypes.data, size, at_x, size, info)
    return np.ascontiguousarray(solved.transpose(0, 2, 1))


def _int(value: int) -> object:
    return ctypes.byref(ctypes.c_int(value))


def _data(array: Array) -> object:
    return ctypes.c_void_p(array.ctypes.data)


def _check(name: str, info: ctypes.c_int) -> None:
    if info.value:
        raise AssertionError(f"{name}: info {info.value}")


def _routine(name: str, arguments: int, is_small: bool = False) -> Callable[..., None]:
    """All of its arguments are pointers."""
    prototype = ctypes.PYFUNCTYPE if is_small else ctypes.CFUNCTYPE
    return prototype(None, *[ctypes.c_void_p] * arguments)(address(_LAPACK, name))


_LAPACK = cython_lapack()
_dpbtrf, _zpbtrf = _routine("dpbtrf", 6), _routine("zpbtrf", 6)
_dpbtrs, _zpbtrs = _routine("dpbtrs", 9), _routine("zpbtrs", 9)
_dtbtrs = _routine("dtbtrs", 11)
_dtrtri = _routine("dtrtri", 6)
_dpotrs = _routine("dpotrs", 8)
_small_dpotrf = _routine("dpotrf", 5, is_small=True)
_small_dpotrs = _routine("dpotrs", 8, is_small=True)
