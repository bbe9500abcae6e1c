"""The window as a semidefinite program, which the paper names as future work, beside module 1.

With u = R' t and q = |t|^2 the squared-range error is linear in y = [1, c, s, t, u, q]:

    |t + R p_b - p_a|^2 - r^2  =  h . y,

so the sum of its squares is y' Q y, and what ties y together is quadratic. Shor's relaxation puts a
positive semidefinite Y in the place of y y'. Where Y has rank one it is the certified global
minimum.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import cycle

import numpy as np
from scipy import sparse

from drslamd.slam.relative_pose import solver
from drslamd.slam.relative_pose.window import Window
from lab.benchmark import module1, timing, windows
from lab.benchmark.rows import Peer, Row
from lab.recordings.recording import Array

ONE, C, S, TX, TY, UX, UY, Q = range(8)
SIZE = 8
TAU, POOL = 100, 20
TIGHT = 1e-4
"""Second eigenvalue of Y over the first, below which Y has rank one."""
SAME_COST = 1.01
TIES: tuple[tuple[tuple[int, int, float], ...], ...] = (
    ((C, C, 1), (S, S, 1), (ONE, ONE, -1)),
    ((C, TX, 1), (S, TY, 1), (ONE, UX, -1)),
    ((C, TY, 1), (S, TX, -1), (ONE, UY, -1)),
    ((C, UX, 1), (S, UY, -1), (ONE, TX, -1)),
    ((S, UX, 1), (C, UY, 1), (ONE, TY, -1)),
    ((TX, TX, 1), (TY, TY, 1), (ONE, Q, -1)),
    ((UX, UX, 1), (UY, UY, 1), (ONE, Q, -1)),
    ((TX, UX, 1), (TY, UY, 1), (C, Q, -1)),
    ((TY, UX, 1), (TX, UY, -1), (S, Q, -1)),
)
"""Sums of entries of Y that are zero: R is a rotation, u = R' t, t = R u, q = |t|^2 = |u|^2, and
what follows of the products of c and s with q."""


@dataclass(frozen=True)
class Relaxed:
    """a_T_b (3,) out of the relaxation, and the ratio of Y's two largest eigenvalues."""

    a_T_b: Array
    ratio: float


def relaxed(window: Window) -> Relaxed:
    """Solve the relaxation with clarabel; lengths in units of the mean range."""
    import clarabel

    unit = float(window.ranges.mean())
    a, b, r = window.a_points / unit, window.b_points / unit, window.ranges / unit
    cross = a[:, 1] * b[:, 0] - a[:, 0] * b[:, 1]
    squares, dot = (a**2 + b**2).sum(axis=1) - r**2, (a * b).sum(axis=1)
    h = np.column_stack([squares, -2 * dot, -2 * cross, -2 * a, 2 * b, np.ones(len(r))])
    h /= (2 * r)[:, None]
    rows, columns, cone = _triangle()
    cost = (h.T @ h)[rows, columns] * np.where(rows == columns, 1.0, 2.0)
    ties, right = _ties()
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    quadratic = sparse.csc_matrix((len(cost), len(cost)))
    left, held = sparse.vstack([ties, -cone]).tocsc(), np.concatenate([right, 0 * cost])
    cones = [clarabel.ZeroConeT(len(right)), clarabel.PSDTriangleConeT(SIZE)]
    solution = clarabel.DefaultSolver(quadratic, cost, left, held, cones, settings).solve()
    full = np.zeros((SIZE, SIZE))
    full[rows, columns] = full[columns, rows] = solution.x
    values, vectors = np.linalg.eigh(full)
    y = vectors[:, -1] / vectors[ONE, -1]
    pose = np.array([unit * y[TX], unit * y[TY], np.arctan2(y[S], y[C])])
    return Relaxed(pose, float(values[-2] / values[-1]))


@cache
def _triangle() -> tuple[Array, Array, sparse.csc_matrix]:
    """Upper triangle column by column, and what makes the cone's vector of it."""
    columns, rows = np.tril_indices(SIZE)
    scale = np.where(rows == columns, 1.0, np.sqrt(2.0))
    return rows, columns, sparse.diags(scale).tocsc()


@cache
def _ties() -> tuple[sparse.csc_matrix, Array]:
    rows, columns, _ = _triangle()
    at = {(int(i), int(j)): k for k, (i, j) in enumerate(zip(rows, columns, strict=True))}
    table = np.zeros((len(TIES) + 1, len(rows)))
    for k, tie in enumerate(TIES):
        for i, j, factor in tie:
            table[k, at[min(i, j), max(i, j)]] += factor
    table[-1, at[ONE, ONE]] = 1.0
    return sparse.csc_matrix(table), np.append(np.zeros(len(TIES)), 1.0)


def rows(quick: bool) -> Iterator[Row]:
    """Time beside module 1's, and how often the relaxation is tight and finds what we find."""
    try:
        import clarabel  # noqa: F401
    except ImportError:
        return
    rng = np.random.default_rng(TAU)
    pool = [windows.window(rng, TAU)[0] for _ in range(POOL)]
    turns = cycle(pool)
    programs = {"ours": module1.over(pool, module1.full), "sdp": lambda: relaxed(next(turns))}
    times = timing.in_turns(programs, 40 if quick else 200, 4 if quick else 20)
    peer = Peer("SDP, clarabel", times["sdp"].median, True)
    work = f"full solve, tau {TAU}, beside a semidefinite program"
    yield Row(1, work, times["ours"].median, "ms", None, times["ours"].p99, (peer,))
    tight, same = _agreement(pool)
    yield Row(1, f"semidefinite program, tau {TAU}: rank one", tight, "share")
    yield Row(1, f"semidefinite program, tau {TAU}: polished, no better than ours", same, "share")


def _agreement(pool: list[Window]) -> tuple[float, float]:
    tight, same = [], []
    for window in pool:
        found = relaxed(window)
        tight.append(found.ratio < TIGHT)
        theirs = module1.polished(window, found.a_T_b)[1]
        minima = module1.refined([window], solver.SEEDS)[0]
        ours = min(module1.polished(window, pose)[1] for pose in minima)
        same.append(ours <= SAME_COST * theirs)
    return float(np.mean(tight)), float(np.mean(same))
