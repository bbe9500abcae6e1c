"""A robot that drives past something that stands, as its front end has it: track, log, ranges."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from slam_scenes import NOISE, keyframes, model_of, wander

from drslamd.conventions import GRID_US, Chain, Segment
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry, RangeMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.odometry.track import RESOLUTION, Track
from drslamd.slam.points.point_tracker import Sensors
from drslamd.slam.range_model import LINKTRACK, RangeNoise
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.se2 import Array

OWN = Chain(3, 1)
SENSORS = Sensors(RangeNoise(0.1, 0.3), LINKTRACK)
FIRST = 1_000
"""Sample with which the drive begins."""


@dataclass
class PassingScene:
    """It drives curves at 0.5 m/s; odometry is exact, and its frame is that of the world.

    Attributes:
        node: (2,) where the thing stands, m; it may be moved.
        seconds: that have passed.
    """

    node: Array
    seconds: int = 0
    graph: PoseGraph = field(default_factory=PoseGraph)
    ranges: RangeBuffer = field(default_factory=RangeBuffer)
    path: Array = field(default_factory=lambda: wander(np.random.default_rng(1), 2_000, 0.05))
    track: Track = field(default_factory=lambda: Track(10_000))

    @property
    def utime(self) -> int:
        return (FIRST + 10 * self.seconds) * GRID_US

    @property
    def own(self) -> PairEnd:
        return PairEnd(self.track, self.graph.chains[OWN.robot])

    def drive(self, seconds: int) -> None:
        """Samples and ranges at 10 Hz, a keyframe each second."""
        for _ in range(seconds):
            for k in range(10 * self.seconds, 10 * self.seconds + 10):
                n, pose = FIRST + k, self.path[k]
                self.track.append(n, np.round(pose / RESOLUTION))
                self.ranges.add(n * GRID_US, float(np.hypot(*(pose[:2] - self.node))))
            keyframe = keyframes([n], [pose])
            self.graph.insert(OWN, GraphEntry(self.seconds, model_of(NOISE), keyframe))
            self.seconds += 1

    def say(
        self, closures: list[ClosureMeasurement], ranges: list[RangeMeasurement] | None = None
    ) -> None:
        """Put it into the own log."""
        entry = GraphEntry(10_000 + self.seconds, None, (), tuple(ranges or ()), tuple(closures))
        self.graph.insert(OWN, entry)

    def estimate(self, number: int, place: Array, n: int = 0) -> TeamEstimate:
        """A solution: the robot where it is, and something at a place (2,)."""
        data = self.graph.chains[OWN.robot].keyframes
        return TeamEstimate(
            Segment(*OWN, 0),
            {OWN.robot: Trajectory(OWN, data.n, data.poses)},
            joint=1e-3 * np.eye(6),
            nodes={number: Trajectory(Chain(number, 1), np.array([n]), np.array([[*place, 0.0]]))},
            points=frozenset([number]),
        )
