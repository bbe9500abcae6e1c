"""Loops of two closures and two odometries, many at a time: their twists, noise and lengths.

A covariance of x, y, theta is six rows here, in the order xx xy xt yy yt tt of `se2.packed`, each
with one column per loop: a few dozen operations on long rows instead of many small matrices.
"""

from __future__ import annotations

from typing import Union

import numpy as np

from drslamd.slam.se2 import Array

Places = Union[int, slice, Array]
"""One column, or several."""


def columns(table: Array, at: Places) -> Array:
    """(d, m) columns of (d, n); one is broadcast over all others."""
    return table[:, at, None] if isinstance(at, int) else table[:, at]


def twists(later: Array, earlier: Array) -> tuple[Array, Array, Array]:
    """The twist of ``later earlier^-1`` for poses (3, m)."""
    turn = later[2] - earlier[2]
    turn = turn - 2 * np.pi * np.rint(turn / (2 * np.pi))
    half = turn / 2
    # never zero, which would leave half / tan(half) undefined; this near to it, it is 1
    half = np.where(np.abs(half) < 1e-9, 1e-9, half)
    s, c = np.sin(half), np.cos(half)
    cos, sin = 1 - 2 * s * s, 2 * s * c
    x = later[0] - cos * earlier[0] + sin * earlier[1]
    y = later[1] - sin * earlier[0] - cos * earlier[1]
    a = half * c / s
    return a * x + half * y, a * y - half * x, turn


def carried_covariance(pose: Array, covariance: Array) -> Array:
    """(6, m) covariances of twists, carried by the adjoint of poses (3, m) or (3, 1)."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    wx, wy = pose[1], -pose[0]
    xx, xy, xt, yy, yt, tt = covariance
    # rotated ...
    rx, ry = cos * xt - sin * yt, sin * xt + cos * yt
    cc, cs, ss = cos * cos, cos * sin, sin * sin
    cross = 2 * cs * xy
    # ... and moved by the lever (wx, wy) of the angle
    hx, hy = tt * wx, tt * wy
    out = np.empty(covariance.shape)
    out[0] = cc * xx - cross + ss * yy + (2 * rx + hx) * wx
    out[1] = cs * (xx - yy) + (cc - ss) * xy + rx * wy + ry * wx + hx * wy
    out[2] = rx + hx
    out[3] = ss * xx + cross + cc * yy + (2 * ry + hy) * wy
    out[4] = ry + hy
    out[5] = tt
    return out


def squared_length(twist: tuple[Array, Array, Array], covariance: Array) -> Array:
    """(m,) twist' covariance^-1 twist, by elimination.

    Infinite where the covariance is none, as sums over an absurd trajectory may make it.
    """
    xx, xy, xt, yy, yt, tt = covariance
    e0, e1, e2 = twist
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        l10, l20 = xy / xx, xt / xx
        d1 = yy - l10 * xy
        c21 = yt - l20 * xy
        l21 = c21 / d1
        d2 = tt - l20 * xt - l21 * c21
        y1 = e1 - l10 * e0
        y2 = e2 - l20 * e0 - l21 * y1
        length = e0 * e0 / xx + y1 * y1 / d1 + y2 * y2 / d2
    return np.where((xx > 0) & (d1 > 0) & (d2 > 0), length, np.inf)
