"""Track and antenna of a robot, learned where what was measured asks for it.

As unknowns of every solution they would take from the rest: range biases that move with bearing
look like antennas. So each is held as configured until its score says that letting it go would
take a lot off the cost (Rao's score test):

    score = f' V^-1 f     f = J_m' W e     V = J_m' W J_m - B' H^-1 B     B = J' W J_m
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.assembly import by_columns, by_weight
from drslamd.slam.optimizer.banded.band_factor import BandFactor, Solver
from drslamd.slam.optimizer.banded.layout import NOWHERE
from drslamd.slam.optimizer.banded.linearised import Linearised
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.se2 import Array, Index

ASKED_FOR = 30.0
"""Score; with mountings as configured it stays below 10, and below 25 where biases move with
bearing; a track or an antenna that is far off scores 65 to 400."""
BESIDE = 22.0
"""Likewise of an antenna beside another one that is off: with one of them let go the other bends
until it fits."""
TOGETHER = 18.0
"""Score of all antennas together, for each robot: where two are off each hides the other. As
configured it is 4 at most, where wheels slip 10; in a recording with biases that move with bearing
more than 9, and headings were worse with antennas let go."""
WORTH = 25.0
"""What the cost must really lose, for each robot, where they only ask together, and odometry must
be as configured then."""
WITHOUT_DATA = 0.1
"""Sigma, a fraction or m, that a score takes for granted; what moves no error scores nothing."""
FIRST = 8
"""Of the columns of a factor's Jacobian, that of its first mounting."""
ROUNDS = 4
"""Of letting go: one that is far off hides others."""


@dataclass(frozen=True)
class Scores:
    """
    Attributes:
        track, antenna: (robots,) each.
        antennas: of all of them together.
    """

    track: Array
    antenna: Array
    antennas: float = 0.0

    def ask(self) -> bool:
        """Does any mounting ask to be let go?"""
        return self.ask_alone() or self.antennas > TOGETHER * len(self.track)

    def ask_alone(self) -> bool:
        """By its own score?"""
        return bool((np.append(self.track, self.antenna) > ASKED_FOR).any())

    def least_gain(self) -> float:
        """What letting go must take off the cost."""
        return 0.0 if self.ask_alone() else WORTH * len(self.track)


def scores(equations: Equations, point: Point, factor: Solver) -> Scores:
    """What the cost would lose with each mounting let go, at the solution without; 0 of those that
    are unknowns already.

    Args:
        factor: of the system at that point.
    """
    problem = equations.problem
    parts = _parts(equations, point)
    left = _variances(equations, parts, factor)
    if left is None:
        robots = len(problem.priors.scale)
        return Scores(np.zeros(robots), np.zeros(robots))
    return scored(problem, _pulls(equations, parts), left)


def scored(problem: Problem, pull: Array, left: Array) -> Scores:
    """
    Args:
        pull: (3 R,) f, see `pulls`; left: (3 R, 3 R) V, see `variances`.
    """
    robots, doubted = len(problem.priors.scale), problem.doubted
    track = pull[:robots] ** 2 / np.diag(left)[:robots]
    pairs = robots + np.arange(2 * robots).reshape(-1, 2)
    blocks = left[pairs[:, :, None], pairs[:, None, :]]
    moved = np.linalg.solve(blocks, pull[pairs][..., None])[..., 0]
    antenna = (pull[pairs] * moved).sum(axis=1)
    held = pairs[~doubted.antenna].ravel()
    antennas = pull[held] @ np.linalg.solve(left[np.ix_(held, held)], pull[held])
    return Scores(
        np.where(doubted.track, 0.0, track),
        np.where(doubted.antenna, 0.0, antenna),
        float(antennas),
    )


def variances(equations: Equations, point: Point, factor: Solver) -> Array | None:
    """(3 R, 3 R) V of the turns of R robots, then of their antennas; None where it is unknown."""
    return _variances(equations, _parts(equations, point), factor)


def pulls(equations: Equations, point: Point) -> Array:
    """(3 R,) f, likewise."""
    return _pulls(equations, _parts(equations, point))


class _Part(NamedTuple):
    """One set of m factors.

    Attributes:
        jacobian: (c, d, m), see `assembly.by_columns`.
        unknowns: (c, m) on which they depend.
        which: (k, m) the columns of V that belong to their mountings.
    """

    factors: Linearised
    jacobian: Array
    unknowns: Index
    which: Index

    @staticmethod
    def of(factors: Linearised, unknowns: Index, which: Index) -> _Part:
        return _Part(factors, by_columns(factors.jacobian), unknowns.T, which.T)

    @property
    def mine(self) -> Array:
        """(k, d, m) columns of the mountings."""
        return self.jacobian[FIRST : FIRST + len(self.which)]


def _parts(equations: Equations, point: Point) -> list[_Part]:
    problem, layout = equations.problem, equations.layout
    robots = len(problem.priors.scale)
    ranges = linearised.weighed_ranges(problem, point, problem.widths)
    odometry = linearised.odometry_at(problem, point)
    # by robot: turns are columns 0 .. R - 1, antennas the 2 R behind them
    antennas = (robots + 2 * problem.ranges.robots[:, :, None] + np.arange(2)).reshape(-1, 4)
    turns = _Part.of(
        odometry, layout.odometry_unknowns(problem.odometry), problem.odometry.robot[:, None]
    )
    if not len(problem.ranges.carried.rows):
        return [turns, _Part.of(ranges, layout.range_unknowns(problem.ranges), antennas)]
    is_carried = problem.ranges.is_carried
    plain = layout.range_unknowns(problem.ranges.chosen(~is_carried))
    carried = linearised.carried_part(problem, point, ranges)
    return [
        turns,
        _Part.of(ranges.chosen(~is_carried), plain, antennas[~is_carried]),
        _Part.of(carried, layout.carried_unknowns(problem.ranges), antennas[is_carried]),
    ]


def _variances(equations: Equations, parts: list[_Part], factor: Solver) -> Array | None:
    layout, columns = equations.layout, 3 * len(equations.problem.priors.scale)
    size = layout.band + layout.border
    shared, at, own, both = [], [], [], []
    for part in parts:
        weighed = by_weight(part.mine, part.factors.information)
        some = np.flatnonzero((part.unknowns != NOWHERE).any(axis=1))
        # what is no unknown goes beyond them
        unknowns = np.where(part.unknowns == NOWHERE, size, part.unknowns)[some]
        by = part.jacobian[some]
        shared += [np.einsum("dm,cdm->cm", each, by).ravel() for each in weighed]
        at.append((unknowns * columns + part.which[:, None]).ravel())
        own += [np.einsum("dm,kdm->km", each, part.mine).ravel() for each in weighed]
        both.append((part.which[:, None] * columns + part.which).ravel())
    sums = np.bincount(np.concatenate(at), np.concatenate(shared), (size + 1) * columns)
    coupling = sums.reshape(-1, columns)[:size]
    known = factor.squared(coupling)
    if known is None:
        return None
    squares = np.bincount(np.concatenate(both), np.concatenate(own), columns**2)
    alone = squares.reshape(columns, columns) + WITHOUT_DATA**-2 * np.eye(columns)
    return np.asarray(alone - known)


def _pulls(equations: Equations, parts: list[_Part]) -> Array:
    pull = np.zeros(3 * len(equations.problem.priors.scale))
    for part in parts:
        each = np.einsum("md,kdm->km", part.factors.pull, part.mine)
        pull += np.bincount(part.which.ravel(), each.ravel(), len(pull))
    return pull


def let_go(doubted: Doubted, found: Scores) -> Doubted:
    """Also those whose score asks for it; all antennas where they only ask together."""
    alone = doubted.antenna | (found.antenna > ASKED_FOR)
    if alone.any():
        antenna = alone | (found.antenna > BESIDE)
    else:
        antenna = np.full(len(alone), found.ask() and not found.ask_alone())
    return Doubted(doubted.track | (found.track > ASKED_FOR), antenna)


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
