"""Modules 1 and 2 as one robot runs them: keyframes, ranges and closures for the pose graph."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from drslamd.config import Config
from drslamd.conventions import SECOND_US, Chain
from drslamd.sensors.samples import Motion, RangeSample
from drslamd.slam import settings
from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.calibration.window_calibration import PairCalibration
from drslamd.slam.consistency.pair import Checked, PairTracker
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement, Keyframe, RangeMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.odometry.dead_reckoning import DeadReckoning
from drslamd.slam.odometry.track import RESOLUTION
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose.estimate import PairNoise, RelativePoseEstimate
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.range_sampler import RangeSampler
from drslamd.slam.relative_pose.window_request import WindowRequest, request
from drslamd.slam.tuning import DEFAULTS, Tuning

KEYFRAME_M = 0.05
"""A robot that moved less than this since its last keyframe, and turned less than `KEYFRAME_RAD`,
makes no new one."""
KEYFRAME_RAD = 0.05
"""See `KEYFRAME_M`."""
MAX_UWB_IDS = 64
"""Modules whose ranges are remembered, 2 MB; a radio cell holds no more."""
RANGES_FRESH_US = 3 * SECOND_US
"""A module that was silent for longer is not in range."""


class Measurable(NamedTuple):
    """An owned pair, and both its robots, with everything at hand that a measurement needs."""

    pair: PairTracker
    a: PairEnd
    b: PairEnd


class WindowJob(NamedTuple):
    """Module 1 on one window: whose, which, and the computation."""

    pair: PairTracker
    request: WindowRequest
    run: Callable[[], RelativePoseEstimate]


class FrontEnd:
    """What this robot measures, prepared for the graph."""

    def __init__(
        self,
        config: Config,
        own: Chain,
        known: SensorCalibration = UNLEARNED,
        tuning: Tuning = DEFAULTS,
    ) -> None:
        """
        Args:
            known: of our sensors, from before this start; it is taken out of what they say.
        """
        section = config.relative_pose
        self._own = own
        self._known, self._range_model = known, tuning.ranges
        self._method = settings.closure_method(section, tuning)
        self._range_sigma, self._bias_sigma = section.range_sigma_m, section.range_bias_sigma_m
        self._nlos_db, self._epsilon = section.nlos_db, config.consistency.epsilon
        self._has_ranges_in_graph = config.optimizer.algorithm == "banded"
        noise = known.narrowed(settings.odometry_noise(config.odometry))
        self.model = settings.robot_model(config, noise)
        self.reckoning = DeadReckoning()
        self.ranges: dict[int, RangeBuffer] = {}
        self.pairs: dict[int, PairTracker] = {}
        self._segment = 0
        self._segment_start: int | None = None
        self._last: Keyframe | None = None

    # ---- sensors ----

    def on_motion(self, motion: Motion) -> None:
        self.reckoning.add(self._known.corrected(motion))

    def on_range(self, sample: RangeSample) -> None:
        if sample.peer_uwb_id not in self.ranges:
            if len(self.ranges) >= MAX_UWB_IDS and not self._forget_silent(sample.utime):
                return
            self.ranges[sample.peer_uwb_id] = RangeBuffer(self._nlos_db, self._range_model)
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

    # ---- keyframes ----

    def make_keyframe(self) -> Keyframe | None:
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
            moved = np.array([x - last.x, y - last.y, theta - last.theta]) * RESOLUTION
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

    def update_pairs(self, neighbours: list[PeerInRange], graph: PoseGraph, utime: int) -> None:
        """Begin to track the pairs that we own, and those of a peer that started again."""
        for peer in self._measured(neighbours, graph, utime):
            robot, ranges = peer.chain.robot, self.ranges[peer.uwb_id]
            ranges.bias_m = self._known.bias_to(robot).value
            known = self.pairs.get(robot)
            if known is None or known.peer != peer.chain:
                sampler = RangeSampler(self._range_sigma, self._range_model)
                self.pairs[robot] = PairTracker(
                    peer.chain, ranges, sampler, self._epsilon, self._method.agreement
                )
            self.pairs[robot].ranges = ranges

    def _measured(
        self, neighbours: list[PeerInRange], graph: PoseGraph, utime: int
    ) -> Iterator[PeerInRange]:
        """Peers of owned pairs to which ranges come in and whose log has begun."""
        if self._own.robot not in graph.chains:
            return
        for peer in neighbours:
            ranges, data = self.ranges.get(peer.uwb_id), graph.chains.get(peer.chain.robot)
            is_fresh = ranges is not None and ranges.is_fresh(utime, RANGES_FRESH_US)
            if is_fresh and self._owns(peer) and data is not None and data.chain == peer.chain:
                yield peer

    def _measurable(
        self, neighbours: list[PeerInRange], graph: PoseGraph, utime: int
    ) -> list[Measurable]:
        """Tracked pairs with ranges, both odometries and one clock."""
        out = []
        for peer in self._measured(neighbours, graph, utime):
            pair = self.pairs.get(peer.chain.robot)
            if pair is not None and pair.peer == peer.chain and peer.ahead_us is not None:
                a = PairEnd(self.reckoning.track, graph.chains[self._own.robot])
                b = PairEnd(peer.track, graph.chains[peer.chain.robot], peer.ahead_us)
                out.append(Measurable(pair, a, b))
        return out

    # ---- module 1 ----

    def module1(
        self,
        neighbours: list[PeerInRange],
        graph: PoseGraph,
        estimate: TeamEstimate | None,
        utime: int,
    ) -> list[WindowJob]:
        """Begin the relative poses to be computed now; windows that are none are counted.

        Args:
            estimate: the team's last solution, for what it learned of the sensors.
        """
        self.update_pairs(neighbours, graph, utime)
        self._count_unknown_clocks(neighbours, graph, utime)
        out = []
        for pair, a, b in self._measurable(neighbours, graph, utime):
            window = request(pair.ranges, a, b, self._method.rule, self._range_model)
            if isinstance(window, str):
                pair.count(window)
            else:
                run = self._computation(pair, window, b, estimate)
                out.append(WindowJob(pair, window, run))
        return out

    def _count_unknown_clocks(
        self, neighbours: list[PeerInRange], graph: PoseGraph, utime: int
    ) -> None:
        for peer in self._measured(neighbours, graph, utime):
            if peer.ahead_us is None:
                self.pairs[peer.chain.robot].count("clock of the peer not known well enough")

    def _computation(
        self, pair: PairTracker, found: WindowRequest, b: PairEnd, estimate: TeamEstimate | None
    ) -> Callable[[], RelativePoseEstimate]:
        peer = pair.peer.robot
        bias_sigma = self._known.bias_sigma(peer, self._bias_sigma)
        noise = PairNoise(
            RangeNoise(self._range_sigma, bias_sigma),
            self.model.noise,
            b.data.model.noise,
            self._range_model,
        )
        team = estimate if self._method.uses_calibration else None
        known = PairCalibration.of(team, self._own.robot, peer)
        return partial(self._method.solve, found.window, noise, known)

    # ---- module 2 ----

    def module2(self, graph: PoseGraph) -> list[tuple[PairTracker, Callable[[], Checked]]]:
        """Begin the consistency checks to be computed now: pair, computation."""
        out = []
        own = graph.chains.get(self._own.robot)
        for robot, pair in self.pairs.items():
            data = graph.chains.get(robot)
            if own is None or data is None or data.chain != pair.peer:
                continue
            job = pair.begin_check(own, data, self.model.noise)
            if job is not None:
                out.append((pair, job))
        return out

    # ---- what goes into our log ----

    def sample_ranges(
        self, neighbours: list[PeerInRange], graph: PoseGraph, utime: int
    ) -> list[RangeMeasurement]:
        """New distances for the graph, where module 3 knows what to do with them."""
        if not self._has_ranges_in_graph:
            return []
        self.update_pairs(neighbours, graph, utime)
        found = [
            pair.sampler.sample(pair.ranges, a, b, pair.peer)
            for pair, a, b in self._measurable(neighbours, graph, utime)
        ]
        return [measurement for measurement in found if measurement is not None]

    def tell_closures(self) -> list[ClosureMeasurement]:
        """Closures to tell the team, and to withdraw."""
        return [c for pair in self.pairs.values() for c in pair.tell(not self._has_ranges_in_graph)]
