"""What robots of `small_team` say of themselves that know the truth, for module 3 with `rbcd`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from slam_scenes import EXACT, Array, SmallTeam, group_of, inverted, product, small_team

from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer.rbcd.rbcd_optimizer import RbcdOptimizer

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


def good_team() -> SmallTeam:
    """Three robots with good wheels; closures are as wrong as they say, 5 cm."""
    return small_team(3, count=COUNT, noise=EXACT)


def a_round(
    team: SmallTeam,
    robot: int,
    public: Mapping[int, PublicPoses],
    previous: TeamEstimate | None = None,
    group: Group | None = None,
) -> TeamEstimate | None:
    """One move of a robot that knows these public poses of others."""
    optimizer = RbcdOptimizer(team.chains[robot], RANK)
    run = optimizer.job(team.graph, group or group_of(team.graph), previous, public)
    return run() if run else None
