"""Do the ranges of this very second fit where both robots are said to be?

Module 3 knows that something is wrong once its graph shows it, which takes seconds. What it solved
last, carried on by both odometries, says what each range must be now; a range that is far off for
two seconds is doubt, long before anybody can say who is wrong. Ranges that are a little off, second
after second, are no doubt yet, but a pose may be as wrong as they are.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

import numpy as np

from drslamd.conventions import GRID_US
from drslamd.slam import se2
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.estimate import Learned, TeamEstimate
from drslamd.slam.odometry import jumps
from drslamd.slam.odometry.jumps import Jump
from drslamd.slam.pose_now import noise_of_way
from drslamd.slam.range_model import RangeModel
from drslamd.slam.relative_pose.pair_end import PairEnd, level
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.robot_model import RobotModel
from drslamd.slam.se2 import Array

FAR_SIGMAS = 3.0
"""Beyond them a range does not fit."""
IN_A_ROW = 2
"""So many seconds of them are doubt; a burst is shorter."""
LASTS = 3
"""Seconds for which doubt is still feared: ranges cross the wrong value as robots drive."""
LEAST_M = 1e-3
"""Antennas that touch have no direction."""
MOST_BIAS_M = 1.0
"""Of which nothing is known yet."""
AT_LENGTH = 3
"""Seconds of ranges to each partner that are looked at together ..."""
UNLIKELY = 4.0
"""... and the sum of their squared sigmas, in the mean of all partners, that is no chance. Sigmas
are configured for any room: healthy teams have more in 1 % of the time."""
AT_ONCE = 5
"""Tenths of a second whose median is looked at."""


LATE_US = 2_500_000
"""A peer says where its wheels went every second; one that says nothing for so long stands."""


class Partner(NamedTuple):
    """A robot in range: what its log says, its clock minus ours, us, and the ranges to it.

    Attributes:
        since_us: from when on our clock that difference holds.
    """

    data: ChainData
    ahead_us: int
    ranges: RangeBuffer
    since_us: int = 0


class _Gap(NamedTuple):
    """A range against where both robots should be.

    Attributes:
        metres: by which it is too long; sigma: of that.
        sight: (2,) unit line of sight from us, in w; distance: on it, m.
    """

    metres: float
    sigma: float
    sight: Array
    distance: float

    @property
    def is_far(self) -> bool:
        return abs(self.metres) > FAR_SIGMAS * self.sigma

    def if_moved(self, way: Array) -> _Gap:
        """The same if we were elsewhere, by a way (2,) in w."""
        apart = self.distance * self.sight - way
        distance = max(float(np.hypot(*apart)), LEAST_M)
        return _Gap(self.metres + self.distance - distance, self.sigma, apart / distance, distance)


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


class _Known(NamedTuple):
    """The antenna of a partner, and all that it follows from: who stands says nothing new."""

    estimate: TeamEstimate
    data: ChainData
    changes: int
    model: RobotModel
    n: int
    end: _End | None

    def follows(self, estimate: TeamEstimate, data: ChainData, n: int) -> bool:
        is_same = self.estimate is estimate and self.data is data and self.model is data.model
        return is_same and (self.n, self.changes) == (n, data.changes)


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
        self._gap_m, self._jump_m = 0.0, 0.0
        self._late_m: deque[float] = deque(maxlen=LASTS)
        self._lately: dict[int, deque[_Gap]] = {}
        """By partner that was looked at without a break."""
        self._together_m = 0.0
        self._believed = -1
        self._known: dict[int, _Known] = {}
        """By partner."""

    @property
    def gap_m(self) -> float:
        """By how much we may be elsewhere: as far as any range is off to a partner that is not
        known to slip itself, or as those of some seconds are together, or as our wheels jumped."""
        return max(self._gap_m, self._together_m, self._jump_m, *self._late_m, 0.0)

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
        partners: dict[int, Partner],
        utime: int,
    ) -> None:
        """Once a second."""
        gaps: dict[int, _Gap] = {}
        ours: dict[int, _End | None] = {}
        self._known = {robot: known for robot, known in self._known.items() if robot in partners}
        for robot, partner in partners.items() if estimate is not None else ():
            assert estimate is not None
            gap = self._off(estimate, own, partner, utime, ours)
            if gap is not None:
                gaps[robot] = gap
        self.off = {r: self.off.get(r, 0) + 1 if gap.is_far else 0 for r, gap in gaps.items()}
        slipping = {r for r in gaps if estimate is not None and estimate.is_slipping(r)}
        far_m = [abs(g.metres) for r, g in gaps.items() if g.is_far and r not in slipping]
        self._gap_m = max(far_m, default=0.0)
        self._late_m.append(self._gap_m if self.doubted else 0.0)
        before = self._lately
        self._lately = {r: deque([*before.get(r, ()), g], AT_LENGTH) for r, g in gaps.items()}
        self._together_m = _together_m([g for r, g in self._lately.items() if r not in slipping])
        self._jump_m = self._feared(jumps.feared(own.track), estimate, own, list(gaps.values()))

    def _feared(
        self, jump: Jump | None, estimate: TeamEstimate | None, own: PairEnd, gaps: list[_Gap]
    ) -> float:
        """How far we may be from where our wheels say since they jumped, m; 0 once a range says
        that we are there."""
        if jump is None or estimate is None or jump.n == self._believed:
            return 0.0
        solved = estimate.trajectories.get(own.data.chain.robot)
        if solved is None or not own.track.covers(int(solved.n[-1]), own.track.end - 1):
            return 0.0
        turned = float(solved.poses[-1, 2] - own.track.at(int(solved.n[-1]))[2])
        less = se2.rotate(turned, -jump.way)
        for gap in gaps:
            if abs(gap.metres) < gap.sigma and gap.if_moved(less).is_far:
                self._believed = jump.n
                return 0.0
        return float(np.hypot(*jump.way))

    def _antenna_of(self, estimate: TeamEstimate, data: ChainData, n: int) -> _End | None:
        """Where the antenna of a partner was at keyframe n."""
        robot = data.chain.robot
        known = self._known.get(robot)
        if known is None or not known.follows(estimate, data, n):
            end = _antenna(estimate, data, _way(estimate, data, n))
            known = self._known[robot] = _Known(estimate, data, data.changes, data.model, n, end)
        return known.end

    def _off(
        self,
        estimate: TeamEstimate,
        own: PairEnd,
        partner: Partner,
        utime: int,
        ours: dict[int, _End | None],
    ) -> _Gap | None:
        """How far the newest ranges are off; None where nothing can be said.

        Args:
            ours: our antenna by time, as far as it was asked for.
        """
        at = _newest(own, partner, utime)
        if at is None:
            return None
        n, when = at
        near = AT_ONCE * GRID_US
        found = partner.ranges.between(when - near, when + near).in_sight(self._model)
        if when not in ours:
            ours[when] = _antenna(estimate, own.data, _own_way(estimate, own, when))
        a, b = ours[when], self._antenna_of(estimate, partner.data, n)
        if not len(found.utime) or a is None or b is None:
            return None
        pair = (own.data.chain.robot, partner.data.chain.robot)
        joint = estimate.joint_of(*pair)
        if joint is None:
            return None
        models = own.data.model, partner.data.model
        measured = median(level(found.range_m, *models).tolist())
        u = b.place - a.place
        distance = max(float(np.hypot(*u)), LEAST_M)
        u = u / distance
        by_pose = np.concatenate([-u @ a.by_pose, u @ b.by_pose])
        bias = estimate.bias_m.get((min(pair), max(pair)), Learned())
        strong = estimate.near_bias_m.value * float(
            self._model.near_range_shape(np.array(distance))
        )
        variance = by_pose @ joint @ by_pose + u @ (a.added + b.added) @ u
        variance += self._sigma_m**2 + float(self._model.near_range_sigma(measured)) ** 2
        variance += min(bias.sigma, MOST_BIAS_M) ** 2
        off = measured - distance - bias.value - strong
        return _Gap(off, float(np.sqrt(variance)), u, distance)


def _together_m(lately: Sequence[Sequence[_Gap]]) -> float:
    """How far the ranges of some seconds are off, root mean square, to the partner to whom they are
    off most; 0 where those to all partners together may be noise."""
    seen = [late for late in lately if len(late) == AT_LENGTH]
    squares = [sum((gap.metres / gap.sigma) ** 2 for gap in late) for late in seen]
    if sum(squares) < UNLIKELY * max(len(seen), 1):
        return 0.0
    return max(float(np.sqrt(np.mean([gap.metres**2 for gap in late]))) for late in seen)


def _newest(own: PairEnd, partner: Partner, utime: int) -> tuple[int, int] | None:
    """The latest keyframe of a partner, and the time of our clock at which it was there."""
    keyframes = partner.data.keyframes
    if not len(keyframes) or not len(own.track):
        return None
    n = int(keyframes.n[-1])
    said_at = n * GRID_US - partner.ahead_us
    stands = utime - said_at > LATE_US
    if said_at < partner.since_us:
        return None
    when = own.last_us if stands else said_at
    return (n, when) if own.first_us <= when <= own.last_us else None


def _way(estimate: TeamEstimate, data: ChainData, n: int) -> Array | None:
    """(k, 3) odometry from the last solved keyframe of a robot to its keyframe n."""
    solved = estimate.trajectories.get(data.chain.robot)
    if solved is None or solved.chain != data.chain or not len(solved.n):
        return None
    keyframes = data.keyframes
    (first, last), there = keyframes.find(np.array([float(solved.n[-1]), float(n)]))
    is_whole = there.all() and first <= last and keyframes.segment[first] == keyframes.segment[last]
    return keyframes.poses[first : last + 1] if is_whole else None


def _own_way(estimate: TeamEstimate, own: PairEnd, utime: int) -> Array | None:
    """(k, 3) odometry from our last solved keyframe to `utime`."""
    solved = estimate.trajectories.get(own.data.chain.robot)
    if solved is None or solved.chain != own.data.chain or not len(solved.n):
        return None
    last, now, track = int(solved.n[-1]), int(own.grid(utime)[0]), own.track
    if now < last:
        # solved already: back along the way, of which the noise is as large
        last, now = now, last
        way = track.between(last, now) if track.covers(last, now) else None
        return None if way is None else way[::-1]
    return track.between(last, now) if track.covers(last, now) else None


def _antenna(estimate: TeamEstimate, data: ChainData, way: Array | None) -> _End | None:
    """Where the antenna of a robot is at the end of a way from its last solved keyframe."""
    if way is None:
        return None
    robot = data.chain.robot
    start = estimate.trajectories[robot].poses[-1]
    step = se2.between(way[:1], estimate.correction(robot).path(way))
    x, y = estimate.antenna_m.get(robot, (Learned(), Learned()))
    arm = se2.transform(step[-1], data.model.antenna + [x.value, y.value])
    arm = se2.rotate(start[2], arm)
    by_pose = np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]])
    level_now = estimate.odometry_level.get(robot, 1.0)
    added = noise_of_way(float(start[2]), step, data.model.noise, level_now)
    return _End(start[:2] + arm, by_pose, added[:2, :2])
