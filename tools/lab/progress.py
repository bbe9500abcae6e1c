"""One line that says how far a long run is."""

from __future__ import annotations

import sys
import time

WIDTH = 30
LOG_EVERY_S = 10.0


class Progress:
    """A bar on a terminal; now and then a line in a log."""

    def __init__(self, what: str, total: float, unit: str = "s") -> None:
        self._what, self._total, self._unit = what, total, unit
        self._terminal = sys.stderr.isatty()
        self._shown = time.monotonic() - LOG_EVERY_S

    def __call__(self, done: float) -> None:
        """Show that `done` of the total is done."""
        text = f"{self._what} {done:.0f}/{self._total:.0f} {self._unit}"
        if self._terminal:
            filled = round(WIDTH * min(done / self._total, 1.0))
            print(f"\r[{'#' * filled}{'.' * (WIDTH - filled)}] {text}", end="", file=sys.stderr)
        elif time.monotonic() - self._shown >= LOG_EVERY_S:
            self._shown = time.monotonic()
            print(text, file=sys.stderr)

    def end(self) -> None:
        """Leave the line."""
        if self._terminal:
            print(file=sys.stderr)
