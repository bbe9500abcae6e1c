"""So much a second for each, and no more: whoever floods is not served at the cost of the others.

A share is a bucket that fills steadily. Who takes more is turned away, counted and named. Whom it
concerns is chosen by strangers where it is an address, so there is an end to how many are told
apart: the others share one share.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Generic, TypeVar

from drslamd.conventions import SECOND_US

OF_LATE_US = 10 * SECOND_US
"""How long after somebody was turned away it is still spoken of."""

Who = TypeVar("Who", bound=Hashable)


@dataclass
class _Share:
    """Of one.

    Attributes:
        level: what it may take now.
        utime: when it took last.
        turned_away: how often, since that began.
        since, latest: when it was turned away for the first and the last time of late.
    """

    level: float
    utime: int
    turned_away: int = 0
    since: int = 0
    latest: int = -OF_LATE_US


class Shares(Generic[Who]):
    """Of all.

    Attributes:
        turned_away: how often anybody was, since the start.
    """

    def __init__(self, per_s: float, at_once: float, most: int) -> None:
        """
        Args:
            per_s: what each may take in a second; at_once: after a pause.
            most: so many are told apart.
        """
        self._per_s, self._at_once, self._most = per_s, at_once, most
        self._shares: dict[Who, _Share] = {}
        self._rest = _Share(at_once, 0)
        self.turned_away = 0

    def __len__(self) -> int:
        return len(self._shares)

    def takes(self, who: Who, cost: float, utime: int) -> bool:
        """May it take so much now? Then it has."""
        share = self._share(who, utime)
        passed = max(0, utime - share.utime) / SECOND_US
        share.level = min(self._at_once, share.level + self._per_s * passed)
        share.utime = max(utime, share.utime)
        if share.level < cost:
            self._turn_away(share, utime)
            return False
        share.level -= cost
        return True

    def _share(self, who: Who, utime: int) -> _Share:
        share = self._shares.get(who)
        if share is None:
            if len(self._shares) >= self._most and not self._forget_one(utime):
                return self._rest
            share = self._shares[who] = _Share(self._at_once, utime)
        return share

    def _forget_one(self, utime: int) -> bool:
        """Make room: who took nothing for long has a whole share in any case."""
        who, share = min(self._shares.items(), key=lambda item: item[1].utime)
        if utime - share.utime < OF_LATE_US:
            return False
        del self._shares[who]
        return True

    def _turn_away(self, share: _Share, utime: int) -> None:
        self.turned_away += 1
        if utime - share.latest >= OF_LATE_US:
            share.turned_away, share.since = 0, utime
        share.turned_away += 1
        share.latest = max(utime, share.latest)

    def over(self, utime: int) -> dict[Who | None, float]:
        """Who was turned away of late, and how often a second; None for those not told apart."""
        found: list[tuple[Who | None, _Share]] = [*self._shares.items(), (None, self._rest)]
        return {
            who: s.turned_away / max(1.0, (s.latest - s.since) / SECOND_US)
            for who, s in found
            if utime - s.latest < OF_LATE_US
        }
