"""Track and antenna of a robot, learned where what was measured asks for it.

As unknowns of every solution they would take from the rest: range biases that move with bearing
look like antennas. So each is held as configured until its score says that letting it go would
take a lot off the cost (Rao's score test):

    score = f' V^-1 f     f = J_m' W e     V = J_m' W J_m - B' H^-1 B     B = J' W J_m
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.layout import NOWHERE
from drslamd.slam.optimizer.banded.linearised import Linearised
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Doubted
from drslamd.slam.se2 import Array, Index

ASKED_FOR = 30.0
"""Score; with mountings as configured it stays below 10, and below 25 where biases move with
bearing; a track or an antenna that is far off scores 65 to 400."""
WITHOUT_DATA = 0.1
"""Sigma, a fraction or m, that a score takes for granted; what moves no error scores nothing."""
ROUNDS = 4
"""Of letting go: one that is far off hides others."""


@dataclass(frozen=True)
class Scores:
    """(robots,) each."""

    track: Array
    antenna: Array

    def ask(self) -> bool:
        """Does any mounting ask to be let go?"""
        return bool((np.append(self.track, self.antenna) > ASKED_FOR).any())


def scores(equations: Equations, point: Point, factor: BandFactor) -> Scores:
    """What the cost would lose with each mounting let go, at the solution without; 0 of those that
    are unknowns already.

    Args:
        factor: of the system at that point.
    """
    problem, layout = equations.problem, equations.layout
    robots = len(problem.priors.scale)
    ones = np.ones(problem.pairs)
    ranges = linearised.weighed_ranges(problem, point, ones)
    odometry = linearised.odometry_at(problem, point)
    # by robot: turns are columns 0 .. R - 1, antennas the 2 R behind them
    antennas = (robots + 2 * problem.ranges.robots[:, :, None] + np.arange(2)).reshape(-1, 4)
    is_carried = problem.ranges.is_carried
    plain = layout.range_unknowns(problem.ranges.chosen(~is_carried))
    carried = linearised.carried_part(problem, point, ranges)
    parts = (
        (odometry, layout.odometry_unknowns(problem.odometry), problem.odometry.robot[:, None], 8),
        (ranges.chosen(~is_carried), plain, antennas[~is_carried], 8),
        (carried, layout.carried_unknowns(problem.ranges), antennas[is_carried], 8),
    )
    size, columns = layout.band + layout.border, 3 * robots
    coupling, own, pull = np.zeros((size, columns)), np.zeros((columns, columns)), np.zeros(columns)
    for factors, unknowns, which, first in parts:
        _add(coupling, own, pull, factors, unknowns, which, first)
    solved = factor.solved(coupling)
    if solved is None:
        return Scores(np.zeros(robots), np.zeros(robots))
    left = own - coupling.T @ solved + WITHOUT_DATA**-2 * np.eye(columns)
    track = pull[:robots] ** 2 / np.diag(left)[:robots]
    pairs = robots + np.arange(2 * robots).reshape(-1, 2)
    blocks = left[pairs[:, :, None], pairs[:, None, :]]
    moved = np.linalg.solve(blocks, pull[pairs][..., None])[..., 0]
    antenna = (pull[pairs] * moved).sum(axis=1)
    doubted = problem.doubted
    return Scores(np.where(doubted.track, 0.0, track), np.where(doubted.antenna, 0.0, antenna))


def _add(
    coupling: Array,
    own: Array,
    pull: Array,
    factors: Linearised,
    unknowns: Index,
    which: Index,
    first: int,
) -> None:
    """Add J' W J_m, J_m' W J_m and J_m' f of some factors.

    Args:
        which: (m, k) columns of their mountings; in their Jacobian these are `first` and following.
    """
    mine = factors.jacobian[:, :, first : first + which.shape[1]]
    weighed = np.swapaxes(mine, 1, 2) @ factors.information
    is_unknown = (unknowns != NOWHERE)[:, None, :]
    shared = np.where(is_unknown, weighed @ factors.jacobian, 0.0)
    at = np.where(is_unknown, unknowns[:, None, :], 0) * coupling.shape[1] + which[:, :, None]
    coupling += np.bincount(at.ravel(), shared.ravel(), coupling.size).reshape(coupling.shape)
    both = which[:, :, None] * len(own) + which[:, None, :]
    own += np.bincount(both.ravel(), (weighed @ mine).ravel(), own.size).reshape(own.shape)
    each = (factors.pull[:, None, :] @ mine)[:, 0]
    pull += np.bincount(which.ravel(), each.ravel(), len(pull))


def let_go(doubted: Doubted, found: Scores) -> Doubted:
    """Also those whose score asks for it."""
    return Doubted(
        doubted.track | (found.track > ASKED_FOR), doubted.antenna | (found.antenna > ASKED_FOR)
    )


def fitted(
    equations: Equations, nominal: Point, found: Scores, most: int, tolerance: float
) -> tuple[Equations, Point]:
    """The solution with mountings let go until no other asks for it.

    Args:
        found: scores at the nominal solution.
    """
    point, problem = nominal, equations.problem
    for _ in range(ROUNDS):
        wider = let_go(problem.doubted, found)
        if _is_same(wider, problem.doubted):
            break
        problem = replace(problem, doubted=wider, initial=point.poses)
        equations = Equations(problem)
        point = descend(equations, point.calibration, most, tolerance)
        system = equations.weighed(point)
        factor = BandFactor.of(system)
        if factor is None:
            break
        found = scores(equations, point, factor)
    return equations, point


def _is_same(one: Doubted, other: Doubted) -> bool:
    return bool((one.track == other.track).all() and (one.antenna == other.antenna).all())
