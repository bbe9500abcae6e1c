"""What a placing is asked, and what our log says of its answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from drslamd.conventions import SECOND_US
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relocation.placing import Placed, Prior, WayUnder, place
from drslamd.slam.relocation.sightings import Beacon, Own, Sightings, path_in_team, sightings
from drslamd.slam.se2 import Array

LATE_US = 5 * SECOND_US // 2
"""Odometry of a peer that is later than this is not waited for."""
LONGEST_US = 10 * SECOND_US
"""Of the odometry after a hole that is placed at once."""

VAGUE_RAD = np.radians(40.0)
"""Module 3 has a range a second and placings have more, so its first answers may say next to
nothing of a heading: until they do, there is no pose."""


@dataclass(frozen=True)
class Found:
    """What a computation found, and of what: the solution, the first sample of the segment, and
    what was seen."""

    estimate: TeamEstimate
    segment_start: int
    peers: tuple[int, ...]
    answer: Placed | str
    seen: Sightings


def localised_peers(
    neighbours: list[PeerInRange],
    ranges: Mapping[int, RangeBuffer],
    graph: PoseGraph,
    estimate: TeamEstimate,
) -> list[Beacon]:
    """Peers in range that are localised in the frame of a solution."""
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


def is_vague(covariance: Array | None) -> bool:
    """Of a robot that was placed, (3, 3): is its heading not yet known to module 3?"""
    return covariance is not None and bool(covariance[2, 2] > VAGUE_RAD**2)


def known_until(beacons: list[Beacon], utime: int) -> int:
    """The time up to which the odometry of these peers is known, us."""
    known_us = [b.end.last_us for b in beacons if utime - b.end.last_us < LATE_US]
    return min([utime, *known_us]) if known_us else utime - LATE_US


def question(
    beacons: list[Beacon],
    estimate: TeamEstimate,
    own: PairEnd,
    who: Own,
    prior: Prior,
    until: int,
) -> Callable[[], Found]:
    """Where does the end of our odometry lie?

    Args:
        until: up to when ranges count.
    """
    first = max(own.first_us, until - LONGEST_US)
    seen = sightings(beacons, estimate, who, first, min(until, own.last_us))
    stretch = _way_under(own, estimate, who, seen)
    start, peers = own.track.segment_start, tuple(sorted(set(seen.peer.tolist())))
    return partial(_found, estimate, start, peers, seen, stretch, prior, who)


def _found(
    estimate: TeamEstimate,
    start: int,
    peers: tuple[int, ...],
    seen: Sightings,
    stretch: WayUnder,
    prior: Prior,
    who: Own,
) -> Found:
    return Found(estimate, start, peers, place(seen, stretch, prior, who.ranges), seen)


def last_keyframe(found: Found, own: PairEnd) -> int | None:
    """Of the segment that was placed, as long as it goes on."""
    keyframes = own.data.keyframes
    mine = np.flatnonzero(keyframes.n >= found.segment_start)
    if own.track.segment_start != found.segment_start or not len(mine):
        return None
    return int(keyframes.n[mine[-1]])


def closure(found: Found, placed: Placed, own: PairEnd, n: int, number: int) -> ClosureMeasurement:
    """Between our keyframe n and the last one of a peer."""
    estimate, robot = found.estimate, own.data.chain.robot
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
    return ClosureMeasurement(
        number=number,
        kept=True,
        a_n=n,
        peer=peer.chain,
        b_n=int(peer.n[-1]),
        a_T_b=(float(a_T_b[0]), float(a_T_b[1]), float(se2.wrap(a_T_b[2]))),
        covariance=se2.packed(spread),
        corrected=(*corrected[0], *corrected[1]),
    )


def _path(own: PairEnd, estimate: TeamEstimate, robot: int) -> Array:
    """(k, 3) the odometry since the hole, without its known errors."""
    start = own.track.segment_start - own.track.n0
    return estimate.correction(robot).path(own.track.poses[start:])


def _way_under(own: PairEnd, estimate: TeamEstimate, who: Own, seen: Sightings) -> WayUnder:
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
