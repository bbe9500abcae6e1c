"""Quantiles of the chi-squared distribution with three degrees of freedom, without scipy.stats."""

from __future__ import annotations

import math
from functools import lru_cache


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
