"""What the second derivative of the team's cost has beside J' W J: errors by how they bend.

For each factor it is a form of a few rows, D' S D, and has the same unknowns. How constants of
odometry act on each other (a turn and a scale) is left out.

Where something is pulled at, what a second derivative is depends on the coordinates. In those of
`chart`, where each pose turns what is beyond it, a pull of all that is beyond a way acts as if a
factor joined both ends of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.linearised import Linearised
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.turning.chart import beyond
from drslamd.slam.optimizer.factor_errors import pose_errors
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array, Index

SHORT_M = 0.1
"""A range that is shorter bends no more than this one."""
CONSTANTS_I, CONSTANTS_J = [8, 9, 12, 13], [10, 11, 14, 15]
"""Columns of carried ranges with constants that move the arm at either end."""


def of_factors(problem: Problem, point: Point, antennas: bool) -> list[Linearised]:
    """Of the sets of `Equations`."""
    odometry, closures = problem.odometry, problem.closures
    force = _turned(point.poses[odometry.i, 2], odometry.weighed(point.link))
    sets = [of_ways(point.poses, odometry.i, odometry.j, force, columns=9)]
    if len(closures):
        errors = closures.weighed(pose_errors(point.poses, closures, closures.measured))
        force = _turned(point.poses[closures.i, 2], errors)
        sets.append(of_ways(point.poses, closures.i, closures.j, force, columns=6))
    return [*sets, *_of_ranges(problem, point, antennas)]


def of_turning(poses: Array, pulls: Array, gauge: int) -> Linearised:
    """Of the ways from each pose to the next, in the coordinates of a chart with nobody around.

    Args:
        pulls: (k, 3) the gradient.
    """
    each = np.arange(len(poses) - 1)
    return of_ways(poses, each, each + 1, -beyond(pulls[:, :2] @ [1, 1j], gauge), columns=6)


def both(one: Linearised, other: Linearised) -> Linearised:
    """Of the same factors, the sum of both."""
    d, e = one.jacobian.shape[1], other.jacobian.shape[1]
    form = np.zeros((len(one.pull), d + e, d + e))
    form[:, :d, :d], form[:, d:, d:] = one.information, other.information
    rows = np.concatenate([one.jacobian, other.jacobian], axis=1)
    return Linearised(rows, form, np.concatenate([one.pull, other.pull], axis=1))


def of_ways(poses: Array, i: Index, j: Index, force: Array, columns: int) -> Linearised:
    """Of ways R_i' (p_j - p_i) that are pulled at.

    Args:
        force: (m,) the pull in w, x + iy.
        columns: of the Jacobian; those of both poses are the first.
    """
    way = (poses[j, :2] - poses[i, :2]) @ [1, 1j]
    rows, form = np.zeros((len(i), 2, columns)), np.zeros((len(i), 2, 2))
    rows[:, 0, 2] = 1
    rows[:, 1, 3], rows[:, 1, 4] = -force.imag, force.real
    rows[:, 1, :2] = -rows[:, 1, 3:5]
    form[:, 0, 0] = -(np.conj(force) * way).real
    form[:, 0, 1] = form[:, 1, 0] = 1
    return Linearised(rows, form, np.zeros((len(i), 2)))


def _of_ranges(problem: Problem, point: Point, antennas: bool) -> list[Linearised]:
    """Of those that odometry has not carried, and of those that it has."""
    form = _form(problem, point, linearised.ranges_at(problem, point, antennas=antennas).pull[:, 0])
    across, along = (_moved(problem, point, turned, antennas) for turned in (1j, 1.0))
    is_carried = problem.ranges.is_carried
    forms = [form[~is_carried], form[is_carried]] if is_carried.any() else [form]
    return [_with_turns(*each) for each in zip(across, along, forms, strict=True)]


def _moved(problem: Problem, point: Point, turned: complex, antennas: bool) -> list[Array]:
    """(m, 1, c) of the same sets, how ends move along lines of sight that are turned like this."""
    ranges, sight = problem.ranges, point.sight
    sight = sight._replace(direction=turned * sight.direction, slope=np.ones(len(ranges)))
    plain = replace(point, sight=sight)
    ends = linearised.ranges_at(problem, plain, antennas=antennas)
    ends.jacobian[:, :, 6:8] = 0.0
    if not len(ranges.carried.rows):
        return [ends.jacobian]
    carried = linearised.carried_part(problem, plain, ends).jacobian
    return [ends.jacobian[~ranges.is_carried], carried]


def _form(problem: Problem, point: Point, pull: Array) -> Array:
    """(m, 7, 7) see `_with_turns`.

    Args:
        pull: (m,) half the derivative of the cost by errors.
    """
    ranges, sight, calibration = problem.ranges, point.sight, point.calibration
    near, reach = calibration.near_bias * sight.shape, problem.model.near_reach_m
    length = sight.error + ranges.measured - calibration.bias[ranges.pair] - near
    form = np.zeros((len(ranges), 7, 7))
    straight = pull * sight.slope
    form[:, 0, 0] = straight / np.maximum(length, SHORT_M)
    form[:, 1, 1] = straight * (np.conj(sight.direction) * sight.arm_i).real
    form[:, 2, 2] = -straight * (np.conj(sight.direction) * sight.arm_j).real
    for turn, arm in ((1, 3), (2, 4)):
        form[:, turn, arm] = form[:, arm, turn] = straight
    # the near-range bias fades with the distance
    form[:, 5, 5] = pull * near / reach**2
    form[:, 5, 6] = form[:, 6, 5] = -pull * sight.shape / reach
    return form


def _with_turns(across: Array, along: Array, form: Array) -> Linearised:
    """
    Args:
        across, along: (m, 1, c) how ends move across the line of sight, and along it.
        form: (m, 7, 7) of across, of both headings, of what moves the arms at both ends, of along
            and of the near-range bias.
    """
    count, _, columns = across.shape
    rows = np.zeros((count, 7, columns))
    rows[:, 0], rows[:, 5] = across[:, 0], along[:, 0]
    rows[:, 1, 2] = rows[:, 2, 5] = rows[:, 6, 7] = 1
    for row, constants in ((3, CONSTANTS_I), (4, CONSTANTS_J)):
        there = [column for column in constants if column < columns]
        rows[:, row, there] = -across[:, 0, there]
    return Linearised(rows, form, np.zeros((count, 7)))


def _turned(heading: Array, pull: Array) -> Array:
    """(m,) in w, x + iy, of pulls (m, 3) in frames with these headings."""
    return np.asarray(np.exp(1j * heading) * (pull[:, :2] @ [1, 1j]))
