"""Routines of LAPACK that let other threads run meanwhile.

scipy's own wrappers hold the interpreter: in a team of fifty one of their calls takes a tenth of a
second, in which no sensor would be read. What they call is offered to Cython as well
(scipy.linalg.cython_lapack), and a call through ctypes lets the interpreter go. The numbers are the
same to the last bit.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np
from scipy.linalg import cython_lapack

from drslamd.slam.se2 import Array


def cholesky_banded(lower: Array) -> Array:
    """L of a symmetric matrix, both (w, n) in lower banded form (dpbtrf).

    Raises:
        numpy.linalg.LinAlgError: it is not positive definite.
    """
    factor = np.array(lower, dtype=np.float64, order="F")
    width, n = factor.shape
    info = ctypes.c_int(0)
    _dpbtrf(b"L", _int(n), _int(width - 1), _data(factor), _int(width), ctypes.byref(info))
    if info.value > 0:
        raise np.linalg.LinAlgError(f"leading minor {info.value} is not positive definite")
    _check("dpbtrf", info)
    return factor


def triangular_banded(lower: Array, columns: Array, transposed: bool = False) -> Array:
    """L^-1, or L'^-1, times columns (n, c), of L (w, n) in lower banded form (dtbtrs)."""
    solved = np.array(columns, dtype=np.float64, order="F")
    n, count = solved.shape
    if not solved.size:  # of which LAPACK would write beyond its memory
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


def _int(value: int) -> object:
    return ctypes.byref(ctypes.c_int(value))


def _data(array: Array) -> object:
    return ctypes.c_void_p(array.ctypes.data)


def _check(name: str, info: ctypes.c_int) -> None:
    if info.value:
        raise AssertionError(f"{name}: info {info.value}")


def _routine(name: str, arguments: int) -> Callable[..., None]:
    """A routine of `cython_lapack`, all of whose arguments are pointers."""
    capsule = cython_lapack.__pyx_capi__[name]
    name_of = ctypes.pythonapi.PyCapsule_GetName
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    pointer_of = ctypes.pythonapi.PyCapsule_GetPointer
    pointer_of.restype = ctypes.c_void_p
    pointer_of.argtypes = [ctypes.py_object, ctypes.c_char_p]
    pointer = pointer_of(capsule, name_of(capsule))
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * arguments)(pointer)


_dpbtrf = _routine("dpbtrf", 6)
_dtbtrs = _routine("dtbtrs", 11)
_dtrtri = _routine("dtrtri", 6)
_dpotrs = _routine("dpotrs", 8)
