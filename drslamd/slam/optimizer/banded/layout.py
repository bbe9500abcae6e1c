"""Where each unknown of the team's problem stands: a band in the order of time, and a border.

Closures and ranges join poses of the same time and odometry joins neighbouring times, so with all
poses of all robots in the order of time J' W J is banded. The border takes the unknowns that touch
everything: the bias of each pair and what they have in common, the near-range bias, scale and yaw
rate of each robot, and the few poses that reach far (a robot that stands still while others drive
about has one pose for all that time).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.optimizer.problem import OdometryFactors, Problem, RangeFactors
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.optimizer.vertex_cover import vertex_cover
from drslamd.slam.se2 import Array, Index

NOWHERE = -1
"""The number of what is no unknown."""


@dataclass(frozen=True)
class BandLayout:
    """Numbers of the unknowns: the band first, then the border.

    Attributes:
        poses: (k, 3) of each pose.
        bias, scale, yaw: of each pair and robot; near_bias, team_bias: of the team.
        turn: (robots,), antenna: (robots, 2); `NOWHERE` for what is no unknown.
        band, border: how many unknowns are in each.
        width: diagonals of the band, the main one included.
    """

    poses: Index
    bias: Index
    scale: Index
    yaw: Index
    near_bias: Index
    team_bias: Index
    turn: Index
    antenna: Index
    band: int
    border: int
    width: int

    @staticmethod
    def of(problem: Problem) -> BandLayout:
        count, robots = len(problem.initial), len(problem.priors.scale)
        i, j = problem.ends
        apart = border_poses(i, j, narrow=8 + 4 * robots)
        inside = np.ones(count, dtype=bool)
        inside[apart] = False
        place = np.where(inside, np.cumsum(inside) - 1, 0)
        place[apart] = count - len(apart) + np.arange(len(apart))
        both = inside[i] & inside[j]
        reach = int(np.abs(place[i] - place[j])[both].max(initial=0))
        return BandLayout.placed(
            problem,
            poses=3 * place[:, None] + np.arange(3),
            band=3 * (count - len(apart)),
            outside=3 * len(apart),
            width=3 * reach + 3,
        )

    @staticmethod
    def flat(problem: Problem) -> BandLayout:
        """All poses in their order, then the constants; for vectors, a matrix would be full."""
        count = len(problem.initial)
        poses = np.arange(3 * count).reshape(-1, 3)
        return BandLayout.placed(problem, poses, band=3 * count, outside=0, width=3 * count)

    @staticmethod
    def placed(problem: Problem, poses: Index, band: int, outside: int, width: int) -> BandLayout:
        """
        Args:
            poses: (k, 3), `NOWHERE` for those that are no unknowns.
            outside: how many of their unknowns are in the border; the constants follow.
        """
        robots, doubted = len(problem.priors.scale), problem.doubted
        turns, antennas = int(doubted.track.sum()), 2 * int(doubted.antenna.sum())
        sizes = [problem.pairs, robots, robots, 1, 1, turns, antennas]
        numbers = band + outside + np.arange(sum(sizes))
        *shared, turn, antenna = np.split(numbers, np.cumsum(sizes)[:-1])
        bias, scale, yaw, near_bias, team_bias = shared
        all_turns, all_antennas = np.full(robots, NOWHERE), np.full((robots, 2), NOWHERE)
        all_turns[doubted.track], all_antennas[doubted.antenna] = turn, antenna.reshape(-1, 2)
        return BandLayout(
            poses=poses,
            bias=bias,
            scale=scale,
            yaw=yaw,
            near_bias=near_bias,
            team_bias=team_bias,
            turn=all_turns,
            antenna=all_antennas,
            band=band,
            border=outside + sum(sizes),
            width=width,
        )

    def odometry_unknowns(self, odometry: OdometryFactors) -> Index:
        """(m, 9) on which each link depends: both poses, scale, yaw rate and turn."""
        sensors = np.stack([self.scale, self.yaw, self.turn], axis=-1)[odometry.robot]
        return np.hstack([self.poses[odometry.i], self.poses[odometry.j], sensors])

    def range_unknowns(self, ranges: RangeFactors) -> Index:
        """(m, 12) likewise: both poses, bias, near-range bias and both antennas."""
        near_bias = np.tile(self.near_bias, (len(ranges), 1))
        antennas = self.antenna[ranges.robots].reshape(-1, 4)
        constants = np.column_stack([self.bias[ranges.pair], near_bias, antennas])
        return np.hstack([self.poses[ranges.i], self.poses[ranges.j], constants])

    def carried_unknowns(self, ranges: RangeFactors) -> Index:
        """(c, 16) of those that odometry has carried: yaw rate and scale of both robots besides."""
        carried = ranges.chosen(ranges.is_carried)
        constants = np.stack([self.yaw, self.scale], axis=-1)[carried.robots].reshape(-1, 4)
        return np.hstack([self.range_unknowns(carried), constants])

    def ways(self) -> Index:
        """(k - 1, 6) likewise of the ways from each pose to the next in time; `NOWHERE` for all of
        one that is wider than the band."""
        one, next_one = self.poses[:-1], self.poses[1:]
        low, high = np.minimum(one, next_one), np.maximum(one, next_one)
        is_wide = (high < self.band) & (high - low > self.width - 3)
        is_out = (is_wide | (low == NOWHERE)).any(axis=1)
        return np.where(is_out[:, None], NOWHERE, np.hstack([one, next_one]))

    @property
    def constants(self) -> Index:
        """All unknowns that are no poses, in the order of their numbers."""
        parts = (self.bias, self.scale, self.yaw, self.near_bias, self.team_bias)
        numbers = np.concatenate([*parts, self.turn, self.antenna.ravel()])
        return np.asarray(numbers[numbers != NOWHERE])

    def vector(self, poses: Array, calibration: Calibration) -> Array:
        """Over all unknowns, of poses (k, 3) and calibration: the inverse of `calibration`."""
        out = np.zeros(self.band + self.border)
        out[self.poses] = poses
        names = ("bias", "scale", "yaw", "near_bias", "team_bias", "turn", "antenna")
        for name in names:
            numbers = getattr(self, name)
            known = numbers != NOWHERE
            out[numbers[known]] = getattr(calibration, name)[known]
        return out

    def calibration(self, unknowns: Array) -> Calibration:
        """The part of a vector over all unknowns that belongs to the sensors."""
        parts = (self.bias, self.scale, self.yaw, self.near_bias, self.team_bias)
        mountings = (
            np.where(numbers == NOWHERE, 0.0, unknowns[numbers])
            for numbers in (self.turn, self.antenna)
        )
        return Calibration(*(unknowns[numbers] for numbers in parts), *mountings)


def border_poses(i: Index, j: Index, narrow: int) -> Index:
    """The poses that are taken out of the band.

    Every pose that is taken out costs three columns of the border, every pose that the longest
    edge spans costs three diagonals of the band; the smallest number is chosen that is enough
    for both.

    Args:
        i, j: (m,) the two poses of each edge.
        narrow: a reach that needs no attention.
    """
    reach = np.abs(i - j)
    while True:
        far = reach > narrow
        apart = vertex_cover(i[far], j[far], narrow + 1)
        if len(apart) <= narrow:
            return apart
        narrow *= 2
