"""Gaussian elimination of a band with a border in dense blocks, as far as is wanted.

Set by set, with K the unknowns of a set, R those below them that they reach, B the border:

    A_KK = L L'    G = A_RK L'^-1    V = L^-1 A_KB
    A_RR -= G G'   A_RB -= G V       A_BB -= V' V

Dense blocks go through the processor many times faster than diagonals of a band, and each is as
high as its unknowns reach: recent times, which are the most, reach less far than thinned ones.
What is left at the end is the system of the unknowns that stay, and can be taken up again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from drslamd.slam import headway
from drslamd.slam.lapack.routines import inverse_triangular
from drslamd.slam.optimizer.banded.assembly import LeanSystem
from drslamd.slam.se2 import Array, Index

LEAST_COLUMNS, MOST_COLUMNS = 128, 256
"""Of a block: fewer leave the processor idle, more do work that the band would not need."""
AT_ONCE = 2**22
"""Numbers of V, 32 MB, that are multiplied with themselves together: all of a small team."""
SINGLE = np.float32
Singles = NDArray[np.float32]


@dataclass(frozen=True)
class Elimination:
    """Unknowns that were eliminated together.

    Solutions pass through all of them each time, and are but steps to where a gradient is zero:
    half the digits are half the memory and half the time.

    Attributes:
        own, below: their numbers (c,), and those (r,) of the unknowns that they reach.
        inverse: (c, c) L^-1; onwards: (r + b, c) G, then V' of the border as it was then; of 32
            bits, as are the vectors.
    """

    own: Index | slice
    below: Index | slice
    inverse: Singles
    onwards: Singles

    @staticmethod
    def of(
        own: Index | slice, below: Index | slice, inverse: Array, gain: Array, aside: Array
    ) -> Elimination:
        onwards = np.concatenate([gain, aside.T]).astype(SINGLE)
        return Elimination(own, below, inverse.astype(SINGLE), onwards)

    def forward(self, inner: Singles, outer: Singles) -> None:
        """The way of right-hand sides inner (n, ...) and of the border, outer (b, ...), down."""
        inner[self.own] = own = self.inverse @ inner[self.own]
        change = self.onwards @ own
        below = inner[self.below]
        inner[self.below] = below - change[: len(below)]
        outer[: len(change) - len(below)] -= change[len(below) :]

    def backward(self, inner: Singles, outer: Singles) -> None:
        """And back up, with what lies below known."""
        below = inner[self.below]
        known = np.concatenate([below, outer[: len(self.onwards) - len(below)]])
        inner[self.own] = self.inverse.T @ (inner[self.own] - self.onwards.T @ known)


@dataclass(frozen=True)
class Rest:
    """A symmetric system of f unknowns and of the border.

    Attributes:
        matrix: (f, f); border: (f, b); corner: (b, b).
    """

    matrix: Array
    border: Array
    corner: Array

    def without(self, own: Index, below: Index, numbers: Index) -> tuple[Elimination, Rest] | None:
        """Some of its unknowns eliminated; None where it is not positive definite.

        Args:
            own, below: places of those (c,), and of those (f - c,) that stay.
            numbers: (f,) of all of them.
        """
        parts = _eliminated(
            self.matrix[np.ix_(own, own)], self.matrix[np.ix_(below, own)], self.border[own]
        )
        if parts is None:
            return None
        _, gain, aside = parts
        left = Rest(
            self.matrix[np.ix_(below, below)] - gain @ gain.T,
            self.border[below] - gain @ aside,
            self.corner - aside.T @ aside,
        )
        return Elimination.of(numbers[own], numbers[below], *parts), left


def eliminated(
    system: LeanSystem, count: int, with_blocks: bool = True
) -> tuple[list[Elimination], Rest] | None:
    """The first `count` unknowns of the band, in its order; None where they cannot be.

    What is left are the other unknowns of the band, then the border.

    Args:
        with_blocks: also what solutions pass through, which is most of the memory?
    """
    n, b = len(system.diagonal), system.border.columns
    ends = _ends(system)
    blocks: list[Elimination] = []
    corner = system.corner
    asides, held = np.empty((min(count, max(AT_ONCE // max(b, 1), MOST_COLUMNS)), b)), 0
    carried, carried_border, at = np.zeros((0, 0)), np.zeros((0, b)), 0
    while at < count:
        headway.mark()
        columns = int(np.clip(ends[at] - at, LEAST_COLUMNS, MOST_COLUMNS))
        columns = min(columns, count - at)
        end = max(int(ends[at + columns - 1]), at + len(carried))
        window, beside = _window(system, at, columns, end, carried, carried_border)
        parts = _eliminated(
            window[:columns, :columns], window[columns:, :columns], beside[:columns]
        )
        if parts is None:
            return None
        inverse, gain, aside = parts
        if held + columns > len(asides):
            corner, held = corner - asides[:held].T @ asides[:held], 0
        asides[held : held + columns] = aside
        held += columns
        if with_blocks:
            own, below = slice(at, at + columns), slice(at + columns, end)
            blocks.append(Elimination.of(own, below, inverse, gain, aside))
        carried = window[columns:, columns:] - gain @ gain.T
        carried_border = beside[columns:] - gain @ aside
        at += columns
    window, beside = _window(system, count, n - count, n, carried, carried_border)
    matrix = np.tril(window)
    matrix += np.tril(matrix, -1).T
    return blocks, Rest(matrix, beside, corner - asides[:held].T @ asides[:held])


def _eliminated(own: Array, below: Array, border: Array) -> tuple[Array, Array, Array] | None:
    """L^-1, G and V."""
    try:
        inverse = inverse_triangular(np.linalg.cholesky(own))
    except np.linalg.LinAlgError:
        return None
    return inverse, below @ inverse.T, inverse @ border


def _ends(system: LeanSystem) -> Index:
    """(n,) the row behind the last one that a column reaches, itself or through those before."""
    n = len(system.diagonal)
    return np.minimum(np.maximum.accumulate(np.arange(n) + system.band.lengths()), n)


def _window(
    system: LeanSystem,
    at: int,
    columns: int,
    end: int,
    carried: Array,
    carried_border: Array,
) -> tuple[Array, Array]:
    """Rows at .. end - 1 of the system, what was carried to them included.

    Only the first columns are there in full, below the diagonal; the others are what was carried.
    """
    width, size = system.band.columns, end - at
    dense = np.zeros((width + columns, columns))
    if columns:
        # each diagonal of the band is one column of a sheared view
        step = dense.strides[0], dense.strides[0] + dense.strides[1]
        as_strided(dense, (width, columns), step)[:] = system.columns(at, at + columns)
    window = np.zeros((size, size))
    height = min(size, len(dense))
    window[:height, :columns] = dense[:height]
    known = min(len(carried), size)
    window[:known, :known] += carried[:known, :known]
    beside = np.zeros((size, system.border.columns))
    beside[:columns] = system.border.rows(at, at + columns)
    beside[:known] += carried_border[:known]
    return window, beside
