"""What a check found: a cause, a remedy, and how much it matters."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Severity(Enum):
    """Does the daemon refuse to run, or does it run and wait, or go without?"""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True)
class Finding:
    """
    Attributes:
        check: which one found it.
        since_s: for how long it has been so, where that is known.
    """

    check: str
    severity: Severity
    cause: str
    remedy: str = ""
    since_s: int | None = None

    @property
    def sentence(self) -> str:
        return f"{self.cause}; {self.remedy}" if self.remedy else self.cause
