"""What became of everything that was received: nothing is dropped without a name.

A tally counts frames, lines or entries. Each one is either accepted, ignored (in order, but not
for us) or refused for exactly one reason, so ``received`` is the sum of the three.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from enum import Enum
from typing import Generic, TypeVar

Reason = TypeVar("Reason", bound=Enum)


@dataclass
class Tally(Generic[Reason]):
    """Counts since the start; `refused` has at most as many keys as the enum has members."""

    accepted: int = 0
    ignored: int = 0
    refused: Counter[Reason] = field(default_factory=Counter)

    @property
    def received(self) -> int:
        return self.accepted + self.ignored + sum(self.refused.values())

    def refuse(self, reason: Reason, count: int = 1) -> None:
        self.refused[reason] += count

    def set_refused(self, reason: Reason, total: int) -> None:
        """Take over a number that is counted elsewhere."""
        if total:
            self.refused[reason] = total

    def counters(self, prefix: str) -> dict[str, int]:
        """Flat names for a status line: ``prefix.accepted``, ``prefix.refused.WRONG_ID``, ..."""
        counts = {f"{prefix}.accepted": self.accepted, f"{prefix}.ignored": self.ignored}
        for reason, count in self.refused.items():
            counts[f"{prefix}.refused.{reason.name}"] = count
        return counts
