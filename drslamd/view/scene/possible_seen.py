"""What one robot says of where others may be, for as long as it holds."""

from __future__ import annotations

from collections import deque

import numpy as np

from drslamd.conventions import SECOND_US
from drslamd.gossip.message_types import Hypotheses
from drslamd.slam.se2 import Array

HELD_S = 3.0
"""They are said once a second; what was not said again is settled, or void."""
LATE = 4
"""Messages among which one is looked for whose time the path covers."""


class PossibleSeen:
    """What one robot says of others."""

    def __init__(self) -> None:
        self._said: deque[tuple[float, Hypotheses]] = deque(maxlen=LATE)

    def add(self, message: Hypotheses, t: float) -> None:
        self._said.append((t, message))

    def latest(self, t: float) -> Hypotheses | None:
        """What holds at t, s."""
        return self._said[-1][1] if self._said and t - self._said[-1][0] < HELD_S else None

    def frames(self) -> list[tuple[float, Array]]:
        """Times on that robot's clock, s, and its odometry poses (3,) then, the latest first."""
        said = [message for _, message in reversed(self._said)]
        return [(m.odom_utime / SECOND_US, np.array(m.odom)) for m in said]
