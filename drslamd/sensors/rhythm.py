"""How often a base says how it moved, and from when on its silence is one.

Ten motions that do not come are no accident (`PERIODS`). A base whose bytes come in bursts, through
a radio or a busy computer, is given twice its longest pause of late.
"""

from __future__ import annotations

from typing import Final

from drslamd.conventions import SECOND_US

PERIODS: Final = 10
LEAST_US: Final = SECOND_US // 2
MOST_US: Final = SECOND_US
"""A pose of so long ago is not that of now, however slow the base is."""
_SLOWLY: Final = 1 / 16
"""Weight of the newest period in their mean."""
_FADES: Final = 1 - 1 / 256
"""With each arrival of a pause that was long."""


class Rhythm:
    """Of one base.

    Attributes:
        valid_us: how long its last motion is that of now.
    """

    def __init__(self) -> None:
        self._last: int | None = None
        self._period_us = MOST_US / PERIODS
        self._pause_us = 0.0
        self.valid_us = MOST_US

    def add(self, count: int, utime: int) -> None:
        """So many motions, at least one, arrived at `utime` (us)."""
        last, self._last = self._last, utime
        if last is None:
            return
        passed_us = min(max(utime - last, 0), MOST_US)
        self._period_us += (passed_us / count - self._period_us) * _SLOWLY
        self._pause_us = max(passed_us, self._pause_us * _FADES)
        needed = max(PERIODS * self._period_us, 2 * self._pause_us)
        self.valid_us = round(min(max(needed, LEAST_US), MOST_US))
