"""How long computations took of late, and how late the loop was."""

from __future__ import annotations

from collections import defaultdict, deque
from typing import Any

import numpy as np

KEPT = 1_000
"""Durations of each module, and lags of the loop, that are kept."""


class Pace:
    """Durations in ms."""

    def __init__(self) -> None:
        self.lags: deque[float] = deque(maxlen=KEPT)
        self._taken: dict[str, deque[float]] = defaultdict(lambda: deque(maxlen=KEPT))

    def took(self, module: str, ms: float) -> None:
        """A computation of a module has ended."""
        self._taken[module].append(ms)

    def milliseconds(self) -> dict[str, dict[str, Any]]:
        """By module, median, p99 and all of them."""
        return {
            name: {**_quantiles(ms), "all": [round(value, 3) for value in ms]}
            for name, ms in self._taken.items()
        }

    def lag(self) -> dict[str, float]:
        """How late the loop was when the robot wanted to be woken."""
        return _quantiles(self.lags)


def _quantiles(ms: deque[float]) -> dict[str, float]:
    median, p99 = np.percentile(ms or [0.0], [50, 99])
    return {"median": float(median), "p99": float(p99)}
