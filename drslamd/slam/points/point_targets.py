"""What is heard and may stand: modules that no robot carries, and robots that do not drive."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from drslamd.conventions import GRID_US, SECOND_US, node_chain
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.points.point_tracker import Target

STANDS_US = 4 * SECOND_US
"""A robot that said no keyframe for so long stands: while it drives it says one a second."""


def point_targets(
    heard: Iterable[int],
    neighbours: list[PeerInRange],
    carrier: Callable[[int], int | None],
    graph: PoseGraph,
    estimate: TeamEstimate | None,
    utime: int,
) -> dict[int, Target]:
    """By UWB id.

    A robot whose pose is known needs no place. Of one that has said nothing of its wheels (they are
    off, or it has just been switched on) only the module is there.

    Args:
        heard: UWB ids; carrier: says which robot carries one.
    """
    peers = {peer.chain.robot: peer for peer in neighbours}
    out: dict[int, Target] = {}
    for uwb_id in heard:
        robot = carrier(uwb_id)
        if robot is None or robot not in graph.chains:
            out[uwb_id] = Target(node_chain(uwb_id))
            continue
        data, peer = graph.chains[robot], peers.get(robot)
        is_posed = estimate is not None and robot in estimate.trajectories
        if is_posed and estimate is not None and robot not in estimate.points:
            continue
        if peer is None or peer.ahead_us is None or data.chain != peer.chain:
            continue
        if not len(data.keyframes):
            continue
        n = int(data.keyframes.n[-1])
        since = n * GRID_US - peer.ahead_us
        if utime - since >= STANDS_US:
            arm = float(np.hypot(*data.model.antenna))
            out[uwb_id] = Target(data.chain, n, since, arm)
    return out
