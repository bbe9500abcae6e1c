"""A front end that drives beside a peer, with exact ranges between them."""

from __future__ import annotations

import math

import numpy as np
from slam_scenes import Array, config, inverted, product

from drslamd.conventions import GRID_US, Chain
from drslamd.sensors.samples import Motion, RangeSample
from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.front_end import FrontEnd, WindowJob
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import GraphEntry, Keyframe, RangeMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.odometry.track import Track
from drslamd.slam.peer_in_range import PeerInRange

SECONDS = 25.0
"""Of driving, until a window tells where the peer is."""
STEP_M = 0.06
"""Of both robots, each tenth of a second."""
TURNS = {0: 0.05, 1: -0.03}
"""Of our robot and of the peer, rad each tenth of a second: two circles."""
APART_M = 6.0


class FrontScene:
    """Both begin at sample 1 of one clock, each in the origin of its odometry.

    Attributes:
        graph: with a keyframe of each robot a second, of those in `logs`.
        utime, last_range, last_keyframe: now, and when the last ones came (the last as a sample).
    """

    def __init__(
        self,
        robot: int = 0,
        peer: int = 1,
        *,
        extra: str = "",
        known: SensorCalibration = UNLEARNED,
        ranges_to_us: bool = True,
        clock_is_known: bool = True,
        logs: tuple[int, ...] = (0, 1),
    ) -> None:
        self.own, self.peer = Chain(robot, 1), Chain(peer, 1)
        self.front = FrontEnd(config(robot, extra), self.own, known)
        self.graph = PoseGraph()
        self._distances: list[float] = []
        self.utime = self.last_range = self.last_keyframe = 0
        self._ranges_to_us, self._clock_is_known = ranges_to_us, clock_is_known
        self._logs = logs
        self._track = Track(1800)
        self._poses = {0: np.zeros(3), 1: np.array([APART_M, 0.0, 1.0])}
        self._origin = self._poses[1].copy()
        self._paths: dict[int, list[Array]] = {0: [], 1: []}
        self._n = self._seq = 0

    def drive(self, seconds: float) -> None:
        """Let time pass; the last sample of each second becomes a keyframe of both."""
        for _ in range(round(10 * seconds)):
            self._step()

    def _step(self) -> None:
        self._n += 1
        self.utime = self._n * GRID_US
        first = self._n == 1
        for who, turn in TURNS.items():
            if not first:
                # along the chord of the arc, which is seen from half the turn
                chord = STEP_M * math.sin(turn / 2) / (turn / 2)
                half = (0.0, 0.0, turn / 2)
                moved = product(half, (chord, 0.0, 0.0), half)
                heading = self._poses[who][2] + turn
                self._poses[who] = np.append(product(self._poses[who], moved)[:2], heading)
            self._paths[who].append(self._poses[who])
        step, turn = (0.0, 0.0) if first else (STEP_M, TURNS[0])
        self.front.on_motion(Motion(self.utime, step, turn))
        here, there = self._odometry(0), self._odometry(1)
        self._track.append(self._n, np.round(there * 1e4))
        self._distances.append(float(np.hypot(*(self._poses[1] - self._poses[0])[:2])))
        self.front.on_range(RangeSample(self.utime, self.peer.robot, self._distances[-1], 0.0))
        self.last_range = self.utime
        if self._n % 10 == 0 or first:
            self._keyframe(here, there)

    def _odometry(self, who: int) -> Array:
        """Where a robot is in its own odometry, heading counted on."""
        origin = self._paths[who][0]
        place = product(inverted(origin), self._poses[who])[:2]
        return np.append(place, self._poses[who][2] - origin[2])

    def _keyframe(self, here: Array, there: Array) -> None:
        self.last_keyframe = self._n
        for who, (chain, pose) in enumerate(((self.own, here), (self.peer, there))):
            x, y, theta = (round(float(v) * 1e4) for v in pose)
            frame = Keyframe(self._n, 0, x, y, theta)
            if who in self._logs:
                self.graph.insert(chain, GraphEntry(self._seq, keyframes=(frame,)))
        self._seq += 1

    def restart_peer(self) -> None:
        """The peer begins again; its log has not arrived yet."""
        self.peer = Chain(self.peer.robot, self.peer.epoch + 1)
        self._track = Track(1800)

    def seen(self, n: int) -> Array:
        """True pose of the peer in our body at sample n."""
        return product(inverted(self._paths[0][n - 1]), self._paths[1][n - 1])

    def distances(self, n: Array | float) -> Array:
        """Between both robots at fractional samples, m."""
        return np.asarray(np.interp(n, np.arange(1, self._n + 1), self._distances))

    def neighbour(self, uwb_id: int | None = None) -> PeerInRange:
        return PeerInRange(
            self.peer,
            self.peer.robot if uwb_id is None else uwb_id,
            self._ranges_to_us,
            self._track,
            0 if self._clock_is_known else None,
        )

    def module1(self, estimate: TeamEstimate | None = None) -> list[WindowJob]:
        return self.front.module1([self.neighbour()], self.graph, estimate, self.utime)

    def sample_ranges(self) -> list[RangeMeasurement]:
        return self.front.sample_ranges([self.neighbour()], self.graph, self.utime)
