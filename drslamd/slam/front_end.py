"""Modules 1 and 2 as one robot runs them: keyframes, ranges and closures for the pose graph."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import NamedTuple

from drslamd.config import Config
from drslamd.conventions import Chain
from drslamd.sensors.samples import Motion, RangeSample
from drslamd.slam import settings
from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.calibration.window_calibration import PairCalibration
from drslamd.slam.closure_method import PairWindow
from drslamd.slam.consistency.checked import Checked
from drslamd.slam.consistency.measurable import Measurable, behind_lapses
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.doubt import Partners
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement, Keyframe, RangeMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.hypotheses.places_left import PlacesLeft, places_left
from drslamd.slam.keyframe_selector import KeyframeSelector
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.odometry.dead_reckoning import DeadReckoning
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.points.joiner import Joiner
from drslamd.slam.points.point_tracker import Sensors
from drslamd.slam.points.points import Points
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.range_watch import Partner, RangeWatch
from drslamd.slam.relative_pose.estimate import PairNoise, RelativePoseEstimate
from drslamd.slam.relative_pose.mistakes import what_if
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RANGES_FRESH_US, RangeBuffers
from drslamd.slam.relative_pose.range_sampler import RangeSampler
from drslamd.slam.relative_pose.window_request import WindowRequest, request
from drslamd.slam.relocation.last_place import LastPlace
from drslamd.slam.relocation.relocation import Relocation
from drslamd.slam.relocation.resumption import Resumption
from drslamd.slam.relocation.sightings import Own
from drslamd.slam.robot_model import with_gyro
from drslamd.slam.se2 import Array
from drslamd.slam.tuning import DEFAULTS, Tuning


class WindowJob(NamedTuple):
    """Work for module 1: whose window, which, and what is known of the sensors."""

    pair: PairTracker
    request: WindowRequest
    given: PairWindow


class WhatIfJob(NamedTuple):
    """A search for mistakes in the mountings of a pair, by one window: chi-squared of each case,
    and how far the robot drove that drove less."""

    pair: PairTracker
    request: WindowRequest
    run: Callable[[], tuple[Array, float]]


class FrontEnd:
    """What this robot measures, prepared for the graph."""

    def __init__(
        self,
        config: Config,
        own: Chain,
        known: SensorCalibration = UNLEARNED,
        tuning: Tuning = DEFAULTS,
        last: LastPlace | None = None,
    ) -> None:
        """
        Args:
            known: of our sensors, from before this start; it is taken out of what they say.
            last: where we were then.
        """
        section = config.relative_pose
        self.own, self._known, self._range_model = own, known, tuning.ranges
        self._method = settings.closure_method(section, tuning)
        self._range_sigma, self._bias_sigma = section.range_sigma_m, section.range_bias_sigma_m
        self._delta = section.delta
        self._nlos_db, self._epsilon = section.nlos_db, config.consistency.epsilon
        self._has_ranges_in_graph = config.optimizer.algorithm == "banded"
        noise = known.narrowed(settings.odometry_noise(config.odometry))
        self.model = known.mounted(settings.robot_model(config, noise))
        self.reckoning = DeadReckoning()
        self.ranges = RangeBuffers(self._nlos_db, self._range_model)
        self.pairs: dict[int, PairTracker] = {}
        self.watch = RangeWatch(section.range_sigma_m, tuning.ranges)
        who = Own(own.robot, self.model, section.range_sigma_m, tuning.ranges)
        self.relocation, self.resumption = Relocation(who), Resumption(who, last)
        sensors = Sensors(RangeNoise(section.range_sigma_m, self._bias_sigma), tuning.ranges)
        self.points, self.joiner = Points(own, sensors), Joiner(own, sensors)
        self._keyframes = KeyframeSelector()

    # sensors

    def on_motion(self, motion: Motion) -> None:
        self.reckoning.add(self._known.corrected(motion))
        self.model = with_gyro(self.model, motion)

    def interrupt(self) -> None:
        """Nobody watched for a while: no window spans it."""
        self.reckoning.interrupt()

    def on_range(self, sample: RangeSample) -> None:
        self.ranges.add(sample)

    def ranged(self, utime: int) -> list[int]:
        """UWB ids to which ranges came in of late."""
        return self.ranges.fresh(utime)

    def make_keyframes(self, is_doubted: bool = False, is_odd: bool = False) -> list[Keyframe]:
        """See `KeyframeSelector.made`."""
        return self._keyframes.made(self.reckoning.track, is_doubted, is_odd)

    # pairs

    def watch_ranges(
        self,
        neighbours: list[PeerInRange],
        graph: PoseGraph,
        estimate: TeamEstimate | None,
        utime: int,
    ) -> None:
        """Hold the ranges of this second against where everybody should be."""
        own = graph.chains.get(self.own.robot)
        partners: dict[int, Partner] = {}
        for peer in neighbours if own is not None else ():
            ranges, data = self.ranges.get(peer.uwb_id), graph.chains.get(peer.chain.robot)
            is_fresh = ranges is not None and ranges.is_fresh(utime, RANGES_FRESH_US)
            if is_fresh and data is not None and peer.ahead_us is not None:
                assert ranges is not None
                known = Partner(data, peer.ahead_us, ranges, peer.clocks_since_us)
                partners[peer.chain.robot] = known
        if own is not None:
            self.watch.look(estimate, PairEnd(self.reckoning.track, own), partners, utime)

    def _owns(self, peer: PeerInRange) -> bool:
        """Are we the one of the two that makes closures?"""
        return self.own.robot < peer.chain.robot or not peer.ranges_to_us

    def needed(self, neighbours: list[PeerInRange], utime: int) -> set[int]:
        """Robots whose odometry our windows need."""
        mine = self.ranged(utime)
        lost = self.relocation.is_lost or self.resumption.is_waiting
        return {p.chain.robot for p in neighbours if (lost or self._owns(p)) and p.uwb_id in mine}

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
        if self.own.robot not in graph.chains:
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
                a = PairEnd(self.reckoning.track, graph.chains[self.own.robot])
                data, since = graph.chains[peer.chain.robot], peer.clocks_since_us
                b = PairEnd(peer.track, data, peer.ahead_us, since)
                out.append(Measurable(pair, a, b))
        return out

    # module 1

    def module1(
        self,
        neighbours: list[PeerInRange],
        graph: PoseGraph,
        estimate: TeamEstimate | None,
        utime: int,
    ) -> list[WindowJob]:
        """Begin the relative poses to be computed now; windows that are none are counted, and one
        that ends where the last one did is not asked again.

        Args:
            estimate: the team's last solution, for what it learned of the sensors.
        """
        self.update_pairs(neighbours, graph, utime)
        self._count_unknown_clocks(neighbours, graph, utime)
        out = []
        found = self._measurable(neighbours, graph, utime)
        for pair, a, b in behind_lapses(found, estimate):
            window = request(pair.ranges, a, b, self._method.rule, self._range_model)
            if isinstance(window, str):
                pair.count(window)
            elif not pair.history or pair.history[-1].utime != window.utime:
                known = self._calibration(pair, estimate)
                given = PairWindow(window.window, self._noise(pair, b), known)
                out.append(WindowJob(pair, window, given))
        return out

    def _count_unknown_clocks(
        self, neighbours: list[PeerInRange], graph: PoseGraph, utime: int
    ) -> None:
        for peer in self._measured(neighbours, graph, utime):
            if peer.ahead_us is None:
                self.pairs[peer.chain.robot].count("clock of the peer not known well enough")

    def solve(self, windows: Sequence[PairWindow]) -> list[RelativePoseEstimate]:
        """Module 1 on windows of several pairs at once."""
        return self._method.solve(windows)

    def _noise(self, pair: PairTracker, b: PairEnd) -> PairNoise:
        bias_sigma = self._known.bias_sigma(pair.peer.robot, self._bias_sigma)
        ranges = RangeNoise(self._range_sigma, bias_sigma)
        return PairNoise(ranges, self.model.noise, b.data.model.noise, self._range_model)

    def _calibration(self, pair: PairTracker, estimate: TeamEstimate | None) -> PairCalibration:
        found = pair.search.found
        return PairCalibration.of(self._used(estimate), self.own.robot, pair.peer.robot, found)

    def _used(self, estimate: TeamEstimate | None) -> TeamEstimate | None:
        """What was learned, where it serves modules 1 and 2."""
        return estimate if self._method.uses_calibration else None

    def _corrections(
        self, pair: PairTracker, estimate: TeamEstimate | None
    ) -> tuple[Correction, Correction] | None:
        """Of our odometry and a peer's; a solution that was not reached says nothing of them, and
        nothing that was found along corrected tracks is given up for it."""
        team = self._used(estimate)
        if pair.search.found is None and (team is None or not team.converged):
            return None
        known = self._calibration(pair, estimate)
        return known.a.correction, known.b.correction

    def what_if(
        self,
        neighbours: list[PeerInRange],
        graph: PoseGraph,
        estimate: TeamEstimate | None,
        utime: int,
    ) -> list[WhatIfJob]:
        """Begin the searches for mistakes in mountings that are due, where windows disagree."""
        out = []
        measurable = self._measurable(neighbours, graph, utime)
        for pair, a, b in behind_lapses(measurable, estimate):
            search, awaits = pair.search, pair.awaits_confirmation
            if not (self._method.agreement.confirms and search.is_due(utime, awaits)):
                continue
            found = request(pair.ranges, a, b, self._method.rule, self._range_model)
            if isinstance(found, str):
                continue
            search.begin(utime, awaits)
            run = search.question(what_if.ask(found, a, b), self._noise(pair, b), self._delta)
            out.append(WhatIfJob(pair, found, run))
        return out

    def partners_by_windows(self, solved: Collection[int]) -> tuple[Partners, Partners]:
        """Robots of our pairs that are in a solution, and those with whom windows disagree; and
        those with whom another track or scale fits better."""
        searches = {robot: pair.search for robot, pair in self.pairs.items() if robot in solved}
        seen = frozenset(searches)
        wrong = frozenset(robot for robot in seen if searches[robot].disagrees)
        contested = frozenset(robot for robot in seen if searches[robot].is_contested)
        return Partners(seen, wrong), Partners(seen, contested)

    def places_left(
        self, neighbours: list[PeerInRange], graph: PoseGraph, utime: int
    ) -> list[PlacesLeft]:
        """Where peers may be whose pairs are not connected yet."""
        found = (
            places_left(pair, a, b, self._range_sigma)
            for pair, a, b in self._measurable(neighbours, graph, utime)
        )
        return [left for left in found if left is not None]

    # module 2

    def module2(
        self, graph: PoseGraph, estimate: TeamEstimate | None, only: PairTracker | None = None
    ) -> list[tuple[PairTracker, Callable[[], Checked]]]:
        """Begin the consistency checks to be computed now: pair, computation.

        Args:
            estimate: see `module1`.
            only: of this pair; of all where it is None.
        """
        out = []
        own = graph.chains.get(self.own.robot)
        for robot, pair in self.pairs.items():
            if only not in (None, pair):
                continue
            data = graph.chains.get(robot)
            if own is None or data is None or data.chain != pair.peer:
                continue
            corrections = self._corrections(pair, estimate)
            job = pair.begin_check(own, data, self.model.noise, corrections)
            if job is not None:
                out.append((pair, job))
        return out

    # what goes into our log

    def sample_ranges(
        self,
        neighbours: list[PeerInRange],
        graph: PoseGraph,
        utime: int,
        is_doubted: bool = False,
    ) -> list[RangeMeasurement]:
        """New distances for the graph, where module 3 knows what to do with them.

        Args:
            is_doubted: see `make_keyframes`; of who makes them or of any other.
        """
        if not self._has_ranges_in_graph:
            return []
        self.update_pairs(neighbours, graph, utime)
        found = [
            pair.sampler.sample(pair.ranges, a, b, pair.peer, is_doubted)
            for pair, a, b in self._measurable(neighbours, graph, utime)
        ]
        told = [measurement for measurement in found if measurement is not None]
        return told + self.points.tell_ranges()

    def tell_closures(self) -> list[ClosureMeasurement]:
        """Closures to tell the team, and to withdraw."""
        every = not self._has_ranges_in_graph
        told = [c for pair in self.pairs.values() for c in pair.tell(every)]
        placed = [*self.relocation.tell(), *self.resumption.tell()]
        return [*told, *placed, *self.points.tell(), *self.joiner.tell()]
