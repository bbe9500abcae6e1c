"""Covariances of x, y, theta as six numbers, xx xy xt yy yt tt: of one robot, or rows of many.

A pose is told fifty times a second, and on a few numbers Python is faster than numpy is on matrices
of three by three.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

Packed = tuple[Any, ...]
"""Six numbers, or six rows (m,)."""


def moved(packed: Iterable[Any], dx: Any, dy: Any) -> Packed:
    """S C S' with S = [1 0 -dy; 0 1 dx; 0 0 1]: of a point that is d away, and turns along."""
    xx, xy, xt, yy, yt, tt = packed
    to_x, to_y = xt - dy * tt, yt + dx * tt
    far = xx - dy * (xt + to_x), xy + dx * xt - dy * to_y
    return (*far, to_x, yy + dx * (yt + to_y), to_y, tt)


def turned(packed: Iterable[Any], cos: float, sin: float) -> Packed:
    """In axes that are turned by an angle with this cosine and sine."""
    xx, xy, xt, yy, yt, tt = packed
    twice = 2 * cos * sin * xy
    return (
        cos * cos * xx + twice + sin * sin * yy,
        cos * sin * (yy - xx) + (cos * cos - sin * sin) * xy,
        cos * xt + sin * yt,
        sin * sin * xx - twice + cos * cos * yy,
        cos * yt - sin * xt,
        tt,
    )


def added_up(a: Iterable[Any], b: Iterable[Any]) -> Packed:
    a_xx, a_xy, a_xt, a_yy, a_yt, a_tt = a
    xx, xy, xt, yy, yt, tt = b
    return a_xx + xx, a_xy + xy, a_xt + xt, a_yy + yy, a_yt + yt, a_tt + tt


def times(factor: float, packed: Iterable[Any]) -> Packed:
    xx, xy, xt, yy, yt, tt = packed
    return factor * xx, factor * xy, factor * xt, factor * yy, factor * yt, factor * tt
