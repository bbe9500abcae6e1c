"""The coarse search of module 1 (paper, algorithm 1), whole grid at once.

With the radius fixed to the latest range, ``t = rho [cos phi, sin phi]``, the squared-range error

    |t + R(theta) p_b - p_a|^2 - r^2  =  m . v(phi, theta)

is linear in v = [1, cos phi, sin phi, cos theta, sin theta, cos(phi - theta), sin(phi - theta)].
With rows weighted by 1 / (2 r) it equals the range error to first order, and the cost of every
grid point is v' G v with one 7 x 7 Gram matrix G = M' W M: the search costs O(tau + grid) instead
of O(tau x grid).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.se2 import Array

_UPPER = np.triu_indices(7)


@lru_cache(maxsize=8)
def _grid(delta: float) -> tuple[Array, Array]:
    """Angles of one axis (m,), and the 28 products of v at all m x m points, (m * m, 28)."""
    count = max(8, math.ceil(2 * math.pi / delta))
    angles = np.arange(count) * (2 * math.pi / count) - math.pi
    phi, theta = (x.ravel() for x in np.meshgrid(angles, angles, indexing="ij"))
    v = np.stack(
        [np.ones_like(phi), np.cos(phi), np.sin(phi), np.cos(theta), np.sin(theta),
         np.cos(phi - theta), np.sin(phi - theta)]
    )  # fmt: skip
    products = (v[_UPPER[0]] * v[_UPPER[1]]).T
    return angles, np.ascontiguousarray(products * np.where(_UPPER[0] == _UPPER[1], 1.0, 2.0))


def gram(a: Array, b: Array, ranges: Array, rho: float, weights: Array) -> Array:
    """G (7, 7) of points a, b (n, 2), ranges (n,), radius rho and weights (n,)."""
    ax, ay, bx, by = a[:, 0], a[:, 1], b[:, 0], b[:, 1]
    m = np.stack(
        [ax * ax + ay * ay + bx * bx + by * by + rho * rho - ranges * ranges,
         -2 * rho * ax, -2 * rho * ay,
         -2 * (ax * bx + ay * by), -2 * (ay * bx - ax * by),
         2 * rho * bx, 2 * rho * by]
    )  # fmt: skip
    return np.asarray((m * weights) @ m.T)


def cost_map(a: Array, b: Array, ranges: Array, rho: float, delta: float) -> tuple[Array, Array]:
    """Sum of squared errors over the grid of phi and theta.

    Returns:
        The m angles of each axis and the (m, m) cost, phi along the first axis.
    """
    weights = 0.25 / np.maximum(ranges, 0.25) ** 2
    angles, products = _grid(delta)
    cost = products @ gram(a, b, ranges, rho, weights)[_UPPER]
    return angles, cost.reshape(len(angles), len(angles))


def seeds(
    a: Array, b: Array, ranges: Array, rho: float, delta: float, most: int
) -> NDArray[np.float64]:
    """The best local minima of the map as poses a_T_b (k, 3), k <= most, best first."""
    angles, cost = cost_map(a, b, ranges, rho, delta)
    ring = np.pad(cost, 1, mode="wrap")
    m = len(angles)
    lowest = np.min([ring[i : i + m, j : j + m] for i in range(3) for j in range(3)], axis=0)
    at = np.flatnonzero((cost <= lowest).ravel())
    at = at[np.argsort(cost.ravel()[at], kind="stable")[:most]]
    phi, theta = angles[at // m], angles[at % m]
    return np.stack([rho * np.cos(phi), rho * np.sin(phi), theta], axis=-1)
