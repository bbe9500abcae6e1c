"""How long to wait before trying again."""

from __future__ import annotations

import asyncio

FIRST_S = 0.2
LONGEST_S = 5.0


class Backoff:
    """0.2 s, doubling up to 5 s: quick after a loose plug, cheap for a device that is not there."""

    def __init__(self) -> None:
        self._next = FIRST_S

    def reset(self) -> None:
        self._next = FIRST_S

    async def wait(self) -> None:
        await asyncio.sleep(self._next)
        self._next = min(2 * self._next, LONGEST_S)
