"""A robot that lost its odometry for a while: where it is meanwhile, and where it goes on.

While nothing is known of its way a cloud of places says where it may be: a position without a
heading. What its wheels count after the hole is a segment of its own that nothing joins to the
rest. As soon as ranges to localised peers allow one place for it only, this robot says so as a
closure in its log; then module 3 has it, on all robots alike. Until module 3 knows as much of the
heading, the placing is asked again and is where the robot is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drslamd.conventions import GRID_US, SECOND_US, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import PoseNow, TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.odometry.track import Track
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relocation.cloud import STEP_S, Cloud
from drslamd.slam.relocation.placed_pose import PlacedPose, placed_pose
from drslamd.slam.relocation.placing import Prior
from drslamd.slam.relocation.question import (
    Found,
    closure,
    is_vague,
    known_until,
    last_keyframe,
    localised_peers,
    question,
)
from drslamd.slam.relocation.sightings import Beacon, Own, sightings
from drslamd.slam.se2 import Array

LOST_US = SECOND_US
"""Odometry that is silent for longer has a hole."""
BLIND_US = 3 * SECOND_US
"""After so long without a range the cloud says nothing any more."""
FIRST_NUMBER = 2**30
"""Of closures; windows count from 0 and never come so far."""
AGAIN_US = 4 * SECOND_US
"""A closure has joined us to the others by then, or another one is needed."""
SETTLES_US = 10 * SECOND_US
"""So long at most after a closure a placing says where we are: then module 3 must know."""
ANY_HEADING_RAD = math.pi / math.sqrt(3)
"""Sigma of a heading of which nothing is known."""


@dataclass(frozen=True)
class _Hole:
    """Where the way is lost: last pose of before, its covariance and its time, us."""

    frame: Segment
    pose: Array
    covariance: Array
    utime: int


class ByRanges(NamedTuple):
    """A position whose heading means nothing, and since when there is no odometry to it, us."""

    pose: PoseNow
    age_us: int


class Relocation:
    """Of one robot.

    Attributes:
        verdict: why no place is named yet for what the wheels count; empty while they are silent.
    """

    def __init__(self, own: Own) -> None:
        self._own = own
        self.verdict = ""
        self._hole: _Hole | None = None
        self._cloud: Cloud | None = None
        self._until = 0
        self._sighted = 0
        self._peers_covariance = np.zeros((2, 2))
        self._speed = 0.0
        self._prior: Prior | None = None
        self._prior_start = -1
        self._told_at: int | None = None
        self._is_joined = False
        """Has module 3 what follows the hole?"""
        self._placed: PlacedPose | None = None
        """The last answer."""
        self._number = FIRST_NUMBER
        self._closures: list[ClosureMeasurement] = []

    @property
    def is_lost(self) -> bool:
        return self._hole is not None

    def since_us(self) -> int | None:
        """When the hole began; None while there is none."""
        return self._hole.utime if self._hole else None

    def look(
        self,
        neighbours: list[PeerInRange],
        ranges: Mapping[int, RangeBuffer],
        track: Track,
        graph: PoseGraph,
        estimate: TeamEstimate | None,
        speed: Callable[[], float],
        utime: int,
    ) -> Callable[[], Found] | None:
        """Once a second: carry the cloud on; a computation that places what follows the hole.

        Args:
            speed: how fast we drive, m/s; asked for only in a hole.
        """
        hole = _hole(estimate, self._own, track, utime)
        self._is_joined = hole is None
        if hole is None and estimate is not None and self._knows_more(estimate, utime):
            hole = self._hole
        if hole is None or estimate is None:
            self._hole = self._cloud = self._prior = self._told_at = self._placed = None
            return None
        data = graph.chains.get(self._own.robot)
        own = PairEnd(track, data) if data is not None else None
        if own is None:
            return None
        if self._hole is None or self._hole.frame != hole.frame:
            self._cloud = self._prior = self._placed = None
        self._hole, self._speed = hole, speed()
        beacons = localised_peers(neighbours, ranges, graph, estimate)
        until = known_until(beacons, utime)
        self._carry(beacons, estimate, own, until, utime)
        return self._placing(beacons, estimate, own, utime)

    # while nothing is known of the way

    def _carry(
        self, beacons: list[Beacon], estimate: TeamEstimate, own: PairEnd, until: int, utime: int
    ) -> None:
        """Bring the cloud to `until`."""
        hole = self._hole
        assert hole is not None
        if utime - max(self._sighted, hole.utime) > BLIND_US:
            self._cloud = None
        if self._cloud is None:
            way = self._speed * max(0, until - BLIND_US - hole.utime) / SECOND_US
            wide = hole.covariance[:2, :2] + way**2 * np.eye(2)
            self._cloud = Cloud(hole.pose[:2], wide, self._speed)
            self._until = max(hole.utime, until - BLIND_US)
        seen = sightings(beacons, estimate, self._own, self._until, until)
        arm = float(np.hypot(*self._own.model.antenna))
        step = round(STEP_S * SECOND_US)
        starts = own.first_us if own.last_us > hole.utime else None
        while self._until + step <= until:
            now = self._until + step
            self._cloud.carry(STEP_S)
            self._cloud.weigh(
                seen.chosen((seen.utime > self._until) & (seen.utime <= now)),
                self._own.ranges,
                arm,
            )
            if starts is not None and self._until <= starts:
                self._remember(own.track.segment_start, starts)
            self._until = now
        if len(seen):
            self._sighted = int(seen.utime[-1])
            used = [estimate.covariance(peer) for peer in set(seen.peer.tolist())]
            known = [c[:2, :2] for c in used if c is not None]
            self._peers_covariance = np.mean(known, axis=0) if known else np.zeros((2, 2))

    def _remember(self, segment_start: int, starts: int) -> None:
        """Where a segment begins, by the cloud."""
        assert self._cloud is not None
        assert self._hole is not None
        mean, covariance = self._cloud.moments()
        reach = self._speed * (starts - self._hole.utime) / SECOND_US
        reach += 2 * float(np.sqrt(np.trace(self._hole.covariance[:2, :2])))
        self._prior, self._prior_start = Prior(mean, covariance, reach), segment_start

    def by_ranges(self, utime: int) -> ByRanges | None:
        """A position without a heading; None while there is no hole or no range."""
        if self._cloud is None or self._hole is None or utime - self._sighted > BLIND_US:
            return None
        mean, covariance = self._cloud.moments()
        wide = np.zeros((3, 3))
        wide[:2, :2] = covariance + self._peers_covariance
        wide[2, 2] = ANY_HEADING_RAD**2
        pose = PoseNow(self._until // GRID_US * GRID_US, np.append(mean, self._hole.pose[2]), wide)
        return ByRanges(pose, utime - self._hole.utime)

    # once the wheels count again

    def _placing(
        self, beacons: list[Beacon], estimate: TeamEstimate, own: PairEnd, utime: int
    ) -> Callable[[], Found] | None:
        start = own.track.segment_start
        if self._prior is None or self._prior_start != start or start < own.track.n0:
            return None
        # (each peer's odometry counts as far as it came, not only as far as everybody's did)
        return question(beacons, estimate, own, self._own, self._prior, utime)

    def on_found(self, found: Found, own: PairEnd | None, utime: int) -> bool:
        """A computation has ended: is there a closure to tell?"""
        self._placed = None
        if isinstance(found.answer, str):
            self.verdict = found.answer
            return False
        n = last_keyframe(found, own) if own is not None else None
        if self._hole is None or own is None or n is None:
            return False
        self.verdict = ""
        self._placed = placed_pose(found, found.answer, own.track, self._own.robot)
        is_told = self._told_at is not None and utime - self._told_at < AGAIN_US
        if self._is_joined or is_told:
            return False
        self._told_at = utime
        self._number += 1
        self._closures.append(closure(found, found.answer, own, n, self._number))
        return True

    def _knows_more(self, estimate: TeamEstimate, utime: int) -> bool:
        """Does module 3, which has what follows the hole, not yet know how it stands, or not as
        well as the last placing?"""
        known, placed = estimate.covariance(self._own.robot), self._placed
        if known is None or placed is None or self._told_at is None:
            return is_vague(known)
        is_better = known[2, 2] > placed.covariance[2, 2] and utime - self._told_at < SETTLES_US
        return bool(is_better) or is_vague(known)

    def placed(self, estimate: TeamEstimate, track: Track) -> PoseNow | None:
        """Where the last placing has us now, in the frame of a solution; None without one."""
        if self._placed is None or self._placed.frame != estimate.frame:
            return None
        return self._placed.now(track, self._own.model.noise)

    def tell(self) -> list[ClosureMeasurement]:
        """Closures for our log."""
        out, self._closures = self._closures, []
        return out


def _hole(estimate: TeamEstimate | None, own: Own, track: Track, utime: int) -> _Hole | None:
    """Where our way is lost; None while odometry leads from the last solution until now."""
    solved = estimate.trajectories.get(own.robot) if estimate else None
    if estimate is None or solved is None or not len(solved.n) or not len(track):
        return None
    if estimate.correction(own.robot).is_mirrored:
        return None
    known, last, now = estimate.covariance(own.robot), int(solved.n[-1]), track.end - 1
    if known is None or not track.n0 <= last <= now:
        return None
    if track.covers(last, now) and utime - now * GRID_US <= LOST_US:
        return None
    way = track.poses[last - track.n0 :]
    holes = np.flatnonzero(np.isnan(way[:, 0]))
    end = int(holes[0]) if len(holes) else len(way)
    step = se2.between(way[0], way[end - 1])
    pose = se2.compose(solved.poses[-1], step)
    return _Hole(estimate.frame, pose, known, (last + end - 1) * GRID_US)
