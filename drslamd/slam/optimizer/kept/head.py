"""Which poses of a team are kept as they were solved, and where they are in the next problem.

A pose is known again by its robot and keyframe, a bias by its pair, so that the same head serves
problems that number them otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.banded.layout import NOWHERE, BandLayout
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.se2 import Index

Pair = tuple[int, int]
Flags = NDArray[np.bool_]

TAIL = 3
"""Newest poses of a team, over its robots, that are taken up anew each time: what was said of them
may not be all yet."""
LONG_TAIL = 5
"""So many, and those beyond `TAIL` become part of the head."""
KEY = 2**42
"""Above all numbers of keyframes."""


@dataclass(frozen=True)
class Head:
    """Whose unknowns were eliminated, or wait to be.

    Attributes:
        keys: (h,) of its poses, in the order in which they are numbered inside.
        front: (f,) places in `keys` of those that are not eliminated.
        far: (d,) keys of poses that reach far and are in the border, in front of the constants.
        pairs: whose biases are in the border; the first `paired` stand before the other constants.
        doubted: mountings in the border.
    """

    keys: Index
    front: Index
    far: Index
    pairs: tuple[Pair, ...]
    paired: int
    doubted: Doubted

    def is_mounted_as(self, problem: Problem) -> bool:
        """Are the same mountings unknowns?"""
        mine, now = self.doubted, problem.doubted
        return np.array_equal(mine.track, now.track) and np.array_equal(mine.antenna, now.antenna)

    def places(self, problem: Problem, pairs: list[Pair]) -> Places | None:
        """Where its unknowns are in a problem; None where it has not all of them, or others."""
        if not (self.is_mounted_as(problem) and set(self.pairs) <= set(pairs)):
            return None
        keys = keys_of(problem)
        order = np.argsort(keys)
        wanted = np.concatenate([self.keys, self.far])
        at = order[np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)]
        if not np.array_equal(keys[at], wanted):
            return None
        return Places.of(self, problem, pairs, at)


@dataclass(frozen=True)
class Places:
    """Where unknowns of a head are in a problem.

    Attributes:
        head: it, with all pairs of the problem.
        flat: of the problem.
        inside, far: (h,), (d,) poses of the problem; tail: (t,) its other poses.
        outer: (b,) numbers of the border in `flat`.
    """

    head: Head
    flat: BandLayout
    inside: Index
    far: Index
    tail: Index
    outer: Index

    @staticmethod
    def of(head: Head, problem: Problem, pairs: list[Pair], at: Index) -> Places:
        """
        Args:
            at: (h + d,) poses of the problem that are the head's.
        """
        flat = BandLayout.flat(problem)
        inside, far = np.split(at, [len(head.keys)])
        is_tail = np.ones(len(problem.n), dtype=bool)
        is_tail[at] = False
        number = {pair: k for k, pair in enumerate(pairs)}
        known = set(head.pairs)
        named = (*head.pairs, *(pair for pair in pairs if pair not in known))
        bias = flat.bias[np.array([number[pair] for pair in named], dtype=np.int64)]
        first, later = np.split(bias, [head.paired])
        others = flat.constants[len(pairs) :]
        outer = np.concatenate([flat.poses[far].ravel(), first, others, later])
        whole = replace(head, pairs=named)
        return Places(whole, flat, inside, far, np.flatnonzero(is_tail), outer)

    @property
    def front(self) -> Index:
        """(f,) poses of the problem."""
        return self.inside[self.head.front]

    def is_late(self, problem: Problem) -> bool:
        """Does odometry join any pose of the tail to one that was eliminated?"""
        is_gone, is_tail = np.zeros((2, len(problem.n)), dtype=bool)
        is_gone[self.inside] = is_tail[self.tail] = True
        is_gone[self.front] = False
        i, j = problem.odometry.i, problem.odometry.j
        return bool(((is_gone[i] & is_tail[j]) | (is_tail[i] & is_gone[j])).any())

    def dense(self, poses: Index) -> tuple[BandLayout, Index]:
        """A layout of the front, of some poses (k,) and of the border, all in one; and the number
        in `flat` of each."""
        apart = np.concatenate([self.front, poses])
        numbers = np.concatenate([self.flat.poses[apart].ravel(), self.outer])
        place = np.full(self.flat.band + self.flat.border, NOWHERE)
        place[numbers] = np.arange(len(numbers))
        part = {
            name: _moved(place, getattr(self.flat, name))
            for name in (
                "poses",
                "bias",
                "scale",
                "yaw",
                "near_bias",
                "team_bias",
                "turn",
                "antenna",
            )
        }
        return BandLayout(**part, band=0, border=len(numbers), width=1), numbers


def _moved(place: Index, numbers: Index) -> Index:
    return np.where(numbers == NOWHERE, NOWHERE, place[numbers])


def keys_of(problem: Problem) -> Index:
    """(k,) one number for each robot and keyframe."""
    return np.asarray(problem.robot_id.astype(np.int64) * KEY + problem.n.astype(np.int64))


def tail_of(problem: Problem) -> Flags:
    """(k,) which poses are among the newest."""
    count = len(problem.n)
    return np.asarray(np.arange(count) >= count - TAIL * len(problem.priors.scale))
