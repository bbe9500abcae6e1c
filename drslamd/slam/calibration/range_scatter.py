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

import numpy as np

from drslamd.slam.se2 import Array, Index

PRIOR_RANGES = 20
"""m: as much as five independent ranges would say (see `RangeModel.correlated_ratio`), which leaves
what was configured uncertain by a third."""
ROUNDS = 5
"""Of weighing; each brings the ratio nearer to its end by a factor of three."""
GAUSSIAN = 1.5
"""What the weights take off the variance of a normal distribution, for a cut at 2.5 sigmas."""
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


def inlier_scatter(
    errors: Array, sigmas: Array, pair: Index, *, pairs: int, sigmas_cut: float
) -> Array:
    """(pairs,) the same of ranges that are no outliers, over the sigma that each was sent with.

    Weights fall with the square of Cauchy's, so bursts leave no trace; never more than 1, because
    what is configured must be allowed for.

    Args:
        sigmas_cut: where Cauchy's weight is a half.
    """
    squares = (errors / sigmas) ** 2
    scatter = np.ones(pairs)
    for _ in range(ROUNDS):
        weights = squares * ((sigmas_cut * scatter) ** -2)[pair]
        weights += 1
        np.divide(1, weights, out=weights)
        weights *= weights
        count = np.bincount(pair, weights, pairs)
        weights *= squares
        total = GAUSSIAN * np.bincount(pair, weights, pairs)
        scatter = np.sqrt((PRIOR_RANGES + total) / (PRIOR_RANGES + count))
        scatter = np.minimum(np.maximum(scatter, LEAST_SCATTER), 1.0)
    return scatter
