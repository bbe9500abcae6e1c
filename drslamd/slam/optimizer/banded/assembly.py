"""A system of band and border, and how factors are added up to one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from drslamd.slam.optimizer.banded.layout import NOWHERE, BandLayout
from drslamd.slam.optimizer.banded.linearised import Linearised
from drslamd.slam.se2 import Array, Index

SPARSE = 32
"""Where a matrix has so many times more entries than are added to it, they are added one by one."""

LEAN = 8
"""Where it has so many times more, they are held one by one: to sort them takes as much memory."""


class Bordered(ABC):
    """What systems share, however they hold their band and border."""

    corner: Array

    @property
    @abstractmethod
    def diagonal(self) -> Array:
        """(n,) of the band, to be added to."""

    def add_prior(self, unknowns: Index, stiffness: Array | float) -> None:
        """Add independent priors by the information with which they hold unknowns (k,)."""
        n = len(self.diagonal)
        inside = unknowns < n
        if not inside.any():
            self.corner[unknowns - n, unknowns - n] += stiffness
            return
        stiffness = np.broadcast_to(stiffness, unknowns.shape)
        self.diagonal[unknowns[inside]] += stiffness[inside]
        outside = unknowns[~inside] - n
        self.corner[outside, outside] += stiffness[~inside]

    def add_blocks(self, unknowns: Index, stiffness: Array) -> None:
        """Hold m groups of unknowns (m, d) of the border with information (m, d, d)."""
        at = unknowns - len(self.diagonal)
        self.corner[at[:, :, None], at[:, None, :]] += stiffness

    def add_difference(self, unknowns: Index, one: Index, stiffness: Array) -> None:
        """Hold unknowns (k,) of the border beside one other (1,) with information (k, k)."""
        n = len(self.diagonal)
        many, single = unknowns - n, one - n
        self.corner[many[:, None], many] += stiffness
        sums = stiffness.sum(axis=0)
        self.corner[many, single] -= sums
        self.corner[single, many] -= sums
        self.corner[single, single] += sums.sum()


@dataclass
class System(Bordered):
    """A symmetric matrix: lower band (w, n), border (n, b) and corner (b, b)."""

    band: Array
    border: Array
    corner: Array

    @property
    def diagonal(self) -> Array:
        return np.asarray(self.band[0])

    @staticmethod
    def empty(layout: BandLayout) -> System:
        return System.of_entries(layout, np.zeros(entries_of(layout)))

    @staticmethod
    def of_entries(layout: BandLayout, entries: Array) -> System:
        """Of all entries one after the other, column by column, as LAPACK has them: those of the
        band, then border and corner as one (n + b, b)."""
        n, b = layout.band, layout.border
        of_band = layout.width * n
        wide = entries[of_band:].reshape(b, n + b).T
        return System(entries[:of_band].reshape(n, layout.width).T, wide[:n], wide[n:])

    def add(self, other: System) -> None:
        """Add another one of the same layout."""
        self.band += other.band
        self.border += other.border
        self.corner += other.corner


class Entries(Protocol):
    """(n, b), however it is held."""

    @property
    def columns(self) -> int:
        """b."""

    def rows(self, first: int, end: int) -> Array:
        """(end - first, b) in full."""

    def lengths(self) -> Index:
        """(n,) up to the last entry of each row that is not zero; all of a row that has none."""


@dataclass(frozen=True)
class AllEntries:
    """In full, (n, b)."""

    full: Array

    @property
    def columns(self) -> int:
        return int(self.full.shape[1])

    def rows(self, first: int, end: int) -> Array:
        return np.array(self.full[first:end])

    def lengths(self) -> Index:
        return np.asarray(self.columns - np.argmax(self.full[:, ::-1] != 0, axis=1))


@dataclass(frozen=True)
class FewEntries:
    """(n, b) of which few are not zero: a range knows one bias of the thousands of a large team,
    and two poses of many.

    Attributes:
        starts: (n + 1,) of the entries of each row; column, value: of each entry, several of which
            may be for the same place.
    """

    starts: Index
    column: Index
    value: Array
    width: int

    @staticmethod
    def of(row: Index, column: Index, value: Array, shape: tuple[int, int]) -> FewEntries:
        """Of entries in any order; those of one place are added in this order."""
        order = np.argsort(row, kind="stable")
        starts = np.searchsorted(row[order], np.arange(shape[0] + 1))
        return FewEntries(starts, column[order], value[order], shape[1])

    @property
    def columns(self) -> int:
        return self.width

    def rows(self, first: int, end: int) -> Array:
        mine = slice(*self.starts[[first, end]].tolist())
        row = np.repeat(np.arange(end - first), np.diff(self.starts[first : end + 1]))
        at = row * self.columns + self.column[mine]
        sums = np.bincount(at, self.value[mine], (end - first) * self.columns)
        # (of nothing it counts whole numbers)
        return sums.reshape(end - first, self.columns).astype(float, copy=False)

    def lengths(self) -> Index:
        """(n,) up to the last entry of each row that is not zero; all of a row that has none."""
        row, length = (
            np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts)),
            self.column + 1,
        )
        found = np.zeros(len(self.starts) - 1, dtype=np.int64)
        np.maximum.at(found, row, np.where(self.value != 0, length, 0))
        return np.where(found == 0, self.columns, found)


@dataclass
class LeanSystem(Bordered):
    """The same matrix, held as it takes less memory.

    Attributes:
        band: (n, w) column by column; added: (n,) to the diagonal.
        border: (n, b); corner: (b, b).
    """

    band: Entries
    border: Entries
    corner: Array
    added: Array

    @property
    def diagonal(self) -> Array:
        return self.added

    def columns(self, first: int, end: int) -> Array:
        """(w, end - first) of the band, in full."""
        found = self.band.rows(first, end)
        found[:, 0] += self.added[first:end]
        return np.asarray(found.T)


def entries_of(layout: BandLayout) -> int:
    """How many numbers a system has."""
    return layout.width * layout.band + (layout.band + layout.border) * layout.border


class Assembly:
    """Where the blocks of some sets of factors go in the system; the same in every iteration.

    Blocks are symmetric, so each two columns of a Jacobian are multiplied once. All sets are summed
    at once: numpy takes as long for the few factors of a small team as for those of a large one.
    """

    def __init__(self, layout: BandLayout, sets: Sequence[Index]) -> None:
        """
        Args:
            sets: (m, c) on which unknowns each factor of a set depends.
        """
        self._layout = layout
        self._columns: list[slice | Index] = []
        self._unknowns: list[Index] = []
        for unknowns in sets:
            # most often no mounting is an unknown
            some = np.flatnonzero((unknowns != NOWHERE).any(axis=0))
            is_first = len(some) == 0 or some[-1] == len(some) - 1
            columns = slice(len(some)) if is_first else some
            self._columns.append(columns)
            self._unknowns.append(np.ascontiguousarray(unknowns.T[columns]))

    @cached_property
    def _places(self) -> tuple[Index, Index]:
        """Where the products of columns go, those of each set (t, m), in the entries of a system or
        beyond them; and which of them go to the other side of the corner as well, behind them."""
        n, width = self._layout.band, self._layout.width
        high, first = n + self._layout.border, width * n
        at, apart, mirrored, count = [], [], [], 0
        for unknowns in self._unknowns:
            is_partial = bool((unknowns == NOWHERE).any())
            # (a few columns at a time stay in the processor's cache)
            for k, own in enumerate(unknowns):
                row, column = np.maximum(own, unknowns[: k + 1]), np.minimum(own, unknowns[: k + 1])
                place = column * (width - 1)
                place += row
                is_high = row >= n
                if is_high.any():
                    np.copyto(place, (row - n) * high + (column + first), where=is_high)
                    twice = np.flatnonzero((column >= n) & (row != column))
                    apart.append(count + twice)
                    row, column = row.ravel()[twice], column.ravel()[twice]
                    mirrored.append(first + (column - n) * high + row)
                if is_partial:
                    place[np.minimum(own, unknowns[: k + 1]) == NOWHERE] = entries_of(self._layout)
                at.append(place.ravel())
                count += place.size
        none = np.zeros(0, dtype=np.int64)
        return np.concatenate([*at, *mirrored, none]), np.concatenate([*apart, none])

    @cached_property
    def _entries(self) -> Index:
        """Where the right-hand sides go, likewise."""
        unknowns = np.concatenate([each.ravel() for each in self._unknowns])
        unknowns[unknowns == NOWHERE] = self._layout.band + self._layout.border
        return unknowns

    def matrix(self, sets: Sequence[Linearised]) -> System:
        """J' W J."""
        at, products = self._places[0], self._products(sets)
        return System.of_entries(self._layout, _sums(at, products, entries_of(self._layout)))

    def lean_matrix(self, sets: Sequence[Linearised]) -> LeanSystem:
        """J' W J, with as little memory as it needs."""
        n, b, width = self._layout.band, self._layout.border, self._layout.width
        if len(self._places[0]) * LEAN >= entries_of(self._layout):
            whole = self.matrix(sets)
            band, border = AllEntries(whole.band.T), AllEntries(whole.border)
            return LeanSystem(band, border, whole.corner, np.zeros(n))
        at, products = self._places[0], self._products(sets)
        inside = np.flatnonzero(at < width * n)
        row, column = np.divmod(at[inside], width)
        few_of_band = FewEntries.of(row, column, products[inside], (n, width))
        beyond = np.flatnonzero((at >= width * n) & (at < entries_of(self._layout)))
        column, row = np.divmod(at[beyond] - width * n, n + b)
        products, is_corner = products[beyond], row >= n
        of_corner = column[is_corner] * b + row[is_corner] - n
        corner = _sums(of_corner, products[is_corner], b * b).reshape(b, b).T
        of_border = row[~is_corner], column[~is_corner], products[~is_corner]
        return LeanSystem(few_of_band, FewEntries.of(*of_border, (n, b)), corner, np.zeros(n))

    def _products(self, sets: Sequence[Linearised]) -> Array:
        """What is added at each of the places."""
        at, apart = self._places
        products, end = np.empty(len(at)), 0
        for columns, factors in zip(self._columns, sets, strict=True):
            jacobian = by_columns(factors.jacobian, columns)
            weighed = by_weight(jacobian, factors.information)
            for k, column in enumerate(jacobian):
                begin, end = end, end + (k + 1) * jacobian.shape[2]
                out = products[begin:end].reshape(k + 1, -1)
                if len(column) == 1:
                    np.multiply(column, weighed[: k + 1, 0], out=out)
                else:
                    np.einsum("dm,tdm->tm", column, weighed[: k + 1], out=out)
        products[end:] = products[apart]
        return products

    def gradient(self, sets: Sequence[Linearised]) -> Array:
        """(n + b,) J' f."""
        each = []
        for columns, factors in zip(self._columns, sets, strict=True):
            pull = np.ascontiguousarray(factors.pull.T)
            jacobian = by_columns(factors.jacobian, columns)
            each.append(np.einsum("dm,cdm->cm", pull, jacobian).ravel())
        return _sums(self._entries, np.concatenate(each), self._layout.band + self._layout.border)


def by_columns(jacobian: Array, columns: slice | Index = slice(None)) -> Array:
    """(c, d, m) some columns of Jacobians (m, d, c'), each number of all factors side by side."""
    return np.ascontiguousarray(jacobian.transpose(2, 1, 0)[columns])


def by_weight(jacobian: Array, information: Array) -> Array:
    """(c, d, m) W J.

    Args:
        jacobian: (c, d, m) of m factors; information: (m, d, d) W, symmetric.
    """
    weight = np.ascontiguousarray(information.transpose(1, 2, 0))
    weighed = jacobian[:, :1] * weight[0]
    for k in range(1, len(weight)):
        weighed += jacobian[:, k, None] * weight[k]
    return np.asarray(weighed)


def _sums(at: Index, values: Array, count: int) -> Array:
    """(count,) sums of what goes to each place; what goes beyond them is left out."""
    if len(at) >= count // SPARSE:
        return np.bincount(at, values, count + 1)[:count]
    sums = np.zeros(count + 1)
    np.add.at(sums, at, values)
    return sums[:count]
