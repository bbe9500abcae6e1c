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

from drslamd.slam.se2 import Array, Index

_NODES = np.arange(5) * (2 * math.pi / 5)


def _node_terms() -> Array:
    """v at the 25 nodes, phi along the first axis, with the factors that m has: (25, 7)."""
    phi, theta = np.repeat(_NODES, 5), np.tile(_NODES, 5)
    return np.stack(
        [
            np.ones(25),
            -2 * np.cos(phi),
            -2 * np.sin(phi),
            -2 * np.cos(theta),
            2 * np.sin(theta),
            2 * np.cos(phi - theta),
            2 * np.sin(phi - theta),
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


def _rings(a: Array, b: Array, ranges: Array, rho: Array, delta: float) -> tuple[Array, Array]:
    """Angles (m,) and costs (w, m + 2, m + 2): a map for each window, its opposite edges around it.

    Args:
        a, b: (w, n) points, x + iy; ranges: (w, n); rho: (w,).
    """
    angles, kernel = _grid(delta)
    w, n = ranges.shape
    rho = rho[:, None]
    # m by its parts: |a|^2 + |b|^2 + rho^2 - r^2, then rho a, conj(a) b and rho b
    parts = np.stack([rho * a, a.conj() * b, rho * b], axis=1)
    m = np.empty((w, 7, n))
    m[:, 1:] = parts.view(float).reshape(w, 3, n, 2).swapaxes(2, 3).reshape(w, 6, n)
    m[:, 0] = (a * a.conj() + b * b.conj()).real + rho * rho - ranges * ranges
    m *= (0.5 / np.maximum(ranges, 0.25))[:, None]
    errors = _TERMS @ m
    nodes = np.einsum("wkn,wkn->wk", errors, errors).reshape(w, 5, 5)
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
    a_points, b_points = (x[None, :, 0] + 1j * x[None, :, 1] for x in (a, b))
    angles, rings = _rings(a_points, b_points, ranges[None], np.array([rho]), delta)
    return angles, np.asarray(rings[0, 1:-1, 1:-1])


def seeds(
    a: Array, b: Array, ranges: Array, rho: Array, delta: float, most: int
) -> tuple[Array, Index]:
    """The best local minima of the map of each window.

    Args:
        a, b: (w, n) points in their frames, x + iy, m.
        ranges: (w, n) m; where a place holds no measurement the points are 0 and this is rho.
        rho: (w,) radius of the search, m.
        most: minima of one window.

    Returns:
        Poses a_T_b (k, 3), those of a window beside each other and best first, and the window (k,)
        of each.
    """
    angles, rings = _rings(a, b, ranges, rho, delta)
    m, cost = len(angles), rings[:, 1:-1, 1:-1].ravel()
    rows = np.minimum(np.minimum(rings[:, :-2], rings[:, 1:-1]), rings[:, 2:])
    lowest = np.minimum(np.minimum(rows[:, :, :-2], rows[:, :, 1:-1]), rows[:, :, 2:])
    at = (cost <= lowest.ravel()).nonzero()[0]
    of = at // (m * m)
    order = np.lexsort((cost[at], of)) if len(rho) > 1 else cost[at].argsort(kind="stable")
    best = (np.arange(len(at)) - np.searchsorted(of, of)) < most
    at, of = at[order][best], of[best]
    phi, theta, rho = angles[at // m % m], angles[at % m], rho[of]
    return np.stack([rho * np.cos(phi), rho * np.sin(phi), theta], axis=-1), of  # eq. (2)
