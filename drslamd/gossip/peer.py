"""What is known of one peer, from its messages alone."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Set
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from drslamd.conventions import GRID_HZ, GRID_US, SECOND_US, Chain
from drslamd.gossip.message_types import (
    MAX_BATCH,
    MAX_HEARD,
    NOTHING_WANTED,
    UNANSWERED,
    UNKNOWN_CLOCK,
    Heard,
    OdometryBatch,
    Pose,
    PoseState,
    Status,
)
from drslamd.gossip.peer_clock import PeerClock
from drslamd.history.clock_history import ClockHistory, ClockReading
from drslamd.history.pose_history import PoseHistory
from drslamd.slam.odometry.track import PEER_TRACK_SAMPLES, Track
from drslamd.slam.peer_in_range import PeerInRange

SILENCE_US = 5 * SECOND_US
"""A robot says something every second (its pose, its odometry or its status): at 50 % loss a living
peer stays silent so long in 3 % of cases."""
GAP_US = 8 * SECOND_US
"""What of its odometry is not said again for so long will not be."""
STRAGGLER = 60 * GRID_HZ
"""Samples, a minute of them. Batches are not so late: one that ends so far before the end of the
track shows that the track is not its robot's, and begins it anew."""
REORDERED = 64
"""Messages of one robot that may overtake one of its own, seconds of the busiest. What is further
behind is not late: a false message was ahead of it."""
LOSS_STATUSES = 30
"""Heartbeats over which the loss is counted: the last half minute or so."""
LATEST_STATUSES = 10
"""Of which it is taken how much is usually lost."""
FEW_GAPS = 2
"""Between statuses: of so few none is an exception."""
NOT_KNOWN = -(1 << 40)
"""As the newest entry of a log: no entry lies near it."""
LOST_US, DRIVES_US = 60 * SECOND_US, 3 * SECOND_US
"""Who says that it is lost gets more odometry for so long, and after that while it was heard to
drive so lately: wheels that are out for hours cost the team nothing."""
REMEMBERED_US = 40 * SECOND_US
"""How long it counts that a peer named a robot, when it hears too many for one status: 254 take ten
heartbeats, which come every three seconds at the slowest; a few may be lost. In such a crowd it
also takes so long until it is known that a peer no longer hears a robot."""


class _Tally(NamedTuple):
    """Messages that a peer had sent at one of its statuses, and those of them that had come."""

    sent: int
    came: int


@dataclass(frozen=True)
class _Named:
    """What a peer said of one robot that it hears, whether it ranges to it, and when."""

    heard: Heard
    is_ranged: bool
    utime: int


class Peer:
    """One start of one robot, as we hear it."""

    def __init__(self, chain: Chain, utime: int) -> None:
        self.chain = chain
        self.clock = PeerClock()
        self.clock_history = ClockHistory()
        self.track = Track(PEER_TRACK_SAMPLES)
        self.status: Status | None = None
        self.pose: Pose | None = None
        self.poses = PoseHistory()
        self.last_heard = utime
        self.received = 0
        self._status_counter = self._pose_counter = 0
        self._named: dict[int, _Named] = {}
        self._logs: dict[int, int] = {}
        """Epochs of the logs that it holds, by robot; ids bound their number."""
        self._answered: int | None = None
        self._gap_since: int | None = None
        self._stale_since: int | None = None
        self._drove: int | None = None
        """When its odometry was last heard to go on, us."""
        self._tallies: deque[_Tally] = deque(maxlen=LOSS_STATUSES)

    def on_message(self, sent: int, utime: int) -> None:
        """Any message straight from the peer."""
        self.last_heard = max(self.last_heard, utime)
        self.clock.on_message(sent, utime)
        self.received += 1

    @property
    def loss(self) -> float:
        """Share of its messages that never came of late, 0 to 1."""
        # the first of them only says from where to count
        if len(self._tallies) < 2:
            return 0.0
        (sent_before, came_before), (sent, came) = self._tallies[0], self._tallies[-1]
        return max(0.0, 1 - (came - came_before) / max(1, sent - sent_before))

    @property
    def usual_loss(self) -> float:
        """The same over its latest statuses but for the longest gap: a silence that has ended does
        not count."""
        latest = list(self._tallies)[-LATEST_STATUSES:]
        gaps = sorted((b.sent - a.sent, b.came - a.came) for a, b in pairwise(latest))
        gaps = gaps[:-1] if len(gaps) > FEW_GAPS else gaps
        sent, came = sum(gap[0] for gap in gaps), sum(gap[1] for gap in gaps)
        return max(0.0, 1 - came / sent) if sent > 0 else 0.0

    def newest_of(self, origin: Chain) -> int:
        """How far its latest status knows a log; far below any entry where it does not."""
        logs = self.status.logs if self.status else ()
        return max((log.newest for log in logs if (log.id, log.epoch) == origin), default=NOT_KNOWN)

    def compare_radio_clock(self, own_minus_system: int, utime: int) -> None:
        """Use LinkTrack's system_time, where both sides know their clock against it."""
        theirs = self.status.uwb_clock_us if self.status else UNKNOWN_CLOCK
        if theirs != UNKNOWN_CLOCK and self.is_alive(utime):
            self.clock.radio(own_minus_system, theirs, utime)

    def answered(self, counter: int) -> None:
        """It named this start of ours in the message with this counter."""
        self._answered = min(counter, counter if self._answered is None else self._answered)

    def is_past(self, counter: int) -> bool:
        """Was a message made before its robot answered us?"""
        return self._answered is None or counter < self._answered

    @property
    def latest_counter(self) -> int:
        """Of its statuses and poses."""
        return max(self._status_counter, self._pose_counter)

    def holds(self, origin: Chain) -> bool:
        """Has it said that it holds this log?"""
        return self._logs.get(origin.robot) == origin.epoch

    def take_status(self, status: Status, counter: int, own: Chain, utime: int) -> bool:
        """Keep the latest status; False when this one was overtaken by a later one."""
        if _is_overtaken(counter, self._status_counter):
            return False
        self._status_counter, self.status = counter, status
        since = utime if self._stale_since is None else self._stale_since
        self._stale_since = since if status.state is PoseState.STALE else None
        # entries of its log have counters too, but are not heard from the peer alone
        entries = max((log.newest for log in status.logs if log.id == self.chain.robot), default=0)
        self._tallies.append(_Tally(counter - entries, self.received))
        self._remember(status, utime)
        self._logs.update((log.id, log.epoch) for log in status.logs)
        of_us = self._named_as(own)
        is_met = of_us is not None and of_us.heard.delay_us != UNANSWERED
        self.clock.echoed((of_us.heard.delay_us, of_us.utime) if of_us and is_met else None)
        offset = self.clock.offset(utime)
        if offset is not None:
            self.clock_history.add(ClockReading(utime, offset.us, offset.uncertainty_us))
        return True

    def _remember(self, status: Status, utime: int) -> None:
        """Keep whom it hears; only a full status leaves anybody out."""
        is_full = len(status.heard) == MAX_HEARD
        for robot, named in list(self._named.items()):
            if not is_full or utime - named.utime >= REMEMBERED_US:
                del self._named[robot]
        for heard in status.heard:
            self._named[heard.id] = _Named(heard, heard.id in status.ranged, utime)

    def _named_as(self, chain: Chain) -> _Named | None:
        named = self._named.get(chain.robot)
        return named if named and named.heard.epoch == chain.epoch else None

    def take_pose(self, pose: Pose, counter: int) -> None:
        """Keep the latest pose."""
        if not _is_overtaken(counter, self._pose_counter):
            self._pose_counter, self.pose = counter, pose
            self.poses.add(pose.row())

    def extend_track(self, batch: OdometryBatch, utime: int) -> None:
        """Append what is new in a batch; one that leaves a gap waits for those before it."""
        if batch.n0 + len(batch.steps) <= self.track.end - STRAGGLER:
            self.track = Track(PEER_TRACK_SAMPLES)
        track = self.track
        if batch.n0 > max(track.end, batch.segment_start) and len(batch.steps) < MAX_BATCH:
            self._gap_since = utime if self._gap_since is None else self._gap_since
            if utime - self._gap_since < GAP_US:
                return
        self._gap_since = None
        for n, steps in enumerate(batch.steps, start=batch.n0):
            if not len(track) or n >= track.end:
                track.append(n, steps)
                self._drove = utime
        track.segment_start = max(track.segment_start, batch.segment_start)

    @property
    def lacks_odometry(self) -> bool:
        """Does its odometry wait for samples that were lost?"""
        return self._gap_since is not None

    def is_alive(self, utime: int) -> bool:
        """Heard of late, and not on its way out."""
        return self.speaks(utime, SILENCE_US)

    def speaks(self, utime: int, within_us: int) -> bool:
        """Heard within this time, and not on its way out."""
        leaving = self.status is not None and self.status.leaving
        return utime - self.last_heard < within_us and not leaving

    def waits_for(self, own: Chain) -> bool:
        """Does it hear this start and take nothing of it yet, because it has no answer?"""
        named = self._named_as(own)
        return named is not None and named.heard.delay_us == UNANSWERED

    def hears(self, own: Chain) -> bool:
        """Has it said that it hears this very start of ours? A replayed recording cannot."""
        return self._named_as(own) is not None

    def named(self, is_needed: bool) -> Heard:
        """As our status names it.

        Args:
            is_needed: do we need its odometry?
        """
        delay_us = self.clock.delay_us
        wanted = self.track.end if is_needed else NOTHING_WANTED
        return Heard(*self.chain, UNANSWERED if delay_us is None else delay_us, wanted)

    @property
    def audible(self) -> Set[Chain]:
        """Whom it hears, and is heard by."""
        return {
            Chain(robot, named.heard.epoch)
            for robot, named in self._named.items()
            if named.heard.delay_us != UNANSWERED
        }

    def neighbour(self, own: Chain, utime: int) -> PeerInRange:
        """What the front end must know of a living peer."""
        assert self.status is not None
        offset, of_us = self.clock.offset(utime), self._named_as(own)
        known = offset is not None and offset.uncertainty_us <= GRID_US
        return PeerInRange(
            self.chain,
            self.status.uwb_id,
            of_us is not None and of_us.is_ranged,
            self.track,
            offset.us if offset is not None and known else None,
            of_us.heard.wanted_n if of_us else NOTHING_WANTED,
            of_us.utime if of_us else utime,
            self.clock.since,
            self.status.frame if self.status.state is PoseState.LOCALISED else None,
            self._is_lost(utime),
        )

    def _is_lost(self, utime: int) -> bool:
        """See `LOST_US`."""
        if self._stale_since is None:
            return False
        drives = self._drove is not None and utime - self._drove < DRIVES_US
        return drives or utime - self._stale_since < LOST_US


def _is_overtaken(counter: int, latest: int) -> bool:
    """Was a message made before the latest one that we have of its kind?"""
    return 0 <= latest - counter < REORDERED


# whose is a UWB module?


def carrier(peers: Collection[Peer], uwb_id: int) -> int | None:
    """The robot that carries this UWB module, None when it is not (yet) known."""
    claimants = [p for p in peers if p.status and p.status.uwb_id == uwb_id]
    latest = max((peer.last_heard for peer in claimants), default=0)
    # a module may have moved from a robot that is silent now to one that speaks
    robots = [p.chain.robot for p in claimants if latest - p.last_heard < SILENCE_US]
    return robots[0] if len(robots) == 1 else None


def shared_module(peers: Collection[Peer], utime: int) -> str | None:
    """One sentence when two robots claim one module."""
    claims: dict[int, list[int]] = {}
    for peer in sorted(peers, key=lambda peer: peer.chain):
        if peer.status is not None and peer.is_alive(utime):
            claims.setdefault(peer.status.uwb_id, []).append(peer.chain.robot)
    for uwb_id, robots in sorted(claims.items()):
        if len(robots) > 1:
            names = " and ".join(map(str, robots))
            return (
                f"robots {names} all claim UWB module {uwb_id}, so its ranges cannot be "
                "used; give every robot the uwb.id of its own module"
            )
    return None
