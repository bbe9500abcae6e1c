"""Ranges of late to robots that know where they are: circles in the frame of the team."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_US, SECOND_US
from drslamd.slam import se2
from drslamd.slam.graph.estimate import Learned, TeamEstimate
from drslamd.slam.range_model import RangeModel
from drslamd.slam.relative_pose.pair_end import PairEnd, level
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.window import binned
from drslamd.slam.robot_model import RobotModel
from drslamd.slam.se2 import Array, Index

BIN_US = SECOND_US // 5
"""Ranges of so long become one, their median."""
MOST_BIAS_M = 0.3
"""Sigma of a bias of which nothing is known."""
LEAST_SCATTER = 0.3
"""Over the configured sigma: no solution is so good that ranges scatter less for ever."""


class Beacon(NamedTuple):
    """A localised peer in range: its odometry, its log and clock, and our ranges to it."""

    end: PairEnd
    ranges: RangeBuffer


@dataclass(frozen=True)
class Sightings:
    """k of them, in the order of time.

    Attributes:
        utime: (k,) our clock, us.
        place: (k, 2) of the antenna of the peer, in the frame of the team, m.
        range_m: (k,) without the biases that are known.
        sigma_m: (k,) around what is left of the bias.
        bias_m: (k,) sigma of that, one error for all sightings of a peer.
        peer: (k,) whose.
    """

    utime: Array
    place: Array
    range_m: Array
    sigma_m: Array
    bias_m: Array
    peer: Index

    def __len__(self) -> int:
        return len(self.utime)

    def chosen(self, which: NDArray[np.bool_] | Index) -> Sightings:
        return Sightings(*(getattr(self, name)[which] for name in _COLUMNS))

    def joined(self, later: Sightings) -> Sightings:
        """With more of them behind."""
        return Sightings(
            *(np.concatenate([getattr(self, name), getattr(later, name)]) for name in _COLUMNS)
        )


_COLUMNS = tuple(Sightings.__dataclass_fields__)
NONE = Sightings(
    np.zeros(0), np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0, np.int64)
)


@dataclass(frozen=True)
class Own:
    """The robot that looks: its number, what it is like, and the model of its ranges."""

    robot: int
    model: RobotModel
    sigma_m: float
    ranges: RangeModel


def sightings(
    beacons: Iterable[Beacon], estimate: TeamEstimate, own: Own, since: float, until: float
) -> Sightings:
    """Those with since < utime <= until, as far as the odometry of each peer is known."""
    found = NONE
    for beacon in beacons:
        found = found.joined(_of_beacon(beacon, estimate, own, since, until))
    return found.chosen(np.lexsort((found.peer, found.utime)))


def _of_beacon(
    beacon: Beacon, estimate: TeamEstimate, own: Own, since: float, until: float
) -> Sightings:
    end = beacon.end
    peer, model = end.data.chain.robot, own.ranges
    path = path_in_team(end, estimate)
    if path is None:
        return NONE
    first, poses = path
    begin = max(since, first * GRID_US - end.ahead_us)
    last = min(until, end.last_us)
    if last <= begin:
        return NONE
    seen = beacon.ranges.between(round(begin), round(last)).in_sight(model)
    if not len(seen.utime):
        return NONE
    flat = level(seen.range_m, own.model, end.data.model)
    seconds, flat, _ = binned((seen.utime - begin) / SECOND_US, flat, BIN_US / SECOND_US)
    utime = begin + seconds * SECOND_US
    at = np.clip(end.grid(utime) - first, 0, len(poses) - 1)
    left = np.minimum(at.astype(int), max(len(poses) - 2, 0))
    right = np.minimum(left + 1, len(poses) - 1)
    body = poses[left] + (poses[right] - poses[left]) * (at - left)[:, None]
    x, y = estimate.antenna_m.get(peer, (Learned(), Learned()))
    pair = (min(own.robot, peer), max(own.robot, peer))
    bias = estimate.bias_m.get(pair, Learned())
    near = model.near_range_bias(flat - bias.value, estimate.near_bias_m.value)
    scatter = max(estimate.scatter.get(pair, 1.0), LEAST_SCATTER)
    doubt = float(np.median(seen.doubt_m))
    return Sightings(
        utime=utime,
        place=se2.transform(body, end.data.model.antenna + [x.value, y.value]),
        range_m=flat - bias.value - near,
        sigma_m=np.full(len(flat), float(np.hypot(scatter * own.sigma_m, doubt))),
        bias_m=np.hypot(min(bias.sigma, MOST_BIAS_M), model.near_range_sigma(flat)),
        peer=np.full(len(flat), peer),
    )


def path_in_team(end: PairEnd, estimate: TeamEstimate) -> tuple[int, Array] | None:
    """The first sample of a peer's unbroken track, and (k, 3) its poses from there on in the frame
    of the team; None where no odometry leads there from its last solved pose."""
    track, chain = end.track, end.data.chain
    solved = estimate.trajectories.get(chain.robot)
    if solved is None or solved.chain != chain or not len(solved.n) or not len(track):
        return None
    first = max(track.n0, track.segment_start)
    # keyframes come sooner than the odometry between them
    at = int(np.searchsorted(solved.n, track.end)) - 1
    if at < 0 or solved.n[at] < track.segment_start:
        return None
    said = end.data.keyframes.n
    moved = (said > solved.n[at]) & (said < first)
    if moved.any():
        return None
    # who made no keyframe since stands where it was solved
    anchor = max(int(solved.n[at]), first) - first
    way = estimate.correction(chain.robot).path(track.poses[first - track.n0 :])
    w_T_o = se2.compose(solved.poses[at], se2.inverse(way[anchor]))
    return first, se2.compose(w_T_o[None], way)
