"""Is a robot where it is said to be? Who speaks against it, and what that may be.

Witnesses: odometry that must have been worse than configured, or longer than anybody mounts it
(module 3); ranges of the last seconds that do not fit the solution (module 3); ranges of this very
second that do not fit where both robots are said to be (`range_watch`); windows of which most do
not fit whatever is known of the mountings (module 1); windows that another track or scale would
fit better, while one window alone has confirmed the pair (module 1); solutions that move what
earlier ones claimed (`revisions`). A robot that all its partners contradict is doubtful, and they
are not; of two robots alone nobody can tell, and both are.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from drslamd.slam.graph.estimate import TeamEstimate

ODD_SCALE = 0.5
"""Of the way, where turns are as configured: who miscounts both wheels miscounts turns as well. As
modelled it is below 0.3; where it is more, something else was bent until it fitted."""

BOLD = 2.0
"""Times the variance that was claimed of late, that solutions moved on."""


class Reason(Enum):
    """What speaks against a robot."""

    ODOMETRY = "odometry"
    SCALE = "scale"
    REVISIONS = "revisions"
    RANGES = "ranges"
    WINDOWS = "windows"
    MOUNTINGS = "mountings"


class Partners(NamedTuple):
    """Robots that a witness holds against one, and those of them that contradict it."""

    seen: frozenset[int] = frozenset()
    wrong: frozenset[int] = frozenset()

    @property
    def all_contradict(self) -> bool:
        return bool(self.wrong) and self.wrong == self.seen


NOBODY = Partners()


@dataclass(frozen=True)
class Doubt:
    """Why the pose of a robot, or what lies between two, cannot be relied on.

    Attributes:
        robot: whose pose it is about.
        peers: whose ranges or windows contradict it.
        level: how many times worse than configured odometry is, or how many times as long.
    """

    robot: int
    reason: Reason
    peers: tuple[int, ...] = ()
    level: float = 1.0


def doubt_of(
    robot: int,
    estimate: TeamEstimate | None,
    watch: Partners = NOBODY,
    windows: Partners = NOBODY,
    mountings: Partners = NOBODY,
    boldness: float = 1.0,
) -> Doubt | None:
    """What speaks against the pose of a robot; None while nothing does.

    Args:
        watch: peers by their ranges of this second; windows: by those of our pairs; mountings: by
            what these would rather have.
        boldness: see `Revisions`.
    """
    if estimate is None:
        return None
    if estimate.is_slipping(robot):
        return Doubt(robot, Reason.ODOMETRY, level=estimate.late_level[robot])
    if _is_odd(robot, estimate):
        return Doubt(robot, Reason.SCALE, level=1 - estimate.correction(robot).scale)
    partners = {b if a == robot else a for a, b in estimate.bias_m if robot in (a, b)}
    against = {b if a == robot else a for a, b in estimate.contradicted if robot in (a, b)}
    against |= {partner for partner in partners if _is_odd(partner, estimate)}
    solved = Partners(frozenset(partners), frozenset(against))
    witnesses = (
        (Reason.RANGES, solved),
        (Reason.RANGES, watch),
        (Reason.WINDOWS, windows),
        (Reason.MOUNTINGS, mountings),
    )
    for reason, found in witnesses:
        if found.all_contradict:
            return Doubt(robot, reason, tuple(sorted(found.wrong)))
    moved = frozenset(other for other in partners if estimate.bold(robot, other) >= BOLD)
    is_moved = boldness >= BOLD or Partners(frozenset(partners), moved).all_contradict
    return Doubt(robot, Reason.REVISIONS) if is_moved else None


def _is_odd(robot: int, estimate: TeamEstimate) -> bool:
    scale = estimate.correction(robot).scale
    return abs(scale) >= ODD_SCALE and robot not in estimate.turn


def doubted_partners(
    robot: int, estimate: TeamEstimate | None, off: frozenset[int] = frozenset()
) -> frozenset[int]:
    """Robots to which this one's ranges do not fit."""
    if estimate is None:
        return frozenset()
    against = {b if a == robot else a for a, b in estimate.contradicted if robot in (a, b)}
    return frozenset(against) | off
