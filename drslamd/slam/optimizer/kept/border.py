"""What is left of a system for its border once all poses are eliminated, and how long it holds.

With T the front of a head and the tail, B the border, and K eliminated before:

    S = A_BB - A_BT A_TT^-1 A_TB

It is what all hours say of sensors, so one second more moves it little, and of a large team to make
it and to take it apart takes longer than all else (1,300 unknowns of fifty robots). So it is kept
for some seconds: a step then goes a little too far, and whoever claims something by it claims a
little less than he may.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.conventions import GRID_HZ
from drslamd.slam.optimizer.kept.head import KEY, Pair
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array, Index

FEW = 200
"""Unknowns of a border that is made anew each time, as that takes no time."""
SECONDS, GROWN = 8, 1.05
"""So long a border is kept, and while there are not so many times the links that there were ..."""
SHARE = 0.01
"""... and, where something is claimed by it, while nobody has driven on for more of his time:
sigmas are then 1 to 2.5 % too large (4 s of fifty robots after 10 min 0.9 %, 1 s of three after
70 s 3.6 %)."""


@dataclass(frozen=True)
class Border:
    """S of some second.

    Attributes:
        lower: (b, b) Cholesky's factor of it.
        pairs: whose biases are in it; links: of odometry, so many.
        newest: (robots,) keyframe of each.
    """

    lower: Array
    pairs: tuple[Pair, ...]
    links: int
    newest: Index

    @staticmethod
    def of(problem: Problem, pairs: tuple[Pair, ...], lower: Array) -> Border:
        _, newest = _times(problem)
        return Border(np.ascontiguousarray(lower), pairs, len(problem.odometry), newest)

    def holds(self, problem: Problem, pairs: tuple[Pair, ...], is_claimed: bool) -> bool:
        """Is it still that of a problem and its pairs, more or less?

        Args:
            is_claimed: is something claimed by it?
        """
        if len(self.lower) <= FEW or pairs != self.pairs:
            return False
        oldest, newest = _times(problem)
        if len(newest) != len(self.newest) or len(problem.odometry) > GROWN * self.links:
            return False
        since = newest - self.newest
        is_short = since <= SHARE * (newest - oldest) if is_claimed else True
        return bool(((since <= SECONDS * GRID_HZ) & is_short).all())


def _times(problem: Problem) -> tuple[Index, Index]:
    """(robots,) the first and the last keyframe of each."""
    ids, number = np.unique(problem.robot_id, return_inverse=True)
    first, last = np.full(len(ids), KEY), np.full(len(ids), -1)
    np.minimum.at(first, number, problem.n)
    np.maximum.at(last, number, problem.n)
    return first, last
