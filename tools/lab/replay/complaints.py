"""What robots complained of during a run, and for how long: the end alone says little of it.

At the end devices are switched off and peers are gone; what lasted is what was wrong.
"""

from __future__ import annotations

import re
from collections import defaultdict

from lab.play.simulator import Simulator

_NUMBER = re.compile(r"\d+(\.\d+)?")


class Complaints:
    """Seconds of each sentence, for each robot; sentences that differ in numbers count as one."""

    def __init__(self) -> None:
        self._seconds: dict[int, dict[str, int]] = defaultdict(lambda: defaultdict(int))
        self._latest: dict[str, str] = {}

    def note(self, simulator: Simulator) -> None:
        """Another second has passed."""
        for robot, member in simulator.members.items():
            for sentence in member.robot.health.sentences().values():
                kind = _NUMBER.sub("#", sentence)
                self._seconds[robot][kind] += 1
                self._latest[kind] = sentence

    def lasted(self) -> dict[int, list[tuple[int, str]]]:
        """By robot: seconds and sentence, the longest first."""
        return {
            robot: sorted(((s, self._latest[kind]) for kind, s in kinds.items()), reverse=True)
            for robot, kinds in sorted(self._seconds.items())
        }
