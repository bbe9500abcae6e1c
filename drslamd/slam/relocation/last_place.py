"""Where a robot was when that was last known, for a start that need not begin from nothing.

The frame of the team may be another one by then, for it goes with whoever owned it; and nobody
knows how long a computer was off. So the place is kept as peers have it: in the frame of a keyframe
of theirs, and by the time on their clock. Whoever of them still is in the same start tells where
that is now and how long ago it was.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drslamd.conventions import MAX_ROBOT_ID, Chain
from drslamd.slam import se2
from drslamd.slam.graph.estimate import PoseNow, TeamEstimate
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.se2 import Array

MOST_PEERS = 4
"""One is enough, as long as it goes on."""
MOST_SIGMA_M = 5.0
"""What is vaguer is not worth being kept."""
MOST_AWAY_M = 1_000.0
"""No radio reaches so far."""
MOST_SPEED_MPS = 30.0
"""As a configuration may say of wheels."""
MOST_NUMBER = 2**62
"""Of epochs, samples and times, as in messages."""


class SeenFrom(NamedTuple):
    """Our place in the frame of keyframe n of a peer, m, its sigma, and when that was on the clock
    of that peer, us."""

    peer: Chain
    n: int
    utime: int
    x: float
    y: float
    sigma_m: float


@dataclass(frozen=True)
class LastPlace:
    """A place as some peers have it, the surest first, and how fast the robot drove."""

    speed_mps: float
    seen: tuple[SeenFrom, ...]

    def state(self) -> dict[str, Any]:
        """As it is kept in a file."""
        rows = [[*row.peer, row.n, row.utime, row.x, row.y, row.sigma_m] for row in self.seen]
        return {"speed_mps": self.speed_mps, "seen": rows}

    @staticmethod
    def of_state(state: Mapping[str, Any]) -> LastPlace | None:
        """What `state` gave, after `is_kept_place`; None where nothing was kept."""
        if not state:
            return None
        rows = [SeenFrom(Chain(*row[:2]), *row[2:]) for row in state["seen"]]
        return LastPlace(state["speed_mps"], tuple(rows))


def last_place(
    estimate: TeamEstimate, now: PoseNow, neighbours: list[PeerInRange], speed_mps: float
) -> LastPlace | None:
    """What the next start should know; None where no peer could tell it.

    Args:
        now: our pose in the frame of the solution.
    """
    variance = _largest(now.covariance)
    rows = (_seen_from(estimate, now, variance, peer) for peer in neighbours)
    seen = [row for row in rows if row is not None]
    seen.sort(key=lambda row: row.sigma_m)
    if not seen or not 0 < speed_mps <= MOST_SPEED_MPS:
        return None
    return LastPlace(speed_mps, tuple(seen[:MOST_PEERS]))


def _largest(covariance: Array) -> float:
    """Variance of a place along the way that is known worst."""
    return float(np.linalg.eigvalsh(covariance[:2, :2])[-1])


def _seen_from(
    estimate: TeamEstimate, now: PoseNow, own_variance: float, peer: PeerInRange
) -> SeenFrom | None:
    robot = peer.chain.robot
    solved, theirs = estimate.trajectories.get(robot), estimate.covariance(robot)
    if solved is None or solved.chain != peer.chain or not len(solved.n) or theirs is None:
        return None
    if robot in estimate.points or peer.ahead_us is None:
        return None
    x, y = se2.transform(se2.inverse(solved.poses[-1]), now.pose[:2]).tolist()
    variance = own_variance + _largest(theirs)
    sigma = float(np.sqrt(variance + (x * x + y * y) * float(theirs[2, 2])))
    if not sigma <= MOST_SIGMA_M or not max(abs(x), abs(y)) <= MOST_AWAY_M:
        return None
    return SeenFrom(peer.chain, int(solved.n[-1]), now.utime + peer.ahead_us, x, y, sigma)


def is_kept_place(state: object) -> bool:
    """Could `LastPlace.state` have written this, or nobody anything? Anything may be given."""
    if not isinstance(state, dict):
        return False
    if not state:
        return True
    rows = state.get("seen")
    return (
        _is_number(state.get("speed_mps"), MOST_SPEED_MPS)
        and state["speed_mps"] > 0
        and isinstance(rows, list)
        and 0 < len(rows) <= MOST_PEERS
        and all(_is_row(row) for row in rows)
    )


def _is_row(row: object) -> bool:
    if not isinstance(row, list) or len(row) != len(BOUNDS):
        return False
    whole, sigma = row[:4], row[-1]
    return (
        all(type(value) is int for value in whole)
        and all(_is_number(value, most) for value, most in zip(row, BOUNDS, strict=True))
        and row[0] >= 0
        and sigma > 0
    )


BOUNDS = (
    *(MAX_ROBOT_ID, MOST_NUMBER, MOST_NUMBER, MOST_NUMBER),
    *(MOST_AWAY_M, MOST_AWAY_M, MOST_SIGMA_M),
)
"""Of robot, epoch, keyframe, time, x, y and sigma."""


def _is_number(value: object, most: float) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= most
