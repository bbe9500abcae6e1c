"""A robot that began again: where it goes on, by ranges to localised peers.

It was localised before and its memory says where (`last_place`). Meanwhile it may have driven on,
or somebody carried it away, no faster than people walk. That bounds where it can be; and nothing
but ranges and its own way say where in there it is, so a robot that was carried is placed as well
as one that was not. An answer that stands for two seconds is told, as a closure in its log.

Where the bound is as wide as radio reaches, or no peer is left that knows the place, the robot
begins from nothing as any newcomer does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from drslamd.conventions import SECOND_US, Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relocation.last_place import LastPlace, SeenFrom
from drslamd.slam.relocation.placing import Placed, Prior
from drslamd.slam.relocation.question import (
    Found,
    closure,
    known_until,
    last_keyframe,
    localised_peers,
    question,
)
from drslamd.slam.relocation.sightings import Own
from drslamd.slam.se2 import Array

CARRIED_MPS = 1.5
"""Who carries a robot walks."""
MOST_REACH_M = 100.0
"""Whoever may be so far away may be out of reach of all ranges: then the place says nothing."""
CLOCKS_US = SECOND_US // 2
"""What clocks of peers may be off by: nobody was last seen in the future."""
FIRST_NUMBER = 5 << 28
"""Of closures: above those of a hole in odometry."""
STANDS_US = 2 * SECOND_US
"""An answer that was the same for so long is told."""
AGREE_M, AGREE_RAD = 0.5, 0.15
"""Answers that differ by less are the same."""
AGAIN_US = 4 * SECOND_US
"""A closure has joined us to the others by then, or another one is needed."""

SETTLES_US = 10 * SECOND_US
"""So long at most it is waited for a heading."""


class _Answer(NamedTuple):
    """A place, in which frame, and since when it is the answer, us."""

    placed: Placed
    frame: Segment
    since: int


class Resumption:
    """Of one robot.

    Attributes:
        verdict: why no place is named yet.
    """

    def __init__(self, own: Own, last: LastPlace | None) -> None:
        self._own, self._last = own, last
        self.verdict = ""
        self._answer: _Answer | None = None
        self._told_at: int | None = None
        self._number = FIRST_NUMBER
        self._closures: list[ClosureMeasurement] = []

    @property
    def is_waiting(self) -> bool:
        """Is there a place that was not found again?"""
        return self._last is not None

    @property
    def beside(self) -> frozenset[Chain]:
        """Peers that knew us."""
        return frozenset(row.peer for row in self._last.seen) if self._last else frozenset()

    def look(
        self,
        neighbours: list[PeerInRange],
        ranges: Mapping[int, RangeBuffer],
        own: PairEnd | None,
        graph: PoseGraph,
        estimate: TeamEstimate | None,
        utime: int,
    ) -> Callable[[], Found] | None:
        """A computation that places what the wheels have counted since this start.

        Args:
            estimate: of the group that we are in, or were.
        """
        if self._last is None or estimate is None or own is None:
            return None
        if self._own.robot in estimate.trajectories.keys() - estimate.points:
            self._last = self._answer = None
            return None
        if self._told_at is not None and utime - self._told_at < AGAIN_US:
            return None
        prior = self._prior(self._last, neighbours, graph, estimate, own)
        if prior is None:
            return None
        if prior.reach_m > MOST_REACH_M:
            self._last = None
            return None
        beacons = localised_peers(neighbours, ranges, graph, estimate)
        until = known_until(beacons, utime)
        return question(beacons, estimate, own, self._own, prior, until)

    def _prior(
        self,
        last: LastPlace,
        neighbours: list[PeerInRange],
        graph: PoseGraph,
        estimate: TeamEstimate,
        own: PairEnd,
    ) -> Prior | None:
        """Where our odometry can have begun; None while no peer tells."""
        ahead = {peer.chain: peer.ahead_us for peer in neighbours}
        for row in last.seen:
            ahead_us, place = ahead.get(row.peer), _in_team(row, graph, estimate)
            if ahead_us is None or place is None:
                continue
            passed_us = own.first_us + ahead_us - row.utime
            if passed_us < -CLOCKS_US:
                continue
            speed = max(last.speed_mps, CARRIED_MPS)
            reach = 3 * row.sigma_m + speed * max(passed_us, CLOCKS_US) / SECOND_US
            return Prior(place, reach**2 * np.eye(2), reach, is_anywhere=True)
        return None

    def on_found(self, found: Found, own: PairEnd | None, utime: int) -> bool:
        """A computation has ended: is there a closure to tell?"""
        before, self._answer = self._answer, None
        if isinstance(found.answer, str):
            self.verdict = found.answer
            return False
        n = last_keyframe(found, own) if own is not None else None
        if self._last is None or own is None or n is None:
            return False
        answer = _Answer(found.answer, found.estimate.frame, utime)
        if before is not None and _agree(before, answer):
            answer = answer._replace(since=before.since)
        self._answer, self.verdict = answer, "not yet sure"
        if utime - answer.since < STANDS_US:
            return False
        self._told_at, self._answer = utime, None
        self._number += 1
        self._closures.append(closure(found, found.answer, own, n, self._number))
        return True

    def is_settling(self, utime: int) -> bool:
        """Was a place told so lately that module 3 may not know the heading yet?"""
        return self._told_at is not None and utime - self._told_at < SETTLES_US

    def tell(self) -> list[ClosureMeasurement]:
        """Closures for our log."""
        out, self._closures = self._closures, []
        return out


def _agree(one: _Answer, other: _Answer) -> bool:
    """Do two answers put the odometry that both know into the same place?"""
    if one.frame != other.frame:
        return False
    a, b = one.placed, other.placed
    apart = se2.transform(a.w_T_o, b.at) - se2.transform(b.w_T_o, b.at)
    turned = abs(float(se2.wrap(a.w_T_o[2] - b.w_T_o[2])))
    return float(np.hypot(*apart)) < AGREE_M and turned < AGREE_RAD


def _in_team(row: SeenFrom, graph: PoseGraph, estimate: TeamEstimate) -> Array | None:
    """(2,) that place in the frame of the team; None where its peer is not in it."""
    solved, data = estimate.trajectories.get(row.peer.robot), graph.chains.get(row.peer.robot)
    if solved is None or solved.chain != row.peer or data is None or data.chain != row.peer:
        return None
    keyframes = data.keyframes
    (at,), (there,) = keyframes.find(np.array([float(row.n)]))
    if not there:
        return None
    segment = keyframes.chosen(keyframes.segment == keyframes.segment[at])
    known = segment.chosen(np.isin(segment.n, solved.n))
    if not len(known):
        return None
    poses = solved.poses[np.searchsorted(solved.n, known.n)]
    one = segment.chosen(segment.n == row.n)
    w_T_k = team_frame.by_odometry(one, known, poses)[0]
    return np.asarray(se2.transform(w_T_k, np.array([row.x, row.y])))
