"""What a robot claims of poses with `rbcd`: it moves its own block, and holds the whole graph.

The whole graph is reckoned once for each news of it, on the worker, and not solved: poses that a
solver would start from are near enough for a covariance.
"""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import blake2b
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from drslamd.slam import headway
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.closures.claimed import WholeGraph
from drslamd.slam.se2 import Array

MOST_CLAIMED = 12
"""Poses, ours and those of neighbours in their order: each takes three solutions of the whole."""


class WholeClaim(NamedTuple):
    """Covariance (3 k, 3 k) of the first k poses that were asked for, and what it is of."""

    joint: Array
    of: bytes


NOTHING = WholeClaim(np.zeros((0, 0)), b"")


def whole_claim(
    graph: PoseGraph,
    group: Group,
    previous: TeamEstimate | None,
    window_n: int,
    newest: Mapping[int, int],
) -> WholeClaim:
    """Of keyframes by robot, until one is not in the group yet.

    Args:
        previous: our last move.
        window_n: see `WholeGraph.of`.
    """
    of = _fingerprint(graph, group, newest)
    if previous is not None and previous.lifted is not None and previous.lifted.claimed_of == of:
        return WholeClaim(previous.joint, of)
    headway.mark()
    whole = WholeGraph.of(graph, group, window_n)
    views = graph.view.chains
    ends = [int(whole.places.of(views[k], np.array([n]))[0]) for k, n in newest.items()]
    wanted = list(takewhile(lambda place: place >= 0, ends[:MOST_CLAIMED]))
    start = factors.initial_poses(graph, group, previous, whole.places)
    return WholeClaim(whole.joint(wanted, start), of)


def _fingerprint(graph: PoseGraph, group: Group, newest: Mapping[int, int]) -> bytes:
    """Of all that a claim depends on."""
    seen = blake2b(repr((sorted(group.members), group.frame, list(newest.items()))).encode())
    robots = {segment.robot for segment in group.members}
    for robot in sorted(robots):
        chain = graph.view.chains[robot]
        seen.update(repr((robot, chain.model)).encode())
        seen.update(np.ascontiguousarray(chain.keyframes.n).tobytes())
    for pair in graph.view.pairs:
        if {pair.a.robot, pair.b.robot} <= robots:
            seen.update(np.ascontiguousarray(pair.closures.rows).tobytes())
    return seen.digest()
