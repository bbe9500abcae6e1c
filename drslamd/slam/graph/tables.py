"""Measurements as arrays: rows that are kept in order, and names for their columns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import Chain
from drslamd.slam.graph.measurements import ClosureMeasurement, RangeMeasurement
from drslamd.slam.se2 import Array, Index


@dataclass(frozen=True)
class KeyframeTable:
    """k keyframes of one chain in the order of time, as rows (k, 5) of n, segment, x, y, theta."""

    rows: Array

    def __len__(self) -> int:
        return len(self.rows)

    @cached_property
    def n(self) -> Index:
        """(k,) samples of the 10 Hz grid."""
        return self.rows[:, 0].astype(np.int64)

    @cached_property
    def _keys(self) -> Array:
        """The same as they are searched."""
        return np.ascontiguousarray(self.rows[:, 0])

    @property
    def segment(self) -> Index:
        """(k,) ascending."""
        return self.rows[:, 1].astype(np.int64)

    @cached_property
    def is_one_segment(self) -> bool:
        """Segments ascend, so the first and the last tell."""
        return len(self) > 0 and bool(self.rows[0, 1] == self.rows[-1, 1])

    @property
    def poses(self) -> Array:
        """(k, 3) o_T_k, m and rad."""
        return self.rows[:, 2:]

    def chosen(self, which: NDArray[np.bool_] | Index | slice) -> KeyframeTable:
        return KeyframeTable(self.rows[which])

    def find(self, n: Array) -> tuple[Index, NDArray[np.bool_]]:
        """Positions of keyframes n (m,), and which of them are there."""
        return positions(self._keys, n)

    def of_segment(self, segment: int) -> slice:
        """Which rows a segment is; empty when it is not there."""
        return slice(*np.searchsorted(self.rows[:, 1], [segment, segment + 1]).tolist())

    def between(self, first: int, end: int) -> slice:
        """Which rows are those of samples first .. end - 1."""
        return slice(*np.searchsorted(self._keys, [first, end]).tolist())


def positions(ascending: Array, wanted: Array) -> tuple[Index, NDArray[np.bool_]]:
    """Where each wanted value is, and whether it is there at all."""
    at = np.minimum(np.searchsorted(ascending, wanted), max(len(ascending) - 1, 0))
    there = ascending[at] == wanted if len(ascending) else np.zeros(len(wanted), bool)
    return at, there


NO_HEADING = np.pi**2 / 3
"""Variance of a heading that may be any, rad^2: whoever claims so much claims nothing."""
RANGE_COLUMNS = 11
"""Of `RangeTable`."""


@dataclass(frozen=True)
class RangeTable:
    """k ranges of one pair by the keyframe of the owner and the place in its log, as rows
    (k, 11):

    a_n, place in the log, b_n, q_a (2), q_b (2), range, sigma, turn_a, turn_b.
    """

    rows: Array

    B_N = 2
    """Column of b_n."""

    def __len__(self) -> int:
        return len(self.rows)

    @staticmethod
    def row(place: int, r: RangeMeasurement) -> list[float]:
        """One row."""
        ends = (*r.q_a, *r.q_b)
        return [r.a_n, place, r.b_n, *ends, r.range_m, r.sigma_m, r.turn_a, r.turn_b]

    @property
    def a_n(self) -> Array:
        """(k,) keyframes of the owner."""
        return self.rows[:, 0]

    @property
    def place(self) -> Array:
        """(k,) where the owner's log says so; a number for each range."""
        return self.rows[:, 1]

    @property
    def b_n(self) -> Array:
        """(k,) keyframes of the peer."""
        return self.rows[:, self.B_N]

    @property
    def q_a(self) -> Array:
        """(k, 2) antenna of the owner seen from its keyframe, m."""
        return self.rows[:, 3:5]

    @property
    def q_b(self) -> Array:
        """(k, 2) antenna of the peer seen from its keyframe, m."""
        return self.rows[:, 5:7]

    @property
    def range_m(self) -> Array:
        return self.rows[:, 7]

    @property
    def sigma_m(self) -> Array:
        return self.rows[:, 8]

    @property
    def turn_a(self) -> Array:
        """(k,) how the owner stood turned against its keyframe, rad."""
        return self.rows[:, 9]

    @property
    def turn_b(self) -> Array:
        """(k,) how the peer did."""
        return self.rows[:, 10]

    def chosen(self, which: NDArray[np.bool_] | Index) -> RangeTable:
        return RangeTable(self.rows[which])

    def copy(self) -> RangeTable:
        """With columns that may be written to."""
        return RangeTable(self.rows.copy())


CLOSURE_COLUMNS = 18
"""Of `ClosureTable`."""


@dataclass(frozen=True)
class ClosureTable:
    """k closures of one pair by the keyframe of the owner and their number, as rows (k, 18):

    a_n, number, minus the place in the log of the word that counts, kept, b_n, a_T_b (3), xx xy xt
    yy yt tt, corrected (4).
    """

    rows: Array

    B_N = 4
    """Column of b_n."""

    def __len__(self) -> int:
        return len(self.rows)

    @staticmethod
    def row(place: int, c: ClosureMeasurement) -> list[float]:
        """One row; the smallest row of one number is that of the latest word."""
        ends = c.a_n, c.number, -place, c.kept, c.b_n
        return [*ends, *c.a_T_b, *c.covariance, *c.corrected]

    @property
    def a_n(self) -> Array:
        """(k,) keyframes of the owner."""
        return self.rows[:, 0]

    @property
    def number(self) -> Array:
        """(k,) of the owner's closures."""
        return self.rows[:, 1]

    @property
    def place(self) -> Array:
        """(k,) where the owner's log says so."""
        return -self.rows[:, 2]

    @property
    def b_n(self) -> Array:
        """(k,) keyframes of the peer."""
        return self.rows[:, self.B_N]

    @property
    def a_T_b(self) -> Array:
        """(k, 3)."""
        return self.rows[:, 5:8]

    @property
    def packed(self) -> Array:
        """(k, 6) covariances as `se2.packed` has them."""
        return self.rows[:, 8:14]

    @property
    def tells_place_only(self) -> NDArray[np.bool_]:
        """(k,) do they say where b stood, and nothing of its heading?"""
        return np.asarray(self.packed[:, 5] > 0.75 * NO_HEADING)

    @property
    def corrected(self) -> Array:
        """(k, 4) with which scale and turn of a and of b they were found."""
        return self.rows[:, 14:]

    @property
    def is_mirrored(self) -> NDArray[np.bool_]:
        """(k,) were they found with one of both turning the other way?"""
        return np.asarray((self.corrected[:, 1::2] < -1).any(axis=1))

    @property
    def covariance(self) -> Array:
        """(k, 3, 3) of x, y, theta in the frame of a."""
        return np.asarray(self.packed[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]])

    def kept(self) -> ClosureTable:
        """Those that were not withdrawn."""
        return self.chosen(self.rows[:, 3] == 1)

    def chosen(self, which: NDArray[np.bool_] | Index) -> ClosureTable:
        return ClosureTable(self.rows[which])

    def measurements(self, peer: Chain) -> list[ClosureMeasurement]:
        """One by one."""
        return [
            ClosureMeasurement(
                number=int(number),
                kept=bool(kept),
                a_n=int(a_n),
                peer=peer,
                b_n=int(b_n),
                a_T_b=(x, y, theta),
                covariance=tuple(rest[:6]),
                corrected=tuple(rest[6:]),
            )
            for a_n, number, _, kept, b_n, x, y, theta, *rest in self.rows.tolist()
        ]
