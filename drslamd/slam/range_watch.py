"""Do the ranges of this very second fit where both robots are said to be?

Module 3 knows that something is wrong once its graph shows it, which takes seconds. What it solved
last, carried on by both odometries, says what each range must be now; a range that is far off for
two seconds is doubt, long before anybody can say who is wrong.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drslamd.conventions import GRID_US, SECOND_US
from drslamd.slam import se2
from drslamd.slam.graph.estimate import Learned, TeamEstimate
from drslamd.slam.pose_now import noise_of_way
from drslamd.slam.range_model import RangeModel
from drslamd.slam.relative_pose.pair_end import PairEnd, level
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.se2 import Array

FAR_SIGMAS = 4.0
"""Beyond them a range does not fit."""
IN_A_ROW = 2
"""So many seconds of them are doubt; a burst is shorter."""
MOST_BIAS_M = 1.0
"""Of which nothing is known yet."""
AT_ONCE = 5
"""Tenths of a second whose median is looked at."""


class _End(NamedTuple):
    """An antenna now.

    Attributes:
        place: (2,) in w.
        by_pose: (2, 3) its derivative by the last solved pose.
        added: (2, 2) covariance of the way since then.
    """

    place: Array
    by_pose: Array
    added: Array


class RangeWatch:
    """Of one robot.

    Attributes:
        off: of how many seconds in a row the ranges to each peer do not fit.
    """

    def __init__(self, sigma_m: float, model: RangeModel) -> None:
        """
        Args:
            sigma_m: of a range.
        """
        self._sigma_m, self._model = sigma_m, model
        self.off: dict[int, int] = {}

    @property
    def doubted(self) -> frozenset[int]:
        """Peers to whom ranges do not fit."""
        return frozenset(peer for peer, seconds in self.off.items() if seconds >= IN_A_ROW)

    @property
    def looked_at(self) -> frozenset[int]:
        """Peers whose ranges could be held against the solution of late."""
        return frozenset(self.off)

    def look(
        self,
        estimate: TeamEstimate | None,
        own: PairEnd,
        peers: dict[int, tuple[PairEnd, RangeBuffer]],
        utime: int,
    ) -> None:
        """Once a second.

        Args:
            own, peers: odometry of both ends, and the ranges between them.
        """
        found: dict[int, int] = {}
        for peer, (end, ranges) in peers.items():
            if estimate is None:
                continue
            sigmas = self._sigmas_off(estimate, own, end, ranges, utime)
            if sigmas is not None:
                found[peer] = self.off.get(peer, 0) + 1 if sigmas > FAR_SIGMAS else 0
        self.off = found

    def _sigmas_off(
        self, estimate: TeamEstimate, own: PairEnd, peer: PairEnd, ranges: RangeBuffer, utime: int
    ) -> float | None:
        """How many sigmas the newest ranges are off; None where nothing can be said."""
        last = min(own.last_us, peer.last_us)
        found = ranges.between(last - AT_ONCE * GRID_US, last).in_sight(self._model)
        if not len(found.utime) or last < utime - 3 * SECOND_US:
            return None
        middle = int(np.argsort(found.range_m)[len(found.range_m) // 2])
        at = float(found.utime[middle])
        a, b = (_antenna(estimate, end, at) for end in (own, peer))
        pair = (own.data.chain.robot, peer.data.chain.robot)
        joint = estimate.joint_of(*pair)
        if a is None or b is None or joint is None:
            return None
        sight = b.place - a.place
        distance = max(float(np.hypot(*sight)), 1e-3)
        u = sight / distance
        measured = float(level(found.range_m[middle : middle + 1], own, peer)[0])
        bias = estimate.bias_m.get((min(pair), max(pair)), Learned())
        near = estimate.near_bias_m.value * float(self._model.near_range_shape(np.array(measured)))
        by_pose = np.concatenate([-u @ a.by_pose, u @ b.by_pose])
        variance = by_pose @ joint @ by_pose + u @ (a.added + b.added) @ u
        near_sigma = float(self._model.near_range_sigma(measured))
        variance += self._sigma_m**2 + near_sigma**2 + min(bias.sigma, MOST_BIAS_M) ** 2
        return abs(distance + bias.value + near - measured) / float(np.sqrt(variance))


def _antenna(estimate: TeamEstimate, end: PairEnd, utime: float) -> _End | None:
    """Where it is at `utime` of our clock."""
    robot = end.data.chain.robot
    solved = estimate.trajectories.get(robot)
    if solved is None or solved.chain != end.data.chain or not len(solved.n):
        return None
    last, now = int(solved.n[-1]), int(end.grid(utime)[0])
    if now < last or not end.track.covers(last, now):
        return None
    way = end.track.poses[last - end.track.n0 : now - end.track.n0 + 1]
    step = se2.between(way[:1], estimate.correction(robot).path(way))
    start = solved.poses[-1]
    x, y = estimate.antenna_m.get(robot, (Learned(), Learned()))
    q = end.data.model.antenna + [x.value, y.value]
    arm = se2.rotate(start[2], se2.transform(step[-1:], q)[0])
    by_pose = np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]])
    level_now = estimate.odometry_level.get(robot, 1.0)
    added = noise_of_way(float(start[2]), step, end.data.model.noise, level_now)
    return _End(start[:2] + arm, by_pose, added[:2, :2])
