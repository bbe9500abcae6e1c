"""What a solution says of sight: a signal that went around something is too long."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.banded.misfit import (
    OF_RUN,
    OUTLIER_SIGMAS,
    RUN,
    in_a_row,
    outliers,
    runs,
    share,
)
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array

BLOCKED_SHARE = 0.15
"""Of a pair between which sight was blocked; others come to 0.13 where ranges of some are."""
LONG = 2 * RUN
"""A robot that was not where it seems to be would by then not fit anybody."""
STEADY = 1.5
"""Sigmas, in the median, by which ranges scatter that a wall made longer; those to a robot that is
elsewhere move by many, and from nothing on."""


def too_long(problem: Problem, point: Point) -> NDArray[np.bool_]:
    """(n,) which of the ranges are longer by far than the solution has them."""
    return np.asarray(point.sight.error < -OUTLIER_SIGMAS * problem.ranges.sigma)


def blocked(problem: Problem, point: Point) -> NDArray[np.bool_]:
    """(pairs,) of whose ranges many are too long, where that explains what was measured."""
    far = share(problem, too_long(problem, point)) >= BLOCKED_SHARE
    return np.zeros(problem.pairs, dtype=bool) if problem.blocked is None else far


def has_passed(problem: Problem, point: Point) -> bool:
    """Were ranges of any pair too long for longer than bursts last, and do they fit again since?
    Where wheels stood or spun they do not."""
    pair, is_long, count = in_a_row(problem, too_long(problem, point))
    lasted = count >= RUN
    is_next = pair[1:] == pair[:-1]
    return bool((is_next & is_long[:-1] & lasted[:-1] & lasted[1:]).any())


def long_for_long(problem: Problem, point: Point) -> NDArray[np.bool_]:
    """(pairs,) whose ranges were too long for longer than bursts last."""
    pair, is_long, count = in_a_row(problem, too_long(problem, point))
    found = np.zeros(problem.pairs, dtype=bool)
    found[pair[is_long & (count >= RUN)]] = True
    return found


def has_witnesses(problem: Problem, point: Point) -> bool:
    """Are ranges of some pairs off by the same since some moment, for long, while those of both
    robots with somebody else have fit as long? Then neither is elsewhere, and what lies between
    them has come: what wheels missed changes with where the robots drive."""
    problem = replace(problem, blocked=None)
    robots, wrong = np.unique(problem.robot_id), outliers(problem, point)
    ends = np.stack([problem.ranges.i, problem.ranges.j])
    whose, n = np.searchsorted(robots, problem.robot_id[ends]), problem.n[ends]
    off = point.sight.error / problem.ranges.sigma
    found = runs(problem, point)
    for run in found:
        for robot, other, since in ((run.i, run.j, run.n_i), (run.j, run.i, run.n_j)):
            is_own = ((whose == robot) & (n >= since)).any(axis=0)
            is_between = (whose == other).any(axis=0)
            between, beside = off[is_own & is_between & wrong], wrong[is_own & ~is_between]
            is_steady = len(between) >= LONG and _median_deviation(between) <= STEADY
            if not is_steady or 2 * len(beside) < run.count or beside.mean() > 1 - OF_RUN:
                return False
    return bool(found)


def _median_deviation(values: Array) -> float:
    return float(np.median(np.abs(values - np.median(values))))
