"""The coarse search of module 1 (paper, algorithm 1 over the search set of eq. (2)), all at once.

With the radius fixed to the latest range, ``t = rho [cos phi, sin phi]``, the squared-range error

    |t + R(theta) p_b - p_a|^2 - r^2  =  m . v(phi, theta)

is linear in v = [1, cos phi, sin phi, cos theta, sin theta, cos(phi - theta), sin(phi - theta)].
With rows weighted by 1 / (2 r) it equals the range error to first order. The sum of its squares is
a trigonometric polynomial of degree two in either angle, so five times five points determine it:
the search costs O(25 tau + 5 grid) instead of O(tau x grid).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.se2 import Array

_NODES = np.arange(5) * (2 * math.pi / 5)


def _node_terms() -> Array:
    """v at the 25 nodes, phi along the first axis: (25, 7)."""
    phi, theta = np.repeat(_NODES, 5), np.tile(_NODES, 5)
    return np.stack(
        [
            np.ones(25),
            np.cos(phi),
            np.sin(phi),
            np.cos(theta),
            np.sin(theta),
            np.cos(phi - theta),
            np.sin(phi - theta),
        ],
        axis=-1,
    )


_TERMS = _node_terms()


@lru_cache(maxsize=8)
def _grid(delta: float) -> tuple[Array, Array]:
    """Angles of one axis (m,), and what each node adds there and one step beyond either end:
    (m + 2, 5), Dirichlet's kernel of degree two."""
    count = max(8, math.ceil(2 * math.pi / delta))
    ring = np.arange(-1, count + 1) * (2 * math.pi / count) - math.pi
    off = ring[:, None] - _NODES
    return ring[1:-1], (1 + 2 * np.cos(off) + 2 * np.cos(2 * off)) / 5


def _ring(a: Array, b: Array, ranges: Array, rho: float, delta: float) -> tuple[Array, Array]:
    """Angles (m,) and cost (m + 2, m + 2): the map, with its opposite edges around it."""
    angles, kernel = _grid(delta)
    ax, ay, bx, by = a[:, 0], a[:, 1], b[:, 0], b[:, 1]
    m = np.empty((7, len(ranges)))
    m[0] = ax * ax + ay * ay + bx * bx + by * by + rho * rho - ranges * ranges
    m[1], m[2] = -2 * rho * ax, -2 * rho * ay
    m[3], m[4] = -2 * (ax * bx + ay * by), -2 * (ay * bx - ax * by)
    m[5], m[6] = 2 * rho * bx, 2 * rho * by
    errors = _TERMS @ (m * (0.5 / np.maximum(ranges, 0.25)))
    nodes = np.einsum("kn,kn->k", errors, errors).reshape(5, 5)
    return angles, kernel @ nodes @ kernel.T


def cost_map(a: Array, b: Array, ranges: Array, rho: float, delta: float) -> tuple[Array, Array]:
    """Sum of squared errors over the grid of phi and theta.

    Args:
        a, b: (n, 2) points in their frames, m.
        ranges: (n,) m.
        rho: radius of the search, m.
        delta: the widest step, radians.

    Returns:
        The m angles of each axis and the (m, m) cost, phi along the first axis.
    """
    angles, ring = _ring(a, b, ranges, rho, delta)
    return angles, np.asarray(ring[1:-1, 1:-1])


def seeds(
    a: Array, b: Array, ranges: Array, rho: float, delta: float, most: int
) -> NDArray[np.float64]:
    """The best local minima of the map as poses a_T_b (k, 3), k <= most, best first."""
    angles, ring = _ring(a, b, ranges, rho, delta)
    m, cost = len(angles), ring[1:-1, 1:-1].ravel()
    rows = np.minimum(np.minimum(ring[:-2], ring[1:-1]), ring[2:])
    lowest = np.minimum(np.minimum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])
    at = np.flatnonzero(cost <= lowest.ravel())
    at = at[np.argsort(cost[at], kind="stable")[:most]]
    phi, theta = angles[at // m], angles[at % m]
    return np.stack([rho * np.cos(phi), rho * np.sin(phi), theta], axis=-1)  # eq. (2)
