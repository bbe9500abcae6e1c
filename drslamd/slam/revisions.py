"""Do later solutions move what was claimed before by more than was claimed?

Where the model holds, a later solution of the same keyframe lies as far from the earlier one as the
earlier covariance says, or nearer. Where it does not (wheels that stuck, a mirrored solution),
solutions jump, often long before anything is an outlier of the newest one: each of them is bent
until the ranges fit. What was moved too far was claimed too boldly, and so may be what is claimed
now.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from drslamd.conventions import GRID_HZ, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.odometry.track import RESOLUTION
from drslamd.slam.se2 import Array

REMEMBERED = 20 * GRID_HZ
"""Samples of the grid: how long a revision counts."""
ALLOWED = 5.0
"""Squared move per degree of freedom; an honest claim is moved further once in 700 times."""
MOST_CLAIMS = 32
"""That are remembered; there is one a second."""

NEWEST = 4 * MOST_CLAIMS
"""Keyframes among which they are looked for; there are up to four a second."""


class _Claim(NamedTuple):
    n: float
    frame: Segment
    pose: Array
    covariance: Array


class Revisions:
    """Of one robot's own pose."""

    def __init__(self) -> None:
        self._claims: deque[_Claim] = deque(maxlen=MOST_CLAIMS)
        self._moves: deque[tuple[float, float]] = deque(maxlen=MOST_CLAIMS)

    @property
    def boldness(self) -> float:
        """By how much variances that were claimed of late were too small; 1 where they were not."""
        return max(1.0, max((move for _, move in self._moves), default=0.0) / ALLOWED)

    def on_solution(self, estimate: TeamEstimate, robot: int) -> None:
        """Module 3 has answered."""
        solved, covariance = estimate.trajectories.get(robot), estimate.covariance(robot)
        if solved is None or covariance is None or not len(solved.n):
            return
        now = float(solved.n[-1])
        while self._claims and self._claims[0].n < now - REMEMBERED:
            self._claims.popleft()
        while self._moves and self._moves[0][0] < now - REMEMBERED:
            self._moves.popleft()
        newest = slice(-NEWEST, None)
        places = {float(n): k for k, n in enumerate(solved.n[newest])}
        poses = solved.poses[newest]
        moves = [
            squared_move(claim.pose, claim.covariance, poses[places[claim.n]])
            for claim in self._claims
            if claim.frame == estimate.frame and claim.n in places
        ]
        self._moves.append((now, max(moves, default=0.0)))
        self._claims.append(_Claim(now, estimate.frame, solved.poses[-1].copy(), covariance))


def squared_move(claimed: Array, covariance: Array, later: Array) -> float:
    """Squared distance of two poses (3,) in units of a covariance (3, 3), per degree of freedom."""
    apart = later - claimed
    apart[2] = se2.wrap(apart[2])
    # who stands where the frame begins is certain, but no pose is finer than a step of odometry
    known = covariance + RESOLUTION**2 * np.eye(3)
    return float(apart @ np.linalg.solve(known, apart)) / 3
