"""A robot that says more than any should is heard as much as the others, and no more."""

from __future__ import annotations

from drslamd.conventions import MAX_ROBOT_ID
from drslamd.gossip.membership.shares import Shares

BUDGET = 50_000
"""Bytes a second, as a robot lets out by default."""
BUDGETS = 2
"""That are heard of one robot: a team is configured alike, or nearly so."""
LEAST_COST = 250
"""Bytes that the smallest message counts for: it takes as long to judge as a longer one."""
AT_ONCE_S = 4
"""Seconds of its share that may come at once, after a stall of ours."""


class Flood:
    """What is heard of each robot."""

    def __init__(self, budget: int) -> None:
        """
        Args:
            budget: bytes a second that our own says, and the others' should say.
        """
        share = BUDGETS * budget
        self._shares: Shares[int] = Shares(share, AT_ONCE_S * share, MAX_ROBOT_ID + 1)

    def leaves_room(self, robot: int, size: int, utime: int) -> bool:
        """May this message of so many bytes be heard?"""
        return self._shares.takes(robot, max(size, LEAST_COST), utime)

    def sentence(self, utime: int) -> str | None:
        """Who is too loud, and what to do."""
        loud = sorted(robot for robot in self._shares.over(utime) if robot is not None)
        if not loud:
            return None
        return (
            f"robot {' and '.join(map(str, loud))} says more than twice what "
            "gossip.max_bytes_per_s lets out: what is beyond that is not heard; is its program "
            "damaged, or somebody else's?"
        )
