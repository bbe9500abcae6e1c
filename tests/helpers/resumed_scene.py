"""What a robot holds that began again beside two that know where they are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drslamd.conventions import SECOND_US, Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import GraphEntry, Keyframe
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.odometry.track import RESOLUTION, Track
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relocation.last_place import LastPlace, SeenFrom
from drslamd.slam.relocation.question import Found
from drslamd.slam.relocation.resumption import Resumption
from drslamd.slam.relocation.sightings import Own
from drslamd.slam.robot_model import UNTOLD
from drslamd.slam.se2 import Array

OWN, KNOWS, FRAME = Chain(1, 5), Chain(0, 9), Segment(0, 9, 0)
PEERS = {Chain(0, 9): (0.0, 0.0), Chain(2, 9): (6.0, 5.0)}
"""They stand there, and look along x."""
BEGAN, UNTIL = 100, 180
"""Samples of our odometry; clocks are alike."""
W_T_O = np.array([4.0, -1.0, 2.2])


def last(seconds: float = 5.0, peer: Chain = KNOWS, x: float = 4.0) -> LastPlace:
    """Seen from a peer so long before our odometry began."""
    then = round(BEGAN / 10 * SECOND_US - seconds * SECOND_US)
    return LastPlace(0.5, (SeenFrom(peer, 20, then, x, -1.0, 0.2),))


class ResumedScene:
    """What the robot that began again holds after eight seconds of half a circle."""

    def __init__(self, place: LastPlace | None) -> None:
        self.graph, self.ranges = PoseGraph(), dict[int, RangeBuffer]()
        track = Track(1_000)
        for n in range(BEGAN, UNTIL):
            track.append(n, np.round(driven(n) / RESOLUTION))
        self.graph.insert(OWN, GraphEntry(0, keyframes=tuple(map(keyframe, range(100, 180, 10)))))
        self.neighbours = []
        for chain, at in PEERS.items():
            self.graph.insert(chain, GraphEntry(0, keyframes=(Keyframe(20, 0, 0, 0, 0),)))
            still = Track(1_000)
            for n in range(20, UNTIL):
                still.append(n, np.zeros(3))
            self.neighbours.append(PeerInRange(chain, chain.robot, True, still, 0, frame=0))
            self.ranges[chain.robot] = buffer = RangeBuffer()
            for n in range(BEGAN, UNTIL):
                away = np.hypot(*(se2.compose(W_T_O, driven(n))[:2] - at))
                buffer.add(n * 100_000 + 1, float(away))
        self.own = PairEnd(track, self.graph.chains[OWN.robot])
        self.resumption = Resumption(Own(OWN.robot, UNTOLD, 0.1, LINKTRACK), place)

    def look(
        self, estimate: TeamEstimate | None = None, utime: int = UNTIL * 100_000
    ) -> Callable[[], Found] | None:
        team = estimate or solved()
        return self.resumption.look(self.neighbours, self.ranges, self.own, self.graph, team, utime)

    def found(self) -> Found:
        run = self.look()
        assert run is not None
        return run()


def driven(n: int) -> Array:
    """Half a circle of 1.5 m in eight seconds."""
    turn = np.pi * (n - BEGAN) / (UNTIL - BEGAN)
    return np.array([1.5 * np.sin(turn), 1.5 * (1 - np.cos(turn)), turn])


def keyframe(n: int) -> Keyframe:
    return Keyframe(n, 0, *(round(v / r) for v, r in zip(driven(n), RESOLUTION, strict=True)))


def solved(*more: int, points: frozenset[int] = frozenset()) -> TeamEstimate:
    ends = {c.robot: Trajectory(c, np.array([20]), np.array([[*p, 0.0]])) for c, p in PEERS.items()}
    for robot in more:
        ends[robot] = Trajectory(OWN, np.array([100]), np.zeros((1, 3)))
    return TeamEstimate(FRAME, ends, 1e-4 * np.eye(3 * len(ends)), points=points)
