"""How much ranges scatter about what module 3 makes of them, pair by pair.

How noisy ranges are differs from module to module and from room to room, and the configuration can
only say what must be allowed for. A window has too few independent ranges to tell; the solution of
a whole drive has enough. With the configured sigma, a prior worth m ranges and n measured ones with
errors e_i and sigmas sigma_i,

    scatter^2 = (m + sum min(|e_i|, c sigma_i)^2 / sigma^2) / (m + n)

is the posterior mean of a variance (1 where nothing is measured), and c is module 3's own threshold
(`RangeModel.cauchy_sigmas`). Neighbouring ranges share their errors, so the prior counts as
often as they do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.se2 import Array, Index

PRIOR_RANGES = 20
"""m: as much as five independent ranges would say (see `RangeModel.correlated_ratio`), which leaves
what was configured uncertain by a third."""
ROUNDS = 5
"""Of weighing; each brings the ratio nearer to its end by a factor of three."""
GAUSSIAN = 1.5
"""What the weights take off the variance of a normal distribution, for a cut at 2.5 sigmas."""
NO_RANGE = 1e200
"""Squared error, in sigmas, of what counts for nothing."""
LEAST_SCATTER = 0.3
"""No module is more than three times better than what must be allowed for."""
PLAIN = 1.05
"""A range with a sigma so many times the smallest of its pair is doubted for reasons of its own,
being short or blocked, and tells nothing of the others."""


def scatter_ratios(
    errors: Array,
    sigmas: Array,
    pair: Index,
    *,
    pairs: int,
    configured: float,
    most_sigmas: float,
) -> Array:
    """(pairs,) true sigma of ranges over the configured one.

    Args:
        errors: (n,) m, predicted minus measured, biases taken out.
        sigmas: (n,) m, what each was sent with: more where a range is doubted.
        pair: (n,) which pair measured it.
        configured: m, what windows allow for.
        most_sigmas: bursts count as far as module 3 believes them.
    """
    least = np.full(pairs, np.inf)
    np.minimum.at(least, pair, sigmas)
    plain = sigmas <= PLAIN * least[pair]
    sizes = np.minimum(np.abs(errors), most_sigmas * sigmas)[plain]
    squares = (sizes / configured) ** 2
    total = np.bincount(pair[plain], squares, pairs)
    count = np.bincount(pair[plain], minlength=pairs)
    return np.asarray(np.sqrt((PRIOR_RANGES + total) / (PRIOR_RANGES + count)))


@dataclass(frozen=True)
class SideBySide:
    """Where n ranges are when those of each pair stand in one row: sums over rows take a tenth of
    the time of sums over names.

    Attributes:
        place: (n,) in rows of so many (`most`) places; pairs: so many rows.
    """

    place: Index
    most: int
    pairs: int

    @staticmethod
    def of(pair: Index, pairs: int) -> SideBySide:
        """
        Args:
            pair: (n,) which pair measured each.
        """
        count = np.bincount(pair, minlength=pairs)
        most = int(count.max(initial=0))
        begins = np.arange(pairs) * most - (np.cumsum(count) - count)
        place = np.empty(len(pair), dtype=np.int64)
        order = np.argsort(pair, kind="stable")
        place[order] = np.repeat(begins, count) + np.arange(len(pair))
        return SideBySide(place, most, pairs)

    def rows(self, values: Array, nothing: float) -> Array:
        """(pairs, most) values (n,), and something where there is none."""
        out = np.full(self.pairs * self.most, nothing)
        out[self.place] = values
        return out.reshape(self.pairs, self.most)


def inlier_scatter(errors: Array, sigmas: Array, by_pair: SideBySide, sigmas_cut: float) -> Array:
    """(pairs,) the same of ranges that are no outliers, over the sigma that each was sent with.

    Weights fall with the square of Cauchy's, so bursts leave no trace; never more than 1, because
    what is configured must be allowed for.

    Args:
        by_pair: which pair measured each.
        sigmas_cut: where Cauchy's weight is a half.
    """
    squares = by_pair.rows((errors / sigmas) ** 2, NO_RANGE)
    weights = np.empty_like(squares)
    scatter = np.ones(by_pair.pairs)
    for _ in range(ROUNDS):
        half = ((sigmas_cut * scatter) ** 2)[:, None]
        np.add(squares, half, out=weights)
        np.divide(half, weights, out=weights)
        weights *= weights
        total = GAUSSIAN * np.einsum("pk,pk->p", weights, squares)
        scatter = np.sqrt((PRIOR_RANGES + total) / (PRIOR_RANGES + weights.sum(axis=1)))
        scatter = np.minimum(np.maximum(scatter, LEAST_SCATTER), 1.0)
    return scatter
