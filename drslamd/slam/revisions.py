"""Do later solutions move what was claimed before by more than was claimed?

Where the model holds, a later solution of the same keyframe lies as far from the earlier one as the
earlier covariance says, or nearer. Where it does not (wheels that stuck, a mirrored solution),
solutions jump, often long before anything is an outlier of the newest one: each of them is bent
until the ranges fit. What was moved too far was claimed too boldly, and so may be what is claimed
now: our own pose, and those of all pairs of robots in each other.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
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

ORIGIN = np.zeros(3)
Whose = tuple[int, ...]
"""One robot, by its pose in w; or two, a < b, by a_T_b."""


class _Claim(NamedTuple):
    """What a solution said of the last keyframes n of some robots: poses (k, 3) with covariances
    (k, 3, 3), of one robot and after it of pairs."""

    frame: Segment
    n: dict[int, float]
    whose: list[Whose]
    poses: Array
    covariances: Array


class _Model(NamedTuple):
    """What a solution took for true beside what is configured.

    Attributes:
        mountings: that are not as configured, of which kind and of whom.
        is_worse: is odometry feared to be much worse, of somebody who is not in doubt for that?
    """

    mountings: frozenset[tuple[str, int]] = frozenset()
    is_worse: bool = False

    @staticmethod
    def of(estimate: TeamEstimate) -> _Model:
        tracks = {("track", robot) for robot in estimate.turn}
        mountings = frozenset(tracks | {("antenna", robot) for robot in estimate.antenna_m})
        levels = estimate.odometry_level.items()
        feared = [level for robot, level in levels if not estimate.is_slipping(robot)]
        return _Model(mountings, max(feared, default=1.0) >= MUCH_WORSE)

    def is_new(self, before: _Model) -> bool:
        """Does it explain what the one before could not?"""
        is_wider = self.is_worse and not before.is_worse
        return is_wider or bool(self.mountings - before.mountings)


class _Moves(NamedTuple):
    """How far claims that were made under a model have been moved at most."""

    model: _Model
    sizes: dict[Whose, float]


class Revisions:
    """Of one robot's own pose, and of all pairs."""

    def __init__(self) -> None:
        self._claims: deque[tuple[float, _Model, _Claim]] = deque(maxlen=MOST_CLAIMS)
        self._moves: deque[tuple[float, list[_Moves]]] = deque(maxlen=MOST_CLAIMS)
        self._own = -1
        self._model = _Model()
        """Of the last solution that explains what was measured."""

    @property
    def boldness(self) -> float:
        """By how much variances of our own pose that were claimed of late were too small; 1 where
        they were not."""
        return self._boldness((self._own,))

    @property
    def of_pairs(self) -> dict[tuple[int, int], float]:
        """Likewise of pairs a < b, where it is above 1."""
        pairs = {whose for moves in self._counting() for whose in moves if len(whose) == 2}
        found = {(pair[0], pair[1]): self._boldness(pair) for pair in pairs}
        return {pair: bold for pair, bold in found.items() if bold > 1.0}

    def no_narrower(self, narrower: dict[Whose, float]) -> dict[Whose, float]:
        """By how much variances may be smaller, and were not moved by more, of those by which they
        would like to be."""
        held = {whose: max(share, self._moved(whose)) for whose, share in narrower.items()}
        return {whose: share for whose, share in held.items() if share < 1.0}

    def _boldness(self, whose: Whose) -> float:
        return max(1.0, self._moved(whose))

    def _moved(self, whose: Whose) -> float:
        """The farthest move of late, over what is allowed."""
        most = max((moves.get(whose, 0.0) for moves in self._counting()), default=0.0)
        return most / (ALLOWED if len(whose) == 1 else ALLOWED_OF_PAIRS)

    def _counting(self) -> Iterator[dict[Whose, float]]:
        """What was claimed under a model that could not explain what this one does says nothing
        against this one: not before it is given up again."""
        for _, kinds in self._moves:
            yield from (moves.sizes for moves in kinds if not self._model.is_new(moves.model))

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
        if estimate.is_explained:
            self._model = model
        for remembered in (self._claims, self._moves):
            while remembered and remembered[0][0] < now - REMEMBERED:
                remembered.popleft()
        by_model: dict[_Model, list[_Claim]] = {}
        for _, claimed_under, claim in self._claims:
            by_model.setdefault(claimed_under, []).append(claim)
        self._moves.append((now, [_Moves(k, _moved(c, estimate)) for k, c in by_model.items()]))
        self._claims.append((now, model, _claim(estimate, robot)))


def _claim(estimate: TeamEstimate, own: int) -> _Claim:
    solved = {name: path for name, path in estimate.trajectories.items() if len(path.n)}
    covariance = estimate.covariance(own)
    assert covariance is not None
    pairs, poses, covariances = estimate.relatives(
        list(combinations(sorted(solved)[:MOST_ROBOTS], 2))
    )
    return _Claim(
        estimate.frame,
        {robot: float(path.n[-1]) for robot, path in solved.items()},
        [(own,), *pairs],
        np.concatenate([solved[own].poses[-1:], poses]),
        np.concatenate([covariance[None], covariances]),
    )


def _moved(claims: list[_Claim], estimate: TeamEstimate) -> dict[Whose, float]:
    """How far the poses of some claims have been moved at most, see `squared_moves`."""
    places = {
        robot: dict(zip(path.n[-NEWEST:].tolist(), path.poses[-NEWEST:], strict=True))
        for robot, path in estimate.trajectories.items()
    }
    whose: list[Whose] = []
    before, after, claimed, covariances = [], [], [], []
    for claim in claims:
        found = {robot: places.get(robot, {}).get(n) for robot, n in claim.n.items()}
        for k, name in enumerate(claim.whose):
            # who is claimed alone is seen from where the frame begins
            is_alone = len(name) == 1
            one, other = (ORIGIN if is_alone else found[name[0]]), found[name[-1]]
            if one is None or other is None or (is_alone and claim.frame != estimate.frame):
                continue
            whose.append(name)
            before.append(one)
            after.append(other)
            claimed.append(claim.poses[k])
            covariances.append(claim.covariances[k])
    moves: dict[Whose, float] = {}
    if whose:
        later = se2.between(np.array(before), np.array(after))
        sizes = squared_moves(np.array(claimed), np.array(covariances), later)
        for name, size in zip(whose, sizes.tolist(), strict=True):
            moves[name] = max(size, moves.get(name, 0.0))
    return moves


def squared_moves(claimed: Array, covariances: Array, later: Array) -> Array:
    """(k,) squared distances of poses (k, 3) to others in units of covariances (k, 3, 3), per
    degree of freedom."""
    apart = later - claimed
    apart[:, 2] = se2.wrap(apart[:, 2])
    # who stands where the frame begins is certain, but no pose is finer than a step of odometry
    known = covariances + RESOLUTION**2 * np.eye(3)
    return np.asarray((apart * np.linalg.solve(known, apart[..., None])[..., 0]).sum(axis=1) / 3)
