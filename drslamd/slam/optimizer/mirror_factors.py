"""Factors of robots whose odometry tells the mirror image of their way, as of wheels that do not.

What odometry measured is mirrored in the axis of x of each robot, and so is how that moves with its
constants: a yaw rate is that of the mirror image. The antenna stays where it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drslamd.slam import se2
from drslamd.slam.graph.estimate import Learned
from drslamd.slam.odometry.correction import MIRROR, MIRRORED
from drslamd.slam.optimizer.problem import BetweenFactors, OdometryFactors, RangeFactors
from drslamd.slam.se2 import Array

OF_CONSTANTS = np.array([-1.0, 1.0])
"""A mirrored way moves the other way with its yaw rate, and as before with its scale."""


def mirrored_between(factors: BetweenFactors, odd: NDArray[np.bool_]) -> BetweenFactors:
    """
    Args:
        odd: (m,) which of them.
    """
    sign = np.where(odd[:, None], MIRROR, 1.0)
    covariance = sign[:, :, None] * factors.covariance * sign[:, None, :]
    return replace(factors, measured=sign * factors.measured, covariance=covariance)


def mirrored_odometry(factors: OdometryFactors, odd: NDArray[np.bool_]) -> OdometryFactors:
    """
    Args:
        odd: (m,) which of them.
    """
    sign = np.where(odd[:, None], MIRROR, 1.0)
    covariance = sign[:, :, None] * factors.covariance * sign[:, None, :]
    return replace(
        factors,
        measured=sign * factors.measured,
        covariance=covariance,
        by_yaw=np.where(odd[:, None], -sign, 1.0) * factors.by_yaw,
        by_turn=sign * factors.by_turn,
    )


def mirrored_ranges(factors: RangeFactors, robot: int, antenna: Array) -> RangeFactors:
    """
    Args:
        robot: as the problem numbers them; antenna: (2,) its place, m.
    """
    ends, turned = [factors.q_i, factors.q_j], factors.turned.copy()
    moves = factors.carried.moves.copy()
    for end in (0, 1):
        odd = factors.robots[:, end] == robot
        q, turn = ends[end], turned[:, end]
        body = MIRROR[:2] * (q - se2.rotate(turn, antenna))
        ends[end] = np.where(odd[:, None], body + se2.rotate(-turn, antenna), q)
        turned[odd, end] *= -1
        mine = odd[factors.carried.rows]
        moves[mine, end] *= OF_CONSTANTS[:, None] * MIRROR[:2]
    carried = replace(factors.carried, moves=moves)
    return replace(factors, q_i=ends[0], q_j=ends[1], turned=turned, carried=carried)


def turns(
    learned: Mapping[int, Learned], doubted: Iterable[int], mirrored: Set[int]
) -> dict[int, Learned]:
    """By which fraction turns of robots that are not mounted as configured are longer.

    Args:
        learned: of everybody, of a mirrored robot that of its image; doubted: who else is not.
    """
    out = {robot: learned[robot] for robot in doubted}
    for robot in mirrored:
        value, sigma = learned[robot]
        out[robot] = Learned(MIRRORED - value, sigma)
    return out


def headings(joint: Array, robots: Sequence[int], mirrored: Set[int]) -> dict[int, float]:
    """Variances of the headings of mirror images.

    Args:
        joint: (3 k, 3 k) covariance of the first k poses; robots: whose they are.
    """
    known = zip(robots, np.diag(joint)[2::3].tolist(), strict=False)
    return {robot: variance for robot, variance in known if robot in mirrored}
