"""How much ranges scatter about what module 3 makes of them, pair by pair.

How noisy ranges are differs from module to module and from room to room, and the configuration can
only say what must be allowed for. A window has too few independent ranges to tell; the solution of
a whole drive has enough. With the configured sigma, a prior worth m ranges and n measured ones with
errors e_i and sigmas sigma_i,

    scatter^2 = (m + sum min(|e_i|, c sigma_i)^2 / sigma^2) / (m + n)

is the posterior mean of a variance (1 where nothing is measured), and c is module 3's own threshold
(`RangeModel.cauchy_sigmas`). Neighbouring ranges share their errors, so the prior counts as
often as they do.

That is for windows, each of one pair. The modules of a team are of one kind and in one room, so of
all pairs together what was configured is said once and not once for each pair: the scatter of all
others is found likewise out of their ranges, and a pair is held at that in place of 1
(`shared_ratios`). How much of an error is left a second later is found for the team (`lasting`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.conventions import GRID_HZ
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
NEXT = GRID_HZ * 3 // 2
"""Steps of the grid to the range of the next second; what is thinned lies farther apart."""
TINY = 1e-12
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
    total, count = _sums(errors, sigmas, pair, pairs, configured, most_sigmas)
    return np.asarray(np.sqrt((PRIOR_RANGES + total) / (PRIOR_RANGES + count)))


def shared_ratios(
    errors: Array,
    sigmas: Array,
    pair: Index,
    *,
    pairs: int,
    configured: float,
    most_sigmas: float,
) -> Array:
    """(pairs,) the same, where pairs of one team are taken to be alike; see `scatter_ratios`."""
    total, count = _sums(errors, sigmas, pair, pairs, configured, most_sigmas)
    others = (PRIOR_RANGES + total.sum() - total) / (PRIOR_RANGES + count.sum() - count)
    return np.asarray(np.sqrt((PRIOR_RANGES * others + total) / (PRIOR_RANGES + count)))


def lasting(
    errors: Array, sigmas: Array, pair: Index, n: Array, *, usual: float, most_sigmas: float
) -> float:
    """Correlation of errors that are a second apart, of all pairs.

    Args:
        errors, sigmas, pair: see `scatter_ratios`.
        n: (n,) when they were measured, steps of the keyframes' grid.
        usual: what the model of ranges says; it counts like a prior of the scatter.
    """
    order = np.lexsort((n, pair))
    size = np.clip(errors / sigmas, -most_sigmas, most_sigmas)[order]
    apart, pair = np.diff(n[order]), pair[order]
    is_next = (pair[1:] == pair[:-1]) & (apart > 0) & (apart <= NEXT)
    one, other = size[:-1][is_next], size[1:][is_next]
    if not len(one):
        return usual
    squares = float((one @ one + other @ other) / 2)
    prior = PRIOR_RANGES * squares / len(one)
    return float((usual * prior + one @ other) / max(prior + squares, TINY))


def _sums(
    errors: Array, sigmas: Array, pair: Index, pairs: int, configured: float, most_sigmas: float
) -> tuple[Array, Array]:
    """(pairs,) squares over what is configured, and (pairs,) of how many ranges."""
    least = np.full(pairs, np.inf)
    np.minimum.at(least, pair, sigmas)
    plain = sigmas <= PLAIN * least[pair]
    sizes = np.minimum(np.abs(errors), most_sigmas * sigmas)[plain]
    squares = (sizes / configured) ** 2
    total = np.bincount(pair[plain], squares, pairs)
    return total, np.bincount(pair[plain], minlength=pairs)


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
