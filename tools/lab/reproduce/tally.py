"""Many errors as a few sums, so that seeds can be done one by one and put together later."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lab.recordings.recording import Array

Sums = list[float]
"""Count, sum, sum of squares, largest."""


@dataclass(frozen=True)
class Spread:
    """Of values: how many, mean, standard deviation, largest."""

    n: int
    mean: float
    std: float
    most: float

    def __str__(self) -> str:
        return f"{self.mean:.2f} ± {self.std:.2f}" if self.n else "-"


class Tally:
    """Values under names like ``table2/paper/50/0.5/after/m``."""

    def __init__(self, sums: Mapping[str, Sums] | None = None) -> None:
        self.sums: dict[str, Sums] = {name: list(s) for name, s in (sums or {}).items()}

    def add(self, name: str, values: Array | Iterable[float] | float) -> None:
        v = np.atleast_1d(np.asarray(values, dtype=float))
        if len(v):
            self._join(name, [float(len(v)), float(v.sum()), float(v @ v), float(v.max())])

    def poses(self, name: str, errors: tuple[Array, Array]) -> None:
        """Metres under name/m, degrees under name/deg."""
        self.add(f"{name}/m", errors[0])
        self.add(f"{name}/deg", errors[1])

    def merge(self, other: Mapping[str, Sums]) -> None:
        for name, sums in other.items():
            self._join(name, sums)

    def _join(self, name: str, more: Sums) -> None:
        n, total, squares, most = self.sums.get(name, [0.0, 0.0, 0.0, -np.inf])
        self.sums[name] = [n + more[0], total + more[1], squares + more[2], max(most, more[3])]

    def __contains__(self, name: str) -> bool:
        return name in self.sums

    def __getitem__(self, name: str) -> Spread:
        n, total, squares, most = self.sums.get(name, [0.0, 0.0, 0.0, float("nan")])
        if not n:
            return Spread(0, float("nan"), float("nan"), float("nan"))
        mean = total / n
        return Spread(int(n), mean, float(np.sqrt(max(squares / n - mean * mean, 0.0))), most)

    def as_dict(self) -> dict[str, dict[str, Any]]:
        """For JSON: n, mean, std and largest of every name."""
        return {
            name: {"n": s.n, "mean": s.mean, "std": s.std, "max": s.most}
            for name, s in ((name, self[name]) for name in sorted(self.sums))
        }
