"""A system of band and border, factorised: solutions and covariances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drslamd.slam import headway
from drslamd.slam.lapack.routines import cholesky_banded, inverse_triangular, triangular_banded
from drslamd.slam.optimizer.banded.assembly import System
from drslamd.slam.optimizer.banded.layout import NOWHERE
from drslamd.slam.se2 import Array, Index

ROOM = 64
"""Poses that `selected_inverse` does before it moves its window: moving costs as much as some."""
AT_ONCE, ROWS_AT_ONCE = 128, 4096
"""Columns and rows between two signs of headway: a second, with a hundred robots."""
FACTORS_AT_ONCE = 512
"""Of a large team, whose rows of the border are 70 MB."""
MANY = 512
"""Columns, as of thirty robots that have met, that are worth dense blocks ..."""
ROWS = 256
"""... of that height."""


class Solver(Protocol):
    """What solves a system of band and border, or one near it."""

    def solved(self, right: Array) -> Array | None:
        """For right-hand sides (n + b,) or (n + b, c); None where there is no solution."""

    def squared(self, right: Array) -> Array | None:
        """(c, c) B' H^-1 B of columns B (n + b, c) and the system H; None likewise."""


@dataclass(frozen=True)
class BandFactor:
    """A system [A B; B' C] taken apart: A = L L', and what is left for the border.

    Attributes:
        lower: L in lower banded form.
        halfway: (n, b) L^-1 B: half of the way is enough, since B' A^-1 B = (L^-1 B)' (L^-1 B).
        schur: (b, b) C - B' A^-1 B, whose inverse is the covariance of the border.
    """

    lower: Array
    halfway: Array
    schur: Array

    @staticmethod
    def of(system: System, damping: float = 0.0) -> BandFactor | None:
        """None where the system is not positive definite, as far as that shows.

        Args:
            damping: what is added to the diagonal, relative to it.
        """
        band, corner = system.band.copy(order="F"), system.corner.copy()
        band[0] *= 1 + damping
        corner[np.diag_indices(len(corner))] *= 1 + damping
        try:
            lower = cholesky_banded(band)
        except np.linalg.LinAlgError:
            return None
        halfway = _through(lower, system.border)
        schur = corner - _squared(halfway)
        # a tiny pivot of A can leave nothing of the border but rounding
        definite = np.isfinite(schur).all() and bool((np.diag(schur) > 0).all())
        return BandFactor(lower, halfway, schur) if definite else None

    def solved(self, right: Array) -> Array | None:
        """The solution for a right-hand side (n + b,), or for c of them (n + b, c)."""
        n = len(self.halfway)
        columns = right.reshape(len(right), -1)
        middle = _through(self.lower, columns[:n])
        try:
            outer = np.linalg.solve(self.schur, columns[n:] - self.halfway.T @ middle)
        except np.linalg.LinAlgError:
            return None
        inner = _through(self.lower, middle - self.halfway @ outer, transposed=True)
        return np.concatenate([inner, outer]).reshape(right.shape)

    def squared(self, right: Array) -> Array | None:
        """See `Solver.squared`: half of the way to the solution is enough."""
        n = len(self.halfway)
        own = _through(self.lower, right[:n])
        bound = right[n:] - self.halfway.T @ own
        try:
            return np.asarray(own.T @ own + bound.T @ np.linalg.solve(self.schur, bound))
        except np.linalg.LinAlgError:
            return None

    def joint_covariance(self, unknowns: Index) -> Array | None:
        """(k, k) block of the inverse for some unknowns (k,); None where there is none."""
        unit = np.zeros((len(self.halfway) + len(self.schur), len(unknowns)), order="F")
        unit[unknowns, np.arange(len(unknowns))] = 1
        joint = self.squared(unit)
        return joint if joint is not None and np.isfinite(joint).all() else None

    def covariance_blocks(self, unknowns: Index) -> Array | None:
        """(m, c, c) blocks of the inverse, for m factors that depend on unknowns (m, c) each.

        Those that are in the band are no farther apart than its width; `NOWHERE` is known. None
        where there is no inverse.
        """
        n = len(self.halfway)
        across = _through(self.lower, self.halfway, transposed=True)
        try:
            outer = np.linalg.inv(self.schur)
        except np.linalg.LinAlgError:
            return None
        blocks = np.empty((*unknowns.shape, unknowns.shape[1]))
        for first in range(0, len(unknowns), FACTORS_AT_ONCE):
            some = slice(first, first + FACTORS_AT_ONCE)
            rows = _of_border(unknowns[some], across)
            blocks[some] = rows @ outer @ np.swapaxes(rows, 1, 2)
        row = np.maximum(unknowns[:, :, None], unknowns[:, None, :])
        column = np.minimum(unknowns[:, :, None], unknowns[:, None, :])
        both = (row < n) & (column != NOWHERE)
        blocks[both] += selected_inverse(self.lower)[(row - column)[both], column[both]]
        return np.asarray(blocks)


def _of_border(unknowns: Index, across: Array) -> Array:
    """(m, c, b) how unknowns (m, c) follow those of the border.

    Args:
        across: (n, b) minus that, of the band.
    """
    n, border = across.shape
    rows = np.zeros((*unknowns.shape, border))
    inside, outside = (unknowns < n) & (unknowns != NOWHERE), unknowns >= n
    rows[inside] = -across[unknowns[inside]]
    rows[outside] = np.eye(border)[unknowns[outside] - n]
    return rows


def _through(lower: Array, columns: Array, transposed: bool = False) -> Array:
    """`triangular_banded`, some columns at a time: all of a large team take many seconds, in which
    nobody could tell a long computation from one that is stuck."""
    if columns.shape[1] >= MANY:
        return _through_blocks(lower, columns, transposed)
    done = []
    for first in range(0, max(columns.shape[1], 1), AT_ONCE):
        headway.mark()
        done.append(triangular_banded(lower, columns[:, first : first + AT_ONCE], transposed))
    return done[0] if len(done) == 1 else np.concatenate(done, axis=1)


def _through_blocks(lower: Array, columns: Array, transposed: bool) -> Array:
    """The same some rows at a time, each as far as they reach: dense blocks go through the
    processor several times faster than column by column."""
    solved: Array = columns.copy(order="C")
    firsts = range(0, len(solved), ROWS)
    for first in reversed(firsts) if transposed else firsts:
        headway.mark()
        own = slice(first, min(first + ROWS, len(solved)))
        before, aside, corner = _rows(lower, own)
        inverse = inverse_triangular(corner)
        if transposed:
            solved[own] = inverse.T @ solved[own]
            solved[before] -= aside.T @ solved[own]
        else:
            solved[own] = inverse @ (solved[own] - aside @ solved[before])
    return solved


def _rows(lower: Array, own: slice) -> tuple[slice, Array, Array]:
    """Rows of L, (w, n) in lower banded form: before themselves they reach these columns, with
    that; and what they have in their own ones."""
    width = len(lower)
    start, height = max(own.start - width + 1, 0), own.stop - own.start
    dense = np.zeros((height, own.stop - start))
    for below in range(min(width, own.stop)):
        # a diagonal: row i stands in column i - below
        rows = np.arange(max(own.start, below), own.stop)
        dense[rows - own.start, rows - below - start] = lower[below, rows - below]
    apart = own.start - start
    unused = int(np.argmax(np.append(dense[:, :apart].any(axis=0), True)))
    return slice(start + unused, own.start), dense[:, unused:apart], dense[:, apart:]


def _squared(columns: Array) -> Array:
    """(b, b) X' X of columns (n, b), likewise."""
    out = np.zeros((columns.shape[1], columns.shape[1]))
    for first in range(0, len(columns), ROWS_AT_ONCE):
        headway.mark()
        part = columns[first : first + ROWS_AT_ONCE]
        out += part.T @ part
    return out


def selected_inverse(lower: Array) -> Array:
    """(w, n) lower band of (L L')^-1, of L in lower banded form, poses (three columns) at a time.

    With K the columns of one pose and R the rows below them, Z = (L L')^-1 follows from the end
    (Takahashi's equations):

        Z_RK = -Z_RR G     Z_KK = L_KK^-T L_KK^-1 + G' Z_RR G     G = L_RK L_KK^-1
    """
    width, n = lower.shape
    reach = width - 1
    dense = np.zeros((n, reach + 3, 3))
    for c in range(3):
        dense[:, c : c + width, c] = lower.T
    blocks = np.stack([dense[c::3, :, c] for c in range(3)], axis=-1)
    own = np.linalg.inv(blocks[:, :3])
    gain = blocks[:, 3:] @ own
    pivot = np.swapaxes(own, 1, 2) @ own
    found = np.zeros((n // 3, reach + 3, 3))
    room = reach + 3 * ROOM
    window, at = np.zeros((room, room)), room - reach
    for k in range(n // 3 - 1, -1, -1):
        headway.mark()
        if at < 3:
            window[-reach:, -reach:] = window[at : at + reach, at : at + reach].copy()
            at = room - reach
        known = window[at : at + reach, at : at + reach]
        aside = -known @ gain[k]
        middle = pivot[k] - gain[k].T @ aside
        window[at : at + reach, at - 3 : at] = aside
        window[at - 3 : at, at : at + reach] = aside.T
        window[at - 3 : at, at - 3 : at] = middle
        found[k, :3], found[k, 3:] = middle, aside
        at -= 3
    band = np.zeros((width, n))
    for c in range(3):
        band[:, c::3] = found[:, c : c + width, c].T
    return band
