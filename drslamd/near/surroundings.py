"""Where one robot is and who is around it, now: the last solution, carried on by odometry.

The frames are those of REP 105. The pose in ``odom`` is dead reckoning and never jumps. What module
3 finds out moves ``odom`` in the frame of the team, once a second or as often as there is a
solution; a controller that works in ``odom`` does not feel it. A step of that by more than the pose
was uncertain counts as a reset, as does another frame.

Who was placed after a hole in its odometry has a pose sooner than module 3 (`slam/relocation`);
here it is stale until module 3 has it, for the covariances are those of its solution.

Peers are `peers_around`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from drslamd.config import Config
from drslamd.conventions import GRID_US, MILLISECOND_US, SECOND_US, Chain
from drslamd.events import Send
from drslamd.gossip.message_types import PoseState
from drslamd.gossip.team import Team
from drslamd.near.leg import Leg
from drslamd.near.near_message import NO_WALL, Near, Wall, encode, is_near, near_channel
from drslamd.near.packed import Packed, added_up, moved, times
from drslamd.near.peers_around import PeersAround
from drslamd.sensors.samples import Motion
from drslamd.slam import se2
from drslamd.slam.back_end import BackEnd
from drslamd.slam.front_end import FrontEnd
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.odometry.track import RESOLUTION
from drslamd.standing import Standing
from drslamd.whereabouts import NOWHERE

SPEED_US = 100 * MILLISECOND_US
"""Over which a speed is taken: counters of wheels are too coarse for less."""
JUMP = 11.34
"""Squared distance in units of the covariance, 99 % of three degrees of freedom: more is a jump."""
SOONER_US = 2 * MILLISECOND_US
"""Odometry may come so unevenly."""


class Surroundings:
    """Of one robot.

    Attributes:
        own: this start of it.
        utime: of the newest odometry; None before the first.
    """

    def __init__(
        self,
        config: Config,
        own: Chain,
        front: FrontEnd,
        back: BackEnd,
        team: Team,
        standing: Standing,
        is_asked: bool = True,
    ) -> None:
        """
        Args:
            is_asked: False for what is said on LCM and never shown to a reader.
        """
        self._period_us = round(SECOND_US / config.near.lcm_hz) if config.near.lcm_hz else 0
        self.own, self._front, self._back, self._team = own, front, back, team
        self._standing = standing
        self.utime: int | None = None
        self._odom = (0.0, 0.0, 0.0)
        self._path_m = 0.0
        self._late: deque[tuple[int, float, float]] = deque()
        """Time, way and heading of late, as many as `SPEED_US` holds."""
        self._said = 0
        parts = (config, own, front, back, team, standing)
        self._air = Surroundings(*parts, is_asked=False) if self._period_us and is_asked else None
        """Apart, so that what is said on LCM does not depend on when readers of the socket ask."""
        self._estimate: TeamEstimate | None = None
        self._leg: Leg | None = None
        self._began = 0
        """First sample of the track after the last gap."""
        self._peers = PeersAround(own.robot, back, team)
        self._where, self._where_at = NOWHERE, 0
        self._resets, self._is_lost = 0, False
        self._known: Packed | None = None
        """Covariance of our pose in the solution."""
        self._boldness = 1.0
        """See `Revisions`; it moves with solutions."""

    def on_motion(self, motion: Motion) -> None:
        """Our odometry went on, and dead reckoning has it already."""
        if self._air is not None:
            self._air.on_motion(motion)
        reckoning = self._front.reckoning
        (x, y, theta), utime = reckoning.pose, reckoning.utime
        if utime is None or utime == self.utime:
            return
        if motion.gap:
            self._is_lost = self._is_lost or self._leg is not None
            self._leg, self._began = None, reckoning.track.end
            self._late.clear()
        elif self._leg is not None and self.utime is not None:
            self._leg.go(self._odom, (x, y, theta), (utime - self.utime) / SECOND_US)
        self._odom, self.utime = (x, y, theta), utime
        self._path_m += motion.distance_m
        self._late.append((utime, self._path_m, theta))
        while len(self._late) > 2 and self._late[1][0] <= utime - SPEED_US:
            self._late.popleft()

    def send(self, utime: int) -> list[Send]:
        """On LCM, as often as is asked for."""
        if self._air is None or self.utime is None:
            return []
        if self.utime - self._said < self._period_us - SOONER_US:
            return []
        near = self._air.look(utime)
        if near is None or not is_near(near):
            return []
        self._said = self.utime
        channel, seal = near_channel(self.own.robot), self._team.seal
        return [Send(channel, seal.close(channel, encode(seal.header(utime), near.on_air())))]

    def look(self, utime: int, wall: Wall = NO_WALL) -> Near | None:
        """What there is to say now; None before the first odometry.

        Args:
            wall: UTC minus our clock, and how wrong that is, us.
        """
        if self.utime is None:
            return None
        self._renew(utime)
        odom, (speed, turn) = self._odom, self._speeds()
        estimate, leg, where = self._estimate, self._leg, self._where
        known = self._known
        if estimate is None or leg is None or known is None or where.pose is None:
            return Near(self.utime, odom, speed, turn, *wall, resets=self._resets)
        bold, gap = self._boldness, self._front.watch.gap_m**2
        added = added_up(times(bold, leg.added), (gap, 0.0, 0.0, gap, 0.0, 0.0))
        covariance = added_up(times(bold, moved(known, *leg.lever)), added)
        return Near(
            self.utime,
            odom,
            speed,
            turn,
            *wall,
            state=PoseState.STALE if where.is_placed else where.state,
            frame=estimate.frame.robot,
            frame_epoch=estimate.frame.epoch,
            correction=_taken_off(leg.end, odom),
            covariance=covariance,
            resets=self._resets,
            peers=self._peers.seen(leg, added, self.utime),
        )

    def _speeds(self) -> tuple[float, float]:
        (since, way, heading), (utime, path, now) = self._late[0], self._late[-1]
        seconds = (utime - since) / SECOND_US
        return ((path - way) / seconds, (now - heading) / seconds) if seconds else (0.0, 0.0)

    # a new solution, or news of peers

    def _renew(self, utime: int) -> None:
        estimate = self._back.estimate
        is_new = estimate is not self._estimate
        if is_new:
            self._boldness = self._back.revisions.boldness
        if is_new or self._leg is None:
            leg = self._own_leg(estimate)
            if leg is not None and estimate is not None:
                self._resets += self._is_jump(estimate, leg)
                self._is_lost = False
            elif self._leg is not None:
                self._is_lost = True
            self._estimate, self._leg = estimate, leg
        if is_new:
            known = estimate.told(self.own.robot) if estimate is not None else None
            self._known = None if known is None else se2.packed(known)
        if is_new or utime - self._where_at >= SECOND_US:
            self._where, self._where_at = self._standing.whereabouts(utime), utime
        if estimate is not None and self._leg is not None:
            self._peers.renew(estimate, self._leg, utime)

    def _is_jump(self, estimate: TeamEstimate, leg: Leg) -> bool:
        """Is our pose elsewhere than was said, by more than it was uncertain?"""
        before, old = self._estimate, self._leg
        if before is None or old is None:
            return self._is_lost
        known = self._known
        if before.frame != estimate.frame or known is None:
            return True
        apart = np.array(leg.end) - np.array(old.end)
        apart[2] = se2.wrap(apart[2])
        carried = added_up(moved(known, *old.lever), old.added)
        covariance = se2.unpacked(carried) + RESOLUTION**2 * np.eye(3)
        return bool(apart @ np.linalg.solve(covariance, apart) > JUMP)

    def _own_leg(self, estimate: TeamEstimate | None) -> Leg | None:
        """From our last solved keyframe to where we are."""
        solved = estimate.trajectories.get(self.own.robot) if estimate else None
        track = self._front.reckoning.track
        if estimate is None or solved is None or not len(solved.n) or not len(track):
            return None
        last, now = int(solved.n[-1]), track.end - 1
        if last < self._began or last > now or not track.covers(last, now):
            return None
        leg = Leg.of(estimate, self.own.robot, self._front.model.noise)
        way = track.poses[last - track.n0 : now - track.n0 + 1]
        leg.along(way)
        seconds = ((self.utime or 0) - now * GRID_US) / SECOND_US
        leg.go(way[-1].tolist(), self._odom, max(seconds, 0.0))
        return leg


def _taken_off(w_T_a: Sequence[float], o_T_a: Sequence[float]) -> tuple[float, float, float]:
    """w_T_o."""
    turn = math.remainder(w_T_a[2] - o_T_a[2], 2 * math.pi)
    cos, sin = math.cos(turn), math.sin(turn)
    x, y = o_T_a[0], o_T_a[1]
    return w_T_a[0] - cos * x + sin * y, w_T_a[1] - sin * x - cos * y, turn
