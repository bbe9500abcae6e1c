"""A robot that lost its odometry for a while: where it is meanwhile, and where it goes on.

While nothing is known of its way a cloud of places says where it may be: a position without a
heading. What its wheels count after the hole is a segment of its own that nothing joins to the
rest. As soon as ranges to localised peers allow one place for it only, this robot says so as a
closure in its log; then module 3 has it, on all robots alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from drslamd.conventions import GRID_US, SECOND_US, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import PoseNow, TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.odometry.track import Track
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.range_model import RangeModel
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relocation.cloud import STEP_S, Cloud
from drslamd.slam.relocation.placing import Placed, Prior, WayUnder, place
from drslamd.slam.relocation.sightings import Beacon, Own, Sightings, path_in_team, sightings
from drslamd.slam.se2 import Array

LOST_US = SECOND_US
"""Odometry that is silent for longer has a hole."""
LATE_US = 5 * SECOND_US // 2
"""Odometry of a peer that is later than this is not waited for."""
BLIND_US = 3 * SECOND_US
"""After so long without a range the cloud says nothing any more."""
LONGEST_US = 10 * SECOND_US
"""Of the odometry after the hole that is placed at once."""
FIRST_NUMBER = 2**30
"""Of closures; windows count from 0 and never come so far."""
AGAIN_US = 4 * SECOND_US
"""A closure has joined us to the others by then, or another one is needed."""
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


@dataclass(frozen=True)
class Found:
    """What a computation found, and of what: the solution and the first sample of the segment."""

    estimate: TeamEstimate
    segment_start: int
    peers: tuple[int, ...]
    answer: Placed | str


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
        if hole is None or estimate is None:
            self._hole = self._cloud = self._prior = self._told_at = None
            return None
        data = graph.chains.get(self._own.robot)
        own = PairEnd(track, data) if data is not None else None
        if own is None:
            return None
        if self._hole is None or self._hole.frame != hole.frame:
            self._cloud, self._prior = None, None
        self._hole, self._speed = hole, speed()
        beacons = _beacons(neighbours, ranges, graph, estimate)
        known_us = [b.end.last_us for b in beacons if utime - b.end.last_us < LATE_US]
        until = min([utime, *known_us]) if known_us else utime - LATE_US
        self._carry(beacons, estimate, own, until, utime)
        return self._placing(beacons, estimate, own, until, utime)

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
        self, beacons: list[Beacon], estimate: TeamEstimate, own: PairEnd, until: int, utime: int
    ) -> Callable[[], Found] | None:
        is_told = self._told_at is not None and utime - self._told_at < AGAIN_US
        start = own.track.segment_start
        if self._prior is None or self._prior_start != start or start < own.track.n0 or is_told:
            return None
        first = max(own.first_us, until - LONGEST_US)
        last = min(until, own.last_us)
        seen = sightings(beacons, estimate, self._own, first, last)
        stretch = _stretch(own, estimate, self._own, seen)
        peers = tuple(sorted(set(seen.peer.tolist())))
        return partial(_found, estimate, start, peers, seen, stretch, self._prior, self._own.ranges)

    def on_found(self, found: Found, own: PairEnd | None, utime: int) -> bool:
        """A computation has ended: is there a closure to tell?"""
        if isinstance(found.answer, str):
            self.verdict = found.answer
            return False
        if self._hole is None or own is None or own.track.segment_start != found.segment_start:
            return False
        keyframes = own.data.keyframes
        mine = np.flatnonzero(keyframes.n >= found.segment_start)
        if not len(mine):
            return False
        self.verdict, self._told_at = "", utime
        self._closures.append(self._closure(found, found.answer, own, int(keyframes.n[mine[-1]])))
        return True

    def tell(self) -> list[ClosureMeasurement]:
        """Closures for our log."""
        out, self._closures = self._closures, []
        return out

    def _closure(self, found: Found, placed: Placed, own: PairEnd, n: int) -> ClosureMeasurement:
        """Between our keyframe n and the last one of a peer."""
        estimate, robot = found.estimate, self._own.robot
        path = _path(own, estimate, robot)
        w_T_k = se2.compose(placed.w_T_o, path[n - own.track.segment_start])
        peer = estimate.trajectories[found.peers[0]]
        w_T_b = peer.poses[-1]
        a_T_b = se2.between(w_T_k, w_T_b)
        middle = se2.transform(placed.w_T_o, placed.at)
        lever = np.eye(3)
        lever[0, 2], lever[1, 2] = -(w_T_b - [*middle, 0])[1], (w_T_b - [*middle, 0])[0]
        spread = se2.turned(lever @ placed.covariance @ lever.T, -w_T_k[2])
        corrections = [
            estimate.correction(r) if r in estimate.turn else None for r in (robot, found.peers[0])
        ]
        corrected = [(c.scale, c.turn) if c else (0.0, 0.0) for c in corrections]
        self._number += 1
        return ClosureMeasurement(
            number=self._number,
            kept=True,
            a_n=n,
            peer=peer.chain,
            b_n=int(peer.n[-1]),
            a_T_b=(float(a_T_b[0]), float(a_T_b[1]), float(se2.wrap(a_T_b[2]))),
            covariance=se2.packed(spread),
            corrected=(*corrected[0], *corrected[1]),
        )


def _found(
    estimate: TeamEstimate,
    start: int,
    peers: tuple[int, ...],
    seen: Sightings,
    stretch: WayUnder,
    prior: Prior,
    model: RangeModel,
) -> Found:
    return Found(estimate, start, peers, place(seen, stretch, prior, model))


def _hole(estimate: TeamEstimate | None, own: Own, track: Track, utime: int) -> _Hole | None:
    """Where our way is lost; None while odometry leads from the last solution until now."""
    solved = estimate.trajectories.get(own.robot) if estimate else None
    if estimate is None or solved is None or not len(solved.n) or not len(track):
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


def _beacons(
    neighbours: list[PeerInRange],
    ranges: Mapping[int, RangeBuffer],
    graph: PoseGraph,
    estimate: TeamEstimate,
) -> list[Beacon]:
    out = []
    for peer in neighbours:
        data, found = graph.chains.get(peer.chain.robot), ranges.get(peer.uwb_id)
        is_known = data is not None and data.chain == peer.chain and peer.ahead_us is not None
        if not is_known or found is None or peer.frame != estimate.frame.robot:
            continue
        assert data is not None
        assert peer.ahead_us is not None
        end = PairEnd(peer.track, data, peer.ahead_us)
        if path_in_team(end, estimate) is not None:
            out.append(Beacon(end, found))
    return out


def _path(own: PairEnd, estimate: TeamEstimate, robot: int) -> Array:
    """(k, 3) the odometry since the hole, without its known errors."""
    start = own.track.segment_start - own.track.n0
    return estimate.correction(robot).path(own.track.poses[start:])


def _stretch(own: PairEnd, estimate: TeamEstimate, who: Own, seen: Sightings) -> WayUnder:
    path = _path(own, estimate, who.robot)
    at = np.clip(own.grid(seen.utime) - own.track.segment_start, 0, len(path) - 1)
    left = np.minimum(at.astype(int), max(len(path) - 2, 0))
    right = np.minimum(left + 1, len(path) - 1)
    body = path[left] + (path[right] - path[left]) * (at - left)[:, None]
    steps = np.hypot(*np.diff(path[:, :2], axis=0).T) if len(path) > 1 else np.zeros(0)
    way = np.append(0.0, np.cumsum(steps))
    scale = estimate.scale.get(who.robot)
    noise = who.model.noise
    if scale is not None:
        noise = replace(noise, scale=min(noise.scale, float(np.hypot(scale.sigma, 0.01))))
    antenna = who.model.antenna
    return WayUnder(se2.transform(body, antenna), path[0, :2], way[np.round(at).astype(int)], noise)
