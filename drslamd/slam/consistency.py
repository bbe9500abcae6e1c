"""Module 2: which closures of one pair of robots belong together (paper III-B, equation 2).

Two closures k and i agree when the loop that they form with both odometries,

    x_a^{k,i} + x_ab^i + x_b^{i,k} - x_ab^k,

is short: its squared Mahalanobis length is below the chi-squared quantile of 1 - epsilon with
three degrees of freedom. Each closure is carried to one place, the frame of a's odometry, as
``oa_T_ob = oa_T_a a_T_b (ob_T_b)^-1``; there the loop is one difference of twists and the noise of
both odometries is a difference of running sums, so a new closure costs one vectorised row.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drslamd.slam import se2
from drslamd.slam.chi_squared import quantile3
from drslamd.slam.clique import IncrementalClique, bits, is_clique
from drslamd.slam.odometry import OdometryNoise, covariance_between
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
        a_sums, b_sums: (6,) `odometry.growth` of both chains there.
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
    """The candidates as arrays, one row each."""

    closure: Array
    offset: Array
    covariance: Array
    a_pose: Array
    b_pose: Array
    a_sums: Array
    b_sums: Array

    @staticmethod
    def empty() -> _Columns:
        shapes: list[tuple[int, ...]] = [(), (3,), (3, 3), (3,), (3,), (6,), (6,)]
        return _Columns(*(np.empty((MAX_VERTICES, *shape)) for shape in shapes))

    def all(self) -> list[Array]:
        return [self.closure, self.offset, self.covariance,
                self.a_pose, self.b_pose, self.a_sums, self.b_sums]  # fmt: skip


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
        row = [candidate.closure, offset, carry @ candidate.covariance @ carry.T,
               candidate.a_pose, candidate.b_pose, candidate.a_sums, candidate.b_sums]  # fmt: skip
        for column, value in zip(self._columns.all(), row, strict=True):
            column[k] = value
        distance = self.distances(k)
        agrees = (distance <= quantile3(1 - self.epsilon)) & (
            self._columns.closure[:k] != candidate.closure
        )
        self.graph.add(int.from_bytes(np.packbits(agrees, bitorder="little").tobytes(), "little"))
        if not is_clique(self.graph.adjacency, self.graph.clique):
            raise AssertionError("the consistent set is not a clique")

    def distances(self, k: int) -> Array:
        """(k,) squared Mahalanobis length of the loops of candidate k with all before it."""
        return self._lengths(np.full(k, k), np.arange(k))

    def _lengths(self, k: Array, i: Array) -> Array:
        """(m,) squared Mahalanobis lengths of the loops of candidates k with i, each i before k."""
        c = self._columns
        loop = se2.log(se2.compose(c.offset[k], se2.inverse(c.offset[i])))
        moved_a = covariance_between(self.noise_a, c.a_pose, c.a_sums, i, k)
        moved_b = covariance_between(self.noise_b, c.b_pose, c.b_sums, i, k)
        carry = se2.adjoint(c.offset[k])
        carried_b = carry @ moved_b @ np.swapaxes(carry, -1, -2)
        return squared_length(loop, c.covariance[i] + c.covariance[k] + moved_a + carried_b)

    def renew_sums(self, vertices: Array, a_sums: Array, b_sums: Array) -> None:
        """What `odometry.growth` says now of the ends of some candidates: keyframes that came
        late make the way to those behind them longer."""
        self._columns.a_sums[vertices], self._columns.b_sums[vertices] = a_sums, b_sums

    def kept(self) -> list[int]:
        """Closures of the largest consistent set, as the numbers that they were given."""
        return [int(self._columns.closure[v]) for v in bits(self.graph.clique)]

    def kept_vertices(self) -> list[int]:
        return bits(self.graph.clique)

    def rivals(self) -> int:
        """Size of the largest consistent set among the candidates that were not kept."""
        return self.graph.runner_up().bit_count()

    def why_not(self, vertex: int) -> tuple[int, float] | None:
        """The kept closure that candidate `vertex` disagrees with most, and its squared length.

        None when it is kept itself. Hypotheses of its own window are no reason: those exclude
        each other whatever their distance.
        """
        closure = self._columns.closure
        kept = np.array(bits(self.graph.clique), dtype=np.int64)
        others = kept[closure[kept] != closure[vertex]]
        if vertex in kept or not len(others):
            return None
        lengths = self._lengths(np.maximum(others, vertex), np.minimum(others, vertex))
        worst = int(np.argmax(lengths))
        return int(closure[others[worst]]), float(lengths[worst])

    def _forget(self) -> None:
        keep = MAX_VERTICES - FORGET
        for column in self._columns.all():
            column[:keep] = column[FORGET:].copy()
        self.graph.drop_oldest(FORGET)
        self.forgotten += FORGET


def squared_length(error: Array, covariance: Array) -> Array:
    """error' covariance^-1 error for (n, 3) and (n, 3, 3), by elimination.

    Infinite where the covariance is none, as sums over an absurd trajectory may make it.
    """
    c = covariance
    e0, e1, e2 = error[:, 0], error[:, 1], error[:, 2]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        d0 = c[:, 0, 0]
        l10, l20 = c[:, 1, 0] / d0, c[:, 2, 0] / d0
        d1 = c[:, 1, 1] - l10 * c[:, 1, 0]
        c21 = c[:, 2, 1] - l20 * c[:, 1, 0]
        l21 = c21 / d1
        d2 = c[:, 2, 2] - l20 * c[:, 2, 0] - l21 * c21
        y1 = e1 - l10 * e0
        y2 = e2 - l20 * e0 - l21 * y1
        length = e0 * e0 / d0 + y1 * y1 / d1 + y2 * y2 / d2
    return np.where((d0 > 0) & (d1 > 0) & (d2 > 0), length, np.inf)
