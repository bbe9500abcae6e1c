"""Planar rigid motions on arrays: every pose is [x, y, theta] in the last axis.

The group product is written `compose(a_T_b, b_T_c) -> a_T_c`. Small errors are twists
xi = [x, y, theta] applied on the left, ``exp(xi) * T``: then the uncertainty of a chain of motions
adds up in the frame of its origin (Barfoot, State Estimation for Robotics, 7.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
"""Of floats, unless a docstring says otherwise; docstrings also say the shapes."""

Index = NDArray[np.int64]
"""Places in other arrays."""

_PACKED_AT = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])


def wrap(angle: Array | float) -> Array:
    """Angles in radians, brought into (-pi, pi]."""
    wrapped = np.pi - np.mod(np.pi - np.asarray(angle), 2 * np.pi)
    # a hair above pi the modulus rounds up to 2 pi
    return np.where(wrapped > -np.pi, wrapped, np.pi)


def rotate(theta: Array | float, points: Array) -> Array:
    """Turn points (..., 2) by theta (...)."""
    cos, sin = np.cos(theta), np.sin(theta)
    x, y = points[..., 0], points[..., 1]
    turned_x = cos * x - sin * y
    out = np.empty((*turned_x.shape, 2))
    out[..., 0] = turned_x
    out[..., 1] = sin * x + cos * y
    return out


def transform(a_T_b: Array, b_points: Array) -> Array:
    """Points (..., 2) in b, given in a."""
    return rotate(a_T_b[..., 2], b_points) + a_T_b[..., :2]


def compose(a_T_b: Array, b_T_c: Array) -> Array:
    """a_T_c, its angle not wrapped (a track may count on)."""
    return _joined(transform(a_T_b, b_T_c[..., :2]), a_T_b[..., 2] + b_T_c[..., 2])


def inverse(a_T_b: Array) -> Array:
    """b_T_a."""
    return _joined(rotate(-a_T_b[..., 2], -a_T_b[..., :2]), -a_T_b[..., 2])


def between(w_T_a: Array, w_T_b: Array) -> Array:
    """a_T_b of two poses in one frame."""
    xy = rotate(-w_T_a[..., 2], w_T_b[..., :2] - w_T_a[..., :2])
    return _joined(xy, w_T_b[..., 2] - w_T_a[..., 2])


def _joined(xy: Array, theta: Array) -> Array:
    """Poses out of positions (..., 2) and angles (...)."""
    out = np.empty((*xy.shape[:-1], 3))
    out[..., :2] = xy
    out[..., 2] = theta
    return out


def log(pose: Array) -> Array:
    """The twist xi with exp(xi) = pose, its angle wrapped."""
    theta = wrap(pose[..., 2])
    half = theta / 2
    # half / tan(half), by its series near zero
    with np.errstate(divide="ignore", invalid="ignore"):
        a = np.where(np.abs(half) < 1e-4, 1 - half**2 / 3, half / np.tan(half))
    x, y = pose[..., 0], pose[..., 1]
    return np.stack([a * x + half * y, a * y - half * x, theta], axis=-1)


def adjoint(a_T_b: Array) -> Array:
    """(..., 3, 3): takes a twist in b to the same twist in a."""
    cos, sin = np.cos(a_T_b[..., 2]), np.sin(a_T_b[..., 2])
    x, y = a_T_b[..., 0], a_T_b[..., 1]
    zero, one = np.zeros_like(x), np.ones_like(x)
    rows = [[cos, -sin, y], [sin, cos, -x], [zero, zero, one]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def packed(covariance: Array) -> tuple[float, ...]:
    """xx xy xt yy yt tt of a (3, 3) covariance."""
    (xx, xy, xt), (_, yy, yt), (_, _, tt) = covariance.tolist()
    return xx, xy, xt, yy, yt, tt


def unpacked(upper: Sequence[float] | Array) -> Array:
    """The (..., 3, 3) covariances of `packed` (..., 6)."""
    return np.asarray(upper)[..., _PACKED_AT]


def turned(covariance: Array, theta: Array | float) -> Array:
    """Covariance (..., 3, 3) of (x, y, theta), its axes turned by theta (...)."""
    r = axes(theta)
    return np.asarray(r @ covariance @ np.swapaxes(r, -1, -2))


def axes(theta: Array | float) -> Array:
    """(..., 3, 3): turns (x, y) of (x, y, theta) by theta (...)."""
    cos, sin = np.cos(theta), np.sin(theta)
    r = np.zeros((*np.shape(theta), 3, 3))
    r[..., 0, 0] = r[..., 1, 1] = cos
    r[..., 0, 1], r[..., 1, 0], r[..., 2, 2] = -sin, sin, 1.0
    return r
