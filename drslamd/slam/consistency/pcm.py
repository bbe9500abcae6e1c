"""Module 2: which closures of one pair of robots belong together (paper III-B, equation (3)).

Two closures k and i agree when the loop that they form with both odometries,

    x_a^{k,i} + x_ab^i + x_b^{i,k} - x_ab^k,                                         eq. (3)

is short: its squared Mahalanobis length is below the chi-squared quantile of 1 - epsilon with
three degrees of freedom. Each closure is carried to one place, the frame of a's odometry, as
``oa_T_ob = oa_T_a a_T_b (ob_T_b)^-1``. There the loop is one difference of twists and the noise of
both odometries is a difference of running sums, so a new closure costs one vectorised row.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from drslamd.slam import se2
from drslamd.slam.chi_squared import quantile3
from drslamd.slam.consistency import loops
from drslamd.slam.consistency.incremental_clique import IncrementalClique, bits
from drslamd.slam.consistency.loops import Places, columns
from drslamd.slam.odometry.noise import SUMS, OdometryNoise, twist_covariance
from drslamd.slam.se2 import Array

MAX_VERTICES = 1_000
"""Candidates that one pair remembers; older ones are forgotten in blocks. 1 000 closures are a
quarter of an hour at 1 Hz and 125 kB of adjacency bits."""
FORGET = 200


@dataclass(frozen=True)
class Candidate:
    """One hypothesis of module 1, with what is needed to carry it elsewhere.

    Attributes:
        closure: number of the window that it came from; hypotheses of one window exclude each
            other.
        a_T_b: (3,).
        covariance: (3, 3) of x, y, theta in the frame of a.
        a_pose, b_pose: (3,) oa_T_a and ob_T_b at the two ends.
        a_sums, b_sums: (13,) `odometry.growth` of both chains there.
    """

    closure: int
    a_T_b: Array
    covariance: Array
    a_pose: Array
    b_pose: Array
    a_sums: Array
    b_sums: Array


@dataclass
class _Columns:
    """The candidates as arrays, one column each."""

    closure: Array
    offset: Array
    covariance: Array
    a_place: Array
    b_place: Array
    a_sums: Array
    b_sums: Array

    @staticmethod
    def empty() -> _Columns:
        return _Columns(*(np.empty((rows, MAX_VERTICES)) for rows in (1, 3, 6, 2, 2, SUMS, SUMS)))

    def all(self) -> list[Array]:
        return [
            self.closure,
            self.offset,
            self.covariance,
            self.a_place,
            self.b_place,
            self.a_sums,
            self.b_sums,
        ]


@dataclass
class PairConsistency:
    """The closures of one pair, and the largest set of them that agrees."""

    noise_a: OdometryNoise
    noise_b: OdometryNoise
    epsilon: float
    graph: IncrementalClique = field(default_factory=IncrementalClique)
    forgotten: int = 0
    """Candidates that are no longer remembered."""
    _columns: _Columns = field(default_factory=_Columns.empty)

    def __len__(self) -> int:
        return len(self.graph)

    def add(self, candidate: Candidate) -> None:
        """Judge one more candidate against all that are remembered."""
        if len(self) == MAX_VERTICES:
            self._forget()
        k = len(self)
        offset = se2.compose(
            se2.compose(candidate.a_pose, candidate.a_T_b), se2.inverse(candidate.b_pose)
        )
        # (x, y, theta) in the frame of a become a left twist in the frame of a's odometry
        local = se2.adjoint(np.array([*candidate.a_T_b[:2], 0.0]))
        carry = se2.adjoint(candidate.a_pose) @ local
        covariance = np.array(se2.packed(carry @ candidate.covariance @ carry.T))
        row = [
            np.array([candidate.closure]),
            offset,
            covariance,
            candidate.a_pose[:2],
            candidate.b_pose[:2],
            candidate.a_sums,
            candidate.b_sums,
        ]
        for column, value in zip(self._columns.all(), row, strict=True):
            column[:, k] = value
        distance = self.distances(k)
        agrees = (
            (distance <= quantile3(1 - self.epsilon))
            & (  # eq. (3)
                self._columns.closure[0, :k] != candidate.closure
            )
        )
        self.graph.add(int.from_bytes(np.packbits(agrees, bitorder="little").tobytes(), "little"))
        if not self.graph.is_verified():
            raise AssertionError("the consistent set is not a clique")

    def distances(self, k: int) -> Array:
        """(k,) squared Mahalanobis length of the loops of candidate k with all before it."""
        return self._lengths(k, slice(k))

    def _lengths(self, k: Places, i: Places) -> Array:
        """(m,) squared Mahalanobis lengths of the loops of candidates k with i, each i before k."""
        c = self._columns
        offset = columns(c.offset, k)
        moved_a, moved_b = (
            twist_covariance(
                noise, columns(place, k) - columns(place, i), columns(sums, k) - columns(sums, i)
            )
            for noise, place, sums in (
                (self.noise_a, c.a_place, c.a_sums),
                (self.noise_b, c.b_place, c.b_sums),
            )
        )
        covariance = columns(c.covariance, i) + columns(c.covariance, k)
        covariance += moved_a + loops.carried_covariance(offset, moved_b)
        return loops.squared_length(loops.twists(offset, columns(c.offset, i)), covariance)

    def renew_sums(self, vertices: Array, a_sums: Array, b_sums: Array) -> None:
        """What `odometry.growth` says now of the ends of some candidates: keyframes that came
        late make the way to those behind them longer."""
        self._columns.a_sums[:, vertices] = a_sums.T
        self._columns.b_sums[:, vertices] = b_sums.T

    def kept(self) -> list[int]:
        """Closures of the largest consistent set, as the numbers that they were given."""
        return [int(self._columns.closure[0, v]) for v in bits(self.graph.clique)]

    def kept_vertices(self) -> list[int]:
        return bits(self.graph.clique)

    def rivals(self, among: Iterable[int] | None = None) -> int:
        """Size of the largest consistent set among the candidates that were not kept.

        Args:
            among: vertices that count; all where it is None.
        """
        allowed = None if among is None else sum(1 << vertex for vertex in among)
        return self.graph.runner_up(allowed=allowed).bit_count()

    def _forget(self) -> None:
        keep = MAX_VERTICES - FORGET
        for column in self._columns.all():
            column[:, :keep] = column[:, FORGET:].copy()
        self.graph.drop_oldest(FORGET)
        self.forgotten += FORGET
