"""Do later solutions move what was claimed before by more than was claimed?

Where the model holds, a later solution of the same keyframe lies as far from the earlier one as the
earlier covariance says, or nearer. Where it does not (wheels that stuck, a mirrored solution),
solutions jump, often long before anything is an outlier of the newest one: each of them is bent
until the ranges fit. What was moved too far was claimed too boldly, and so may be what is claimed
now: our own pose, and those of all pairs of robots in each other.
"""

from __future__ import annotations

from collections import deque
from itertools import combinations
from typing import NamedTuple

import numpy as np

from drslamd.conventions import GRID_HZ, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import MUCH_WORSE, TeamEstimate
from drslamd.slam.odometry.track import RESOLUTION
from drslamd.slam.se2 import Array

REMEMBERED = 20 * GRID_HZ
"""Samples of the grid: how long a revision counts."""
ALLOWED = 5.0
"""Squared move per degree of freedom; an honest claim is moved further once in 700 times."""
ALLOWED_OF_PAIRS = 2.5
"""Likewise of one robot in another, which does not hang on how the frame is turned: as modelled it
is moved by 1 at most, and by 2 where sensors are as wrong as configured."""
MOST_CLAIMS = 32
"""That are remembered; there is one a second."""
MOST_ROBOTS = 12
"""Whose pairs are watched: a larger team is looked at from more sides, and pairs are many."""

NEWEST = 4 * MOST_CLAIMS
"""Keyframes among which they are looked for; there are up to four a second."""

Whose = tuple[int, ...]
"""One robot, by its pose in w; or two, a < b, by a_T_b."""


class _Claim(NamedTuple):
    """What a solution said of the last keyframes n of some robots: poses with covariances."""

    frame: Segment
    n: dict[int, float]
    said: dict[Whose, tuple[Array, Array]]


class _Model(NamedTuple):
    """What a solution took for true beside what is configured.

    Attributes:
        mountings: that are not as configured, of which kind and of whom.
        level: of the worst odometry that is feared and not in doubt.
    """

    mountings: frozenset[tuple[str, int]] = frozenset()
    level: float = 1.0

    @staticmethod
    def of(estimate: TeamEstimate) -> _Model:
        tracks = {("track", robot) for robot in estimate.turn}
        mountings = frozenset(tracks | {("antenna", robot) for robot in estimate.antenna_m})
        levels = estimate.odometry_level.items()
        feared = [level for robot, level in levels if not estimate.is_slipping(robot)]
        return _Model(mountings, max(feared, default=1.0))

    def is_new(self, before: _Model) -> bool:
        """Does it explain what the one before could not?"""
        is_wider = self.level >= MUCH_WORSE > before.level
        return is_wider or bool(self.mountings - before.mountings)


class Revisions:
    """Of one robot's own pose, and of all pairs."""

    def __init__(self) -> None:
        self._claims: deque[tuple[float, _Claim]] = deque(maxlen=MOST_CLAIMS)
        self._moves: deque[tuple[float, dict[Whose, float]]] = deque(maxlen=MOST_CLAIMS)
        self._own = -1
        self._model = _Model()

    @property
    def boldness(self) -> float:
        """By how much variances of our own pose that were claimed of late were too small; 1 where
        they were not."""
        return self._boldness((self._own,))

    @property
    def of_pairs(self) -> dict[tuple[int, int], float]:
        """Likewise of pairs a < b, where it is above 1."""
        pairs = {whose for _, moves in self._moves for whose in moves if len(whose) == 2}
        found = {(pair[0], pair[1]): self._boldness(pair) for pair in pairs}
        return {pair: bold for pair, bold in found.items() if bold > 1.0}

    def _boldness(self, whose: Whose) -> float:
        most = max((moves.get(whose, 0.0) for _, moves in self._moves), default=0.0)
        return max(1.0, most / (ALLOWED if len(whose) == 1 else ALLOWED_OF_PAIRS))

    def on_solution(self, estimate: TeamEstimate, robot: int) -> None:
        """Module 3 has answered.

        Args:
            estimate: with the covariances that it claims by itself.
            robot: whose revisions these are.
        """
        solved = estimate.trajectories.get(robot)
        if solved is None or not len(solved.n) or estimate.covariance(robot) is None:
            return
        self._own, now = robot, float(solved.n[-1])
        model = _Model.of(estimate)
        if model.is_new(self._model) and estimate.is_explained:
            # what was claimed under another one says nothing against this
            self._claims.clear()
            self._moves.clear()
        self._model = model
        for remembered in (self._claims, self._moves):
            while remembered and remembered[0][0] < now - REMEMBERED:
                remembered.popleft()
        places = {
            name: dict(zip(path.n[-NEWEST:].tolist(), path.poses[-NEWEST:], strict=True))
            for name, path in estimate.trajectories.items()
        }
        moves: dict[Whose, float] = {}
        for _, claim in self._claims:
            for whose, move in _moved(claim, estimate.frame, places):
                moves[whose] = max(move, moves.get(whose, 0.0))
        self._moves.append((now, moves))
        self._claims.append((now, _claim(estimate, robot)))


def _claim(estimate: TeamEstimate, own: int) -> _Claim:
    solved = {name: path for name, path in estimate.trajectories.items() if len(path.n)}
    covariance = estimate.covariance(own)
    assert covariance is not None
    said: dict[Whose, tuple[Array, Array]] = {
        (own,): (solved[own].poses[-1].copy(), covariance.copy())
    }
    for a, b in combinations(sorted(solved)[:MOST_ROBOTS], 2):
        found = estimate.relative(a, b)
        if found is not None:
            said[a, b] = found
    return _Claim(estimate.frame, {r: float(path.n[-1]) for r, path in solved.items()}, said)


def _moved(
    claim: _Claim, frame: Segment, places: dict[int, dict[float, Array]]
) -> list[tuple[Whose, float]]:
    """How far each pose of a claim has been moved, see `squared_move`."""
    out = []
    for whose, (pose, covariance) in claim.said.items():
        found = [places.get(robot, {}).get(claim.n[robot]) for robot in whose]
        if len(whose) == 1:
            later = found[0] if claim.frame == frame else None
        else:
            a, b = found
            later = None if a is None or b is None else se2.between(a, b)
        if later is not None:
            out.append((whose, squared_move(pose, covariance, later)))
    return out


def squared_move(claimed: Array, covariance: Array, later: Array) -> float:
    """Squared distance of two poses (3,) in units of a covariance (3, 3), per degree of freedom."""
    apart = later - claimed
    apart[2] = se2.wrap(apart[2])
    # who stands where the frame begins is certain, but no pose is finer than a step of odometry
    known = covariance + RESOLUTION**2 * np.eye(3)
    return float(apart @ np.linalg.solve(known, apart)) / 3
