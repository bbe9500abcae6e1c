"""What a robot says of its own accord, and when that is worth a datagram.

Most of a small datagram is its envelope, so what nobody needs is not said: odometry goes only to
who makes closures with it and from the first sample that is lacked there, a heartbeat without news
comes a third as often, and a pose that moved less than it is uncertain waits for its second. Where
peers may be while no answer stands no robot needs: it is said when the configuration asks for it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Set

import numpy as np

from drslamd.config import Config
from drslamd.conventions import GRID_US, SECOND_US, Segment
from drslamd.events import Effect
from drslamd.gossip.bounds import is_sayable
from drslamd.gossip.message_types import (
    MAX_BATCH,
    MAX_MOTIONS,
    MAX_PLACES,
    NOTHING_WANTED,
    UNKNOWN_CLOCK,
    Hypotheses,
    OdometryBatch,
    Pose,
    PoseState,
    Status,
)
from drslamd.gossip.team import Team
from drslamd.history.pose_history import PoseHistory
from drslamd.slam import se2
from drslamd.slam.back_end import BackEnd
from drslamd.slam.front_end import FrontEnd
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.se2 import Array
from drslamd.whereabouts import Whereabouts

QUIET_US = 3 * SECOND_US
"""Between heartbeats of a robot that is localised, lacks nothing and hears the same as before."""
POSE_US = SECOND_US
"""Longest silence about the pose of a localised robot."""
BATCHES = 16
"""Batches that are remembered: more than go out between two statuses."""
ON_THE_AIR_US = SECOND_US // 5
"""A status that comes so shortly after a batch cannot know of it."""
SOONER_US = SECOND_US // 20
"""Timers of one period may be so uneven."""


class Broadcast:
    """Our status, odometry and pose for the others."""

    def __init__(self, config: Config, team: Team, front: FrontEnd, back: BackEnd) -> None:
        self._config = config
        self._team, self._front, self._back = team, front, back
        self._news: object = None
        self._status_said = self._pose_said = -QUIET_US
        self._pose: tuple[Segment, PoseState, Array] | None = None
        """What was said last: in whose frame, what it was worth, and the pose."""
        self.poses = PoseHistory()
        """What was said before."""
        self._odometry_said: deque[tuple[int, int]] = deque(maxlen=BATCHES)
        """When batches were said, and one past the last sample of each."""
        self._odometry_due = 0
        """When all who need it are to have more, us."""

    # heartbeat

    def heartbeat(
        self, neighbours: list[PeerInRange], uwb_clock: int | None, state: PoseState, utime: int
    ) -> list[Effect]:
        """Our status, unless it says what it said a second ago.

        Args:
            uwb_clock: our clock minus LinkTrack's system_time, us, where that is known.
            state: what our pose is worth.
        """
        self._team.compare_radio_clocks(uwb_clock, utime)
        estimate, team = self._back.estimate, self._team
        frame = None if estimate is None else estimate.frame.robot
        news = frame, state, self._ranged(utime), team.audible(utime)
        quiet = estimate is not None and not team.is_asking(utime) and news == self._news
        if quiet and utime - self._status_said < QUIET_US - SOONER_US:
            return []
        self._news, self._status_said = news, utime
        return [team.send(self.make_status(neighbours, uwb_clock, state, utime), utime)]

    def _ranged(self, utime: int) -> Set[int]:
        """Robots that we measure ranges to."""
        robots = (self._team.robot_of_uwb(uwb_id) for uwb_id in self._front.ranged(utime))
        return {robot for robot in robots if robot is not None}

    def make_status(
        self,
        neighbours: list[PeerInRange],
        uwb_clock: int | None,
        state: PoseState,
        utime: int,
        leaving: bool = False,
    ) -> Status:
        """What we are, whom we hear, what we hold: the next one to be sent, as names take turns."""
        estimate = self._back.estimate
        heard = self._team.next_heard(utime, self._front.needed(neighbours, utime))
        return Status(
            state=state,
            frame=estimate.frame.robot if estimate else self._team.own.robot,
            leaving=leaving,
            uwb_id=self._config.uwb_id,
            uwb_clock_us=UNKNOWN_CLOCK if uwb_clock is None else uwb_clock,
            graph_hash=self._back.said_digest(),
            heard=heard,
            ranged=tuple(sorted(self._ranged(utime) & {h.id for h in heard})),
            logs=self._team.logs.next_states(),
        )

    # odometry

    def odometry(self, neighbours: list[PeerInRange], utime: int) -> list[Effect]:
        """Short-term odometry, for peers whose windows need it (paper III-C): each second, and at
        each call for who is lost, for where it is hangs on where we are now."""
        track = self._front.reckoning.track
        if utime >= self._odometry_due:
            self._odometry_due = utime + SECOND_US - SOONER_US
        else:
            neighbours = [peer for peer in neighbours if peer.is_lost]
        wants = [self._lacked(peer) for peer in neighbours if peer.wanted_n != NOTHING_WANTED]
        if not len(track) or not wants:
            return []
        n0 = max(track.n0, track.segment_start, track.end - MAX_BATCH, min(wants))
        if n0 >= track.end:
            return []
        batch = OdometryBatch(track.segment_start, n0, track.steps(n0, track.end - n0))
        if not is_sayable(batch):
            return []
        self._odometry_said.append((utime, track.end))
        return [self._team.send(batch, utime)]

    def _lacked(self, peer: PeerInRange) -> int:
        """First sample to say to a peer: what we said counts as heard until it should know."""
        if peer.wanted_n > self._front.reckoning.track.end:
            return 0  # what it holds was never ours
        said = self._odometry_said
        known = [end for at, end in said if at + ON_THE_AIR_US < peer.wanted_at]
        is_lost = bool(known) and peer.wanted_n < known[-1]
        return peer.wanted_n if is_lost or not said else said[-1][1]

    # hypotheses

    def hypotheses(self, neighbours: list[PeerInRange], utime: int) -> list[Effect]:
        """Where peers may be, if that is asked for and not known."""
        said = self.make_hypotheses(neighbours, utime) if self._config.near.hypotheses else None
        if said is None or not is_sayable(said):
            return []
        return [self._team.send(said, utime)]

    def make_hypotheses(self, neighbours: list[PeerInRange], utime: int) -> Hypotheses | None:
        """Of the nearest peers that are not known otherwise; None where there is nothing to say."""
        track, estimate = self._front.reckoning.track, self._back.estimate
        known = estimate.trajectories.keys() if estimate is not None else set()
        unknown = [peer for peer in neighbours if peer.chain.robot not in known]
        if self._team.own.robot not in known:
            unknown = neighbours
        found = self._front.places_left(unknown, self._back.graph, utime)
        if not found:
            return None
        here = track.at(track.end - 1)
        away = [float(np.hypot(*(here[:2] - left.places[0].pose[:2]))) for left in found]
        nearest = [left for _, left in sorted(zip(away, found, strict=True), key=lambda p: p[0])]
        x, y, theta = here.tolist()
        while (
            sum(len(left.places) for left in nearest) > MAX_PLACES
            or sum(left.motion is not None for left in nearest) > MAX_MOTIONS
        ):
            nearest.pop()
        return Hypotheses(
            odom_utime=(track.end - 1) * GRID_US,
            odom=(x, y, float(se2.wrap(theta))),
            places=tuple(place for left in nearest for place in left.places),
            motions=tuple(left.motion for left in nearest if left.motion is not None),
        )

    # pose

    def pose(self, where: Whereabouts, utime: int) -> list[Effect]:
        """Where we are, when that is news."""
        estimate, found = self._back.estimate, where.pose
        if estimate is None or found is None:
            return []
        soon = utime - self._pose_said < POSE_US - SOONER_US
        if soon and not self._is_news(estimate.frame, where.state, found.pose, found.covariance):
            return []
        frame, covariance = estimate.frame, se2.packed(found.covariance)
        x, y, theta = found.pose.tolist()
        message = Pose(
            where.state, frame.robot, frame.epoch, found.utime, (x, y, theta), covariance
        )
        if not is_sayable(message):
            return []
        self._pose, self._pose_said = (frame, where.state, found.pose), utime
        self.poses.add(message.row())
        return [self._team.send(message, utime)]

    def public(self, said: list[PublicPoses], utime: int) -> list[Effect]:
        """Our lifted poses, with `rbcd`; such as nobody would take are left unsaid."""
        sayable = (poses for poses in said if is_sayable(poses))
        return [send for poses in sayable for send in self._team.send_public(poses, utime)]

    def _is_news(self, frame: Segment, state: PoseState, pose: Array, covariance: Array) -> bool:
        """Did the pose move by more than its own sigma since it was said?"""
        if self._pose is None or self._pose[:2] != (frame, state):
            return True
        moved = pose - self._pose[2]
        moved[2] = se2.wrap(moved[2])
        return bool((moved**2 > np.diag(covariance)).any())
