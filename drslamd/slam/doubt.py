"""Is a robot where it is said to be? Who speaks against it, and what that may be.

Three witnesses: odometry that must have been worse than configured (module 3), ranges of the last
seconds that do not fit the solution (module 3), and ranges of this very second that do not fit
where both robots are said to be (`range_watch`). A robot that all its partners contradict is
doubtful, and they are not; of two robots alone nobody can tell, and both are.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from drslamd.slam.graph.estimate import TeamEstimate

MUCH_WORSE = 3.0
"""Times the configured sigma of odometry: as modelled it is below 2."""


class Reason(Enum):
    """What speaks against a robot."""

    ODOMETRY = "odometry"
    RANGES = "ranges"


@dataclass(frozen=True)
class Doubt:
    """Why the pose of a robot, or what lies between two, cannot be relied on.

    Attributes:
        robot: whose pose it is about.
        peers: whose ranges contradict it.
        level: how many times worse than configured odometry is.
    """

    robot: int
    reason: Reason
    peers: tuple[int, ...] = ()
    level: float = 1.0


def doubt_of(
    robot: int,
    estimate: TeamEstimate | None,
    watched: frozenset[int] = frozenset(),
    off: frozenset[int] = frozenset(),
) -> Doubt | None:
    """What speaks against the pose of a robot; None while nothing does.

    Args:
        watched: peers whose ranges are held against it this second; off: those that do not fit.
    """
    if estimate is None:
        return None
    level = estimate.late_level.get(robot, 1.0)
    if level >= MUCH_WORSE:
        return Doubt(robot, Reason.ODOMETRY, level=level)
    partners = {b if a == robot else a for a, b in estimate.bias_m if robot in (a, b)}
    against = {b if a == robot else a for a, b in estimate.contradicted if robot in (a, b)}
    for seen, wrong in ((partners, against), (watched, off)):
        if wrong and wrong == seen:
            return Doubt(robot, Reason.RANGES, tuple(sorted(wrong)))
    return None


def doubted_partners(
    robot: int, estimate: TeamEstimate | None, off: frozenset[int] = frozenset()
) -> frozenset[int]:
    """Robots to which this one's ranges do not fit."""
    if estimate is None:
        return frozenset()
    against = {b if a == robot else a for a, b in estimate.contradicted if robot in (a, b)}
    return frozenset(against) | off
