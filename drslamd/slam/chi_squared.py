"""Chi-squared: quantiles with three degrees of freedom, and what a difference of two says."""

from __future__ import annotations

import math
from functools import lru_cache

LEVEL_FREEDOM = 5.0
"""For so many degrees of freedom counts that noise is configured as it is."""


def cdf3(x: float) -> float:
    """Probability that the squared length of a standard normal 3-vector is below x."""
    if x <= 0:
        return 0.0
    return math.erf(math.sqrt(x / 2)) - math.sqrt(2 * x / math.pi) * math.exp(-x / 2)


@lru_cache(maxsize=64)
def quantile3(probability: float) -> float:
    """The x with cdf3(x) = probability, to 1e-10; probability in [0, 1)."""
    low, high = 0.0, 1.0
    while cdf3(high) < probability:
        high *= 2
    while high - low > 1e-10 * max(1.0, high):
        middle = (low + high) / 2
        low, high = (middle, high) if cdf3(middle) < probability else (low, middle)
    return (low + high) / 2


def evidence(worse: float, best: float, freedom: float) -> float:
    """2 log-likelihood of what fits best against something else, where noise has any level.

    Noise is configured for any room, so most chi-squared are small, and differences between them
    say more than they seem to. The level is learned from the fit itself: with an inverse gamma
    prior at the configured variance residuals are Student's.

    Args:
        worse: chi-squared of the other one, less `best`.
        best: chi-squared of the best; freedom: degrees of it.
    """
    ratio = worse / (LEVEL_FREEDOM + best)
    return (LEVEL_FREEDOM + freedom) * math.log1p(max(ratio, -0.9))
