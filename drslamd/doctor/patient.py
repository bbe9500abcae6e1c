"""What the checks of a running daemon look at: its configuration and two of its answers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from drslamd.config import Config
from drslamd.machine.finding import Finding, Severity


@dataclass(frozen=True)
class Patient:
    """
    Attributes:
        before, now: answers to ``status``.
        seconds: between them.
    """

    config: Config
    before: dict[str, Any]
    now: dict[str, Any]
    seconds: float

    def rate(self, *path: str) -> float:
        """By how much a counter grew, 1/s; one that is not there yet is 0."""
        grown = number(self.now, path) - number(self.before, path)
        return grown / self.seconds if self.seconds > 0 else 0.0

    def condition(self, key: str) -> dict[str, Any] | None:
        """What the daemon itself says under that key, with since when."""
        return next((c for c in self.now["conditions"] if c["key"] == key), None)

    def told(
        self, check: str, *keys: str, severity: Severity = Severity.WARNING
    ) -> Iterator[Finding]:
        """What the daemon itself says, as findings of a check."""
        for key in keys:
            said = self.condition(key)
            if said is not None:
                cause, _, remedy = said["what"].partition("; ")
                yield Finding(check, severity, cause, remedy, since_s=said["since_s"])


def number(answer: dict[str, Any], path: tuple[str, ...]) -> float:
    """A number deep in an answer; 0 where there is none."""
    value: Any = answer
    for key in path:
        value = value.get(key) if isinstance(value, dict) else None
    return float(value) if isinstance(value, (int, float)) else 0.0


def warning(check: str, cause: str, remedy: str) -> Finding:
    """Something that costs accuracy or time."""
    return Finding(check, Severity.WARNING, cause, remedy)
