"""Who speaks in the group, and whether somebody who did is missed."""

from __future__ import annotations

SILENT_S = 5.0
"""A robot says something every second."""
GONE_S = 60.0
"""Whoever is silent for so long was switched off."""
MOST = 256
"""Addresses that are remembered: of a team, and of whoever else comes first."""


class Callers:
    """Addresses, and when each was heard last, s."""

    def __init__(self) -> None:
        self._heard: dict[str, float] = {}

    def __len__(self) -> int:
        return len(self._heard)

    def hear(self, address: str, now: float) -> None:
        if address in self._heard or len(self._heard) < MOST:
            self._heard[address] = now

    def is_anybody_missed(self, now: float) -> bool:
        """Is nobody heard, or no longer somebody who was?"""
        self._heard = {a: then for a, then in self._heard.items() if now - then < GONE_S}
        silent = [now - then >= SILENT_S for then in self._heard.values()]
        return any(silent) or not silent
