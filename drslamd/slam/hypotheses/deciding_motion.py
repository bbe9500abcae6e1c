"""Which motion decides between places: the one after which their ranges differ enough.

Ranges of a window fit all places that are left, so at its end they tell the same. Somebody who
then turns by an angle and drives a way d in the direction u, while what is at x_i stands, sees its
range change by

    c_i = |x_i - d u| - |x_i|

A constant bias of the pair drops out of that. How well c_i is known follows from the covariance of
x_i by its gradient; what is measured at the end of the way has the sigma of a range. So two places
are as far apart as

    (c_i - c_j)^2 / (sigma^2 + g_i' C_i g_i + g_j' C_j g_j)

in units of their variance, and told from each other where that is what module 1 asks for to
exclude one. Straight on tells nothing from its mirror image about the way that is driven. Both
robots of a pair that drove straight leave four places, which may take two such motions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.range_model import LEAST_DISTANCE_M
from drslamd.slam.relative_pose.solver import EXCLUDED_CHI2
from drslamd.slam.se2 import Array, Index

NO_TURN = (-1.0, -1.0)
"""In the place of the least and the largest turn to a side: none decides."""
WAYS_M = np.array([0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0])
"""That are tried; who drives farther is localised in another way."""
END_M = 0.25
"""So long before its end a way decides already: the ranges of a moment err together. In the worlds
of the tests module 1 is then left with as few places as were foretold after 68 of 70 turns, without
it after 64."""
TURN_STEP_DEG = 5
TURNS = np.radians(np.arange(-180, 181, TURN_STEP_DEG))
WIDE = 30 // TURN_STEP_DEG
"""So many steps a sector of turns must span: nobody turns to the degree."""

Sector = tuple[float, float]
"""The least and the largest of turns to one side, rad, not negative; or `NO_TURN`."""


@dataclass(frozen=True)
class DecidingMotion:
    """First turn, then drive straight on.

    Attributes:
        peer: whose places it decides between; mover: which robot of the two is to drive.
        way_m: so far at least.
        left, right: by how much the mover turns first.
        leaves: so many places at most are left then, whichever is true.
    """

    peer: int
    mover: int
    way_m: float
    left: Sector
    right: Sector
    leaves: int


def deciding_motion(
    peer: int, mover: int, places: Array, covariances: Array, sigma: float
) -> DecidingMotion | None:
    """What leaves the fewest places, and of that the shortest way; None where nothing leaves less.

    Args:
        places: (k, 2) in the frame of the mover's body, m; covariances: (k, 2, 2).
        sigma: of a range, m.
    """
    ahead, left_over = len(TURNS) // 2, most_left(places, covariances, sigma)
    for leaves in range(1, len(places)):
        for way_m, of_way in zip(WAYS_M.tolist(), (left_over <= leaves).T, strict=True):
            left, right = _sector(of_way[ahead:]), _sector(of_way[ahead::-1])
            if left != NO_TURN or right != NO_TURN:
                return DecidingMotion(peer, mover, way_m, left, right, leaves)
    return None


def most_left(places: Array, covariances: Array, sigma: float) -> Index:
    """(turns, ways): how many places are left at most, for each of `TURNS` and `WAYS_M`; arguments
    as of `deciding_motion`."""
    ends = (WAYS_M[:, None] - END_M) * np.stack([np.cos(TURNS), np.sin(TURNS)], axis=-1)[:, None]
    before, there = _sight(places), _sight(places - ends[:, :, None])
    changes, gradients = there[1] - before[1], there[0] - before[0]
    variances = np.einsum("...ka,kab,...kb->...k", gradients, covariances, gradients)
    both = sigma**2 + variances[..., :, None] + variances[..., None, :]
    apart = (changes[..., :, None] - changes[..., None, :]) ** 2 / both
    return np.asarray(np.count_nonzero(apart < EXCLUDED_CHI2, axis=-1).max(axis=-1))


def _sight(away: Array) -> tuple[Array, Array]:
    """Unit vectors and distances (...) of vectors (..., 2)."""
    distance = np.maximum(np.hypot(away[..., 0], away[..., 1]), LEAST_DISTANCE_M)
    return away / distance[..., None], distance


def _sector(decides: Array) -> Sector:
    """The widest sector of turns that decide, of those to one side, the smallest first."""
    edges = np.diff(np.concatenate([[0], decides, [0]]))
    first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    if not len(first) or (last - first).max() < WIDE:
        return NO_TURN
    widest = int(np.argmax(last - first))
    step = np.radians(TURN_STEP_DEG)
    return float(first[widest] * step), float(last[widest] * step)
