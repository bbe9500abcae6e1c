"""The peers of one robot: where each was when it last said where its wheels went.

A peer says so once a second, so what is told of it is half a second old in the mean, and bears its
time. Who has said nothing for two and a half seconds, and lives, stood where it stood until two and
a half seconds ago: had it gone from there we would know. Where it is now nobody knows, for who has
just begun to turn is half a radian off before it says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drslamd.conventions import GRID_US, MILLISECOND_US, SECOND_US
from drslamd.gossip.message_types import PoseState
from drslamd.gossip.peer import Peer
from drslamd.gossip.team import Team
from drslamd.near.leg import Leg
from drslamd.near.near_message import LONGEST_US, NOBODY, Neighbours
from drslamd.near.packed import Packed
from drslamd.near.relative import Relatives, relatives
from drslamd.slam import se2
from drslamd.slam.back_end import BackEnd
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.se2 import Array

LOOK_US = 200 * MILLISECOND_US
"""Between two looks for news."""
STANDS_US = 2_500 * MILLISECOND_US
"""So long after its last keyframe a robot stood; who drives makes one each second, and what is lost
of that is said again by then."""
UNHEARD_CLOCK_US = 2 * SECOND_US
"""How wrong a clock may be of which only measurements tell (`reports.clock_report`)."""


@dataclass
class _Tracked:
    """One peer of a solution.

    Attributes:
        leg: from its last solved keyframe to `n`, the newest; pose: (3,) o_T_b there.
        ahead_us: its clock minus ours, as measurements tell.
        speed_mps, turn_radps: on the last part of its leg.
    """

    data: ChainData
    leg: Leg
    n: int
    segment: int
    pose: Array
    changes: int
    ahead_us: int
    speed_mps: float = 0.0
    turn_radps: float = 0.0

    def follow(self) -> bool:
        """Take its new keyframes along; False when nobody knows where it went."""
        self.changes = self.data.changes
        rows = self.data.keyframes.rows
        for row in rows[np.searchsorted(rows[:, 0], self.n, side="right") :]:
            if int(row[1]) != self.segment:
                return False
            seconds = (int(row[0]) - self.n) * GRID_US / SECOND_US
            step = se2.between(self.pose, row[2:])
            turn = float(step[2])
            self.speed_mps = float(np.copysign(np.hypot(step[0], step[1]), step[0])) / seconds
            self.turn_radps = turn / seconds
            self.leg.go(self.pose.tolist(), row[2:].tolist(), seconds)
            self.n, self.pose = int(row[0]), row[2:]
        return True


class PeersAround:
    """Of one robot and one solution after the other."""

    def __init__(self, own: int, back: BackEnd, team: Team) -> None:
        self._own, self._back, self._team = own, back, team
        self._estimate: TeamEstimate | None = None
        self._tracked: dict[int, _Tracked] = {}
        self._relatives: Relatives | None = None
        self._rows: tuple[Any, ...] = ()
        """Columns of `_row`, at the last look."""
        self._looked = 0

    def renew(self, estimate: TeamEstimate, leg: Leg, utime: int) -> None:
        """A new solution, or news of peers, now and then.

        Args:
            leg: our own.
        """
        is_new = estimate is not self._estimate
        if is_new:
            self._estimate, self._tracked = estimate, self._begun(estimate)
        elif utime - self._looked < LOOK_US:
            return
        self._looked = utime
        news = {r: t for r, t in self._tracked.items() if t.changes != t.data.changes}
        for robot, tracked in news.items():
            if not tracked.follow():
                del self._tracked[robot]
        rows = [self._row(robot, tracked, utime) for robot, tracked in self._tracked.items()]
        self._rows = tuple(zip(*rows, strict=True))
        if is_new or news:
            legs = {robot: tracked.leg for robot, tracked in self._tracked.items()}
            self._relatives = relatives(estimate, self._own, leg, legs)

    def _begun(self, estimate: TeamEstimate) -> dict[int, _Tracked]:
        """Everybody of whom something is known together with us, at the last solved keyframe."""
        graph, out = self._back.graph, {}
        for robot, solved in estimate.trajectories.items():
            data = graph.chains.get(robot)
            if robot == self._own or estimate.joint_of(self._own, robot) is None:
                continue
            if data is None or data.chain != solved.chain or not len(solved.n):
                continue
            (at,), (is_held,) = data.keyframes.find(solved.n[-1:].astype(float))
            if not is_held:
                continue
            row = data.keyframes.rows[at]
            leg = Leg.of(estimate, robot, data.model.noise)
            n, segment, ahead = int(row[0]), int(row[1]), self._measured_us(robot)
            out[robot] = _Tracked(data, leg, n, segment, row[2:], -1, ahead)
        return out

    def _measured_us(self, robot: int) -> int:
        """A clock minus ours, where it is not heard."""
        if robot in self._team.peers:
            return 0
        shifts = self._back.looked_at.shifts
        return round((shifts.get(robot, 0.0) - shifts.get(self._own, 0.0)) * GRID_US)

    def seen(self, leg: Leg, added: Packed, utime: int) -> Neighbours:
        """All of them from the end of our leg.

        Args:
            added: what is added to the covariance of our solved pose, bold already.
            utime: of our odometry, us.
        """
        if self._relatives is None or not self._tracked:
            return NOBODY
        seen, covariance = self._relatives.seen_from(leg.end, added)
        stands, states, thens, unsure, speeds, turns = self._rows
        utimes = thens
        if True in stands:
            stood = utime - STANDS_US
            both = zip(stands, thens, strict=True)
            utimes = tuple(stood if still else then for still, then in both)
        return Neighbours(
            tuple(self._tracked), states, utimes, unsure, seen, covariance, speeds, turns
        )

    def _row(
        self, robot: int, tracked: _Tracked, utime: int
    ) -> tuple[bool, PoseState, int, int, float, float]:
        """Does it stand? Then state, time, its uncertainty, speed and turn rate of one peer."""
        peer = self._team.peers.get(robot)
        offset = peer.clock.offset(utime) if peer is not None else None
        ahead_us = tracked.ahead_us if offset is None else offset.us
        unsure = UNHEARD_CLOCK_US if offset is None else min(offset.uncertainty_us, LONGEST_US)
        then = tracked.n * GRID_US - ahead_us
        lives = peer is not None and peer.is_alive(utime)
        if lives and utime - then > STANDS_US + LOOK_US:
            return True, _state(peer), then, unsure, 0.0, 0.0
        state = _state(peer) if lives else PoseState.STALE
        return False, state, then, unsure, tracked.speed_mps, tracked.turn_radps


def _state(peer: Peer | None) -> PoseState:
    """What its pose is worth: it is in the solution, and may know what speaks against it."""
    said = peer.pose.state if peer is not None and peer.pose is not None else PoseState.LOCALISED
    return PoseState.LOCALISED if said is PoseState.NOT_LOCALISED else said
