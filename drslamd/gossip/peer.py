"""What is known of one peer, from its messages alone."""

from __future__ import annotations

from drslamd.conventions import GRID_US, SECOND_US, Chain
from drslamd.gossip.messages import OdometryBatch, Pose, Status
from drslamd.gossip.peer_clock import PeerClock
from drslamd.slam.items import PublicPoses
from drslamd.slam.neighbour import Neighbour
from drslamd.slam.odometry import PEER_TRACK_SAMPLES, Track

SILENCE_US = 5 * SECOND_US
"""Five heartbeats: at 50 % loss a living peer stays silent so long in 3 % of cases."""


class Peer:
    """One start of one robot, as we hear it."""

    def __init__(self, chain: Chain, utime: int) -> None:
        self.chain = chain
        self.clock = PeerClock()
        self.track = Track(PEER_TRACK_SAMPLES)
        self.status: Status | None = None
        self.pose: Pose | None = None
        self.public: PublicPoses | None = None
        self.last_heard = utime
        self.received = 0
        self.first_counter: int | None = None
        self.newest_counter = 0

    def heard(self, counter: int, sent: int, utime: int) -> None:
        """Any message straight from the peer."""
        self.last_heard = utime
        self.clock.heard(sent, utime)
        if self.first_counter is None:
            self.first_counter = counter
        self.received += 1
        self.newest_counter = max(self.newest_counter, counter)

    @property
    def loss(self) -> float:
        """Share of its messages that never came, 0 to 1."""
        if self.first_counter is None:
            return 0.0
        expected = self.newest_counter - self.first_counter + 1
        return max(0.0, 1 - self.received / expected)

    def take_public(self, message: PublicPoses) -> None:
        """Keep what the peer said last of each of its public poses."""
        self.public = message.after(self.public)

    def is_alive(self, utime: int) -> bool:
        """Heard of late, and not on its way out."""
        leaving = self.status is not None and self.status.leaving
        return utime - self.last_heard < SILENCE_US and not leaving

    def hears(self, own: Chain) -> bool:
        """Has it said that it hears this very start of ours? A replayed recording cannot."""
        return self.status is not None and any((h.id, h.epoch) == own for h in self.status.heard)

    def neighbour(self, own: Chain, utime: int) -> Neighbour:
        """What the front end must know of a living peer."""
        assert self.status is not None
        offset = self.clock.offset(utime)
        known = offset is not None and offset.uncertainty_us <= GRID_US
        return Neighbour(
            self.chain,
            self.status.uwb_id,
            own.robot in self.status.ranged,
            self.track,
            offset.us if offset is not None and known else None,
        )

    def extend_track(self, batch: OdometryBatch) -> None:
        """Append what is new in a batch; batches overlap, so nothing is lost with one."""
        track = self.track
        for n, steps in enumerate(batch.steps, start=batch.n0):
            if not len(track) or n >= track.end:
                track.append(n, steps)
        track.segment_start = max(track.segment_start, batch.segment_start)
