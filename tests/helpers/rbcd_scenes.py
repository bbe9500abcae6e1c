"""What robots of `small_team` say of themselves that know the truth, for module 3 with `rbcd`."""

from __future__ import annotations

import numpy as np
from slam_scenes import Array, SmallTeam, inverted, product

from drslamd.slam.graph.public_poses import PublicPoses

RANK = 3
COUNT = 20
CARRIERS = [5, 15]
"""Keyframes of `small_team` that carry closures, by their place; of each pair of robots."""


def plain_lift(pose: Array, rank: int = RANK) -> Array:
    """A planar pose in the first direction of the relaxation."""
    row = np.zeros(2 * rank, dtype=complex)
    row[0], row[rank] = np.exp(1j * pose[2]), complex(pose[0], pose[1])
    return row


def in_frame(team: SmallTeam, robot: int) -> list[Array]:
    """True poses of a robot, seen from the first of robot 0."""
    origin = inverted(team.truth[0][0])
    return [product(origin, pose) for pose in team.truth[robot]]


def true_public(
    team: SmallTeam, robot: int, length: float = 1.0, rank: int = RANK, anchor: float = 1.0
) -> PublicPoses:
    """What a robot says that knows the truth.

    Args:
        length, anchor: of the rotations of its poses and of its origin; 1 is right.
    """
    numbers = tuple(int(team.n[robot][k]) for k in CARRIERS)
    poses = [np.zeros(3), *(in_frame(team, robot)[k] for k in CARRIERS)]
    values = np.array([plain_lift(pose, rank) for pose in poses])
    values[0, :rank] *= anchor
    values[1:, :rank] *= length
    return PublicPoses(0, team.chains[0].epoch, rank, numbers, values)
