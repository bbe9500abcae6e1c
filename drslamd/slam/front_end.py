"""Modules 1 and 2 as one robot runs them: keyframes, ranges and closures for the pose graph."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from drslamd.config import Config
from drslamd.conventions import SECOND_US, Chain
from drslamd.sensors.samples import Motion, RangeSample
from drslamd.slam.calibration.calibration_store import UNLEARNED, SensorCalibration
from drslamd.slam.calibration.window_calibration import PairCalibration, calibrated_window
from drslamd.slam.consistency.pair import Checked, PairTracker
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement, Keyframe, RangeMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.odometry.track import STEPS, DeadReckoning, OdometryNoise
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.relative_pose import solver
from drslamd.slam.relative_pose.pair_window import PairEnd, Request, request
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.solver import RelativePoseEstimate
from drslamd.slam.relative_pose.window_noise import RangeNoise

KEYFRAME_M, KEYFRAME_RAD = 0.05, 0.05
"""A robot that moved less than this since its last keyframe makes no new one."""
MAX_UWB_IDS = 64
"""Modules whose ranges are remembered, 2 MB; a radio cell holds no more."""
RANGES_FRESH_US = 3 * SECOND_US


class FrontEnd:
    """What this robot measures, prepared for the graph."""

    def __init__(self, config: Config, own: Chain, known: SensorCalibration = UNLEARNED) -> None:
        """
        Args:
            known: of our sensors, from before this start; it is taken out of what they say.
        """
        self._config = config
        self._own = own
        self._known = known
        self.noise = self._known.narrowed(OdometryNoise.from_config(config.odometry))
        self.reckoning = DeadReckoning()
        self.ranges: dict[int, RangeBuffer] = {}
        self.pairs: dict[int, PairTracker] = {}
        self._segment = 0
        self._segment_start: int | None = None
        self._last: Keyframe | None = None

    def on_motion(self, motion: Motion) -> None:
        self.reckoning.add(self._known.corrected(motion))

    def on_range(self, sample: RangeSample) -> None:
        if sample.peer_uwb_id not in self.ranges:
            if len(self.ranges) >= MAX_UWB_IDS and not self._forget_silent(sample.utime):
                return
            self.ranges[sample.peer_uwb_id] = RangeBuffer(self._config.relative_pose.nlos_db)
        buffer = self.ranges[sample.peer_uwb_id]
        buffer.add(sample.utime, sample.range_m, sample.power_gap_db)

    def _forget_silent(self, utime: int) -> bool:
        """Make room: forget the module that was silent longest, unless all are heard."""
        oldest = min(self.ranges, key=lambda uwb_id: self.ranges[uwb_id].newest or 0)
        if self.ranges[oldest].is_fresh(utime, RANGES_FRESH_US):
            return False
        del self.ranges[oldest]
        return True

    def ranged(self, utime: int) -> list[int]:
        """UWB ids to which ranges came in of late."""
        return [u for u, b in self.ranges.items() if b.is_fresh(utime, RANGES_FRESH_US)]

    @property
    def traits(self) -> tuple[float, ...]:
        """What the team must know of this robot's sensors (see `GraphEntry`)."""
        n, uwb = self.noise, self._config.uwb
        return (n.scale, n.yaw_rad_per_m, n.translation_per_sqrt_m, n.yaw_rad_per_sqrt_m,
                uwb.antenna_x_m, uwb.antenna_y_m, uwb.antenna_z_m)  # fmt: skip

    def keyframe(self) -> Keyframe | None:
        """The latest sample of our odometry, if we moved since the last keyframe."""
        track = self.reckoning.track
        if not len(track):
            return None
        if self._segment_start is not None and track.segment_start > self._segment_start:
            self._segment += 1
            self._last = None
        self._segment_start = track.segment_start
        n = track.end - 1
        x, y, theta = (int(v) for v in track.steps(n, 1)[0])
        if self._last is not None:
            last = self._last
            moved = np.array([x - last.x, y - last.y, theta - last.theta]) * STEPS
            if np.hypot(moved[0], moved[1]) < KEYFRAME_M and abs(moved[2]) < KEYFRAME_RAD:
                return None
        self._last = Keyframe(n, self._segment, x, y, theta)
        return self._last

    # ---- pairs ----

    def _owns(self, peer: PeerInRange) -> bool:
        """Are we the one of the two that makes closures?"""
        return self._own.robot < peer.chain.robot or not peer.ranges_to_us

    def needed(self, neighbours: list[PeerInRange], utime: int) -> set[int]:
        """Robots whose odometry our windows need."""
        mine = self.ranged(utime)
        return {p.chain.robot for p in neighbours if self._owns(p) and p.uwb_id in mine}

    def _sides(
        self, neighbours: list[PeerInRange], graph: PoseGraph, utime: int
    ) -> list[tuple[PairTracker, PairEnd, PairEnd]]:
        """Owned pairs for which everything is at hand: ranges, both odometries, one clock."""
        own = graph.chains.get(self._own.robot)
        if own is None:
            return []
        a = PairEnd(self.reckoning.track, own)
        out = []
        for peer in neighbours:
            robot, ranges = peer.chain.robot, self.ranges.get(peer.uwb_id)
            items = graph.chains.get(robot)
            if ranges is None or not ranges.is_fresh(utime, RANGES_FRESH_US):
                continue
            if not self._owns(peer) or items is None or items.chain != peer.chain:
                continue
            pair = self.pairs.get(robot)
            if pair is None or pair.peer != peer.chain:
                pair = self.pairs[robot] = PairTracker(self._config, peer.chain, ranges)
            pair.ranges = ranges
            ranges.bias_m = self._known.bias_to(robot).value
            if peer.ahead_us is None:
                pair.count("clock of the peer not known well enough")
            else:
                out.append((pair, a, PairEnd(peer.track, items, peer.ahead_us)))
        return out

    def module1(
        self,
        neighbours: list[PeerInRange],
        graph: PoseGraph,
        estimate: TeamEstimate | None,
        utime: int,
    ) -> list[tuple[PairTracker, Request, Callable[[], RelativePoseEstimate]]]:
        """The relative poses to be computed now: pair, window, computation.

        Args:
            estimate: the team's last solution, for what it learned of the sensors.
        """
        out = []
        for pair, a, b in self._sides(neighbours, graph, utime):
            window = request(pair.ranges, a, b, self._config.relative_pose)
            if isinstance(window, str):
                pair.count(window)
            else:
                out.append((pair, window, self._computation(pair, window, b, estimate)))
        return out

    def _computation(
        self, pair: PairTracker, what: Request, b: PairEnd, estimate: TeamEstimate | None
    ) -> Callable[[], RelativePoseEstimate]:
        section, peer = self._config.relative_pose, pair.peer.robot
        if section.algorithm == "paper":
            return partial(solver.solve_paper, what.window, section.range_sigma_m, section.delta)
        bias_sigma = self._known.bias_sigma(peer, section.range_bias_sigma_m)
        ranges = RangeNoise(section.range_sigma_m, bias_sigma)
        noise = solver.PairNoise(ranges, self.noise, b.items.noise)
        sensors = PairCalibration.of(
            estimate if section.self_calibration else None, self._own.robot, peer
        )
        return partial(solver.solve, *calibrated_window(what.window, noise, sensors), section.delta)

    def module2(self, graph: PoseGraph) -> list[tuple[PairTracker, Callable[[], Checked]]]:
        """The consistency checks to be computed now: pair, computation."""
        out = []
        own = graph.chains.get(self._own.robot)
        for robot, pair in self.pairs.items():
            items = graph.chains.get(robot)
            if own is None or items is None or items.chain != pair.peer:
                continue
            job = pair.check(own, items, self.noise)
            if job is not None:
                out.append((pair, job))
        return out

    def range_items(
        self, neighbours: list[PeerInRange], graph: PoseGraph, utime: int
    ) -> list[RangeMeasurement]:
        """New distances for the graph."""
        sides = self._sides(neighbours, graph, utime)
        items = [pair.range_items.next(pair.ranges, a, b, pair.peer) for pair, a, b in sides]
        return [item for item in items if item is not None]

    def closure_items(self) -> list[ClosureMeasurement]:
        """Closures to tell the team, and to withdraw."""
        every = self._config.optimizer.algorithm != "banded"
        return [item for pair in self.pairs.values() for item in pair.news(every)]
