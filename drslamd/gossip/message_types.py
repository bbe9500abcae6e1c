"""The messages as the rest of drslamd sees them, and how much of each fits one datagram.

Those that belong to the pose graph (`GraphEntry`, `PublicPoses`) are in `drslamd.slam.graph`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Union

from drslamd.conventions import LAST_UTIME, Chain
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.hypotheses.deciding_motion import DecidingMotion
from drslamd.slam.hypotheses.places_left import PossiblePlace
from drslamd.slam.se2 import Array

UNKNOWN_CLOCK = -(2**63)
"""`Status.uwb_clock_us` of a robot that does not know LinkTrack's system_time."""

NOTHING_WANTED = -1

UNANSWERED = -LAST_UTIME
"""`Heard.delay_us` of a robot that is heard and has not yet said that it hears this start: what it
says does not count before (`drslamd.gossip.acquaintance`)."""

MAX_HEARD = 28
"""Peers named in one status, which with as many logs has 1,391 bytes; whoever hears more names them
in turn."""
MAX_LOGS = 28
"""Logs named in one status; whoever holds more names them in turn."""
MAX_BEYOND = 240 + MAX_LOGS
"""Bytes that say what is held beyond gaps of logs: of each log how many stretches, and 60 or more
of these."""
LOG_BYTES = 22
"""Of a log in a status; what is said of gaps takes the place of as many logs."""
MAX_PLACES = 20
"""Of all peers in one message: four of each of the nearest five, at least."""
MAX_MOTIONS = 8
"""Likewise of peers; with as many places a message has 1,263 bytes."""
MAX_BATCH = 150
"""Odometry samples in one message: 15 s, 955 bytes."""


class PoseState(IntEnum):
    """What a robot says of its own pose, in `status_t` and `pose_t`."""

    NOT_LOCALISED = 0
    """It is in no frame; a pose that is sent with it says nothing."""
    LOCALISED = 1
    """The pose is at most a second old and its covariance is meant."""
    DOUBTFUL = 2
    """There is a pose, but what was measured contradicts it."""
    STALE = 3
    """No odometry: a position by ranges, whose heading means nothing (its sigma is that of any), or
    the last pose, as uncertain as the way that may have been driven since."""
    POSITION = 4
    """Its place is known and its heading is not: it stands, and others have found it, or its wheels
    turn it the other way. A heading means nothing in such a pose: its sigma is that of any."""


@dataclass(frozen=True)
class Heard:
    """A peer that is heard.

    Attributes:
        delay_us: the smallest (arrival here - utime there) of late; or `UNANSWERED`.
        wanted_n: first sample of its odometry that we lack and need, `NOTHING_WANTED` if none.
    """

    id: int
    epoch: int
    delay_us: int
    wanted_n: int = NOTHING_WANTED


@dataclass(frozen=True)
class LogState:
    """Of one log: held from `first` to `complete`, heard of below `newest`.

    A status that names a log again says what its sender holds beyond that.
    """

    id: int
    epoch: int
    first: int
    complete: int
    newest: int


@dataclass(frozen=True)
class Status:
    state: PoseState
    frame: int
    leaving: bool
    uwb_id: int
    uwb_clock_us: int
    graph_hash: int
    heard: tuple[Heard, ...] = ()
    ranged: tuple[int, ...] = ()
    logs: tuple[LogState, ...] = ()


@dataclass(frozen=True)
class OdometryBatch:
    """Samples n0 ... of the 10 Hz grid: (n, 3) whole steps in the odometry frame."""

    segment_start: int
    n0: int
    steps: Array


@dataclass(frozen=True)
class Pose:
    state: PoseState
    frame: int
    frame_epoch: int
    pose_utime: int
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0)
    covariance: tuple[float, ...] = (0.0,) * 6

    def row(self) -> list[float]:
        """As `pose_history.COLUMNS` names its numbers."""
        return [self.pose_utime, self.state, self.frame, *self.pose, *self.covariance]


@dataclass(frozen=True)
class Hypotheses:
    """Where peers may be, until one answer stands.

    Attributes:
        odom_utime, odom: where we are in our odometry frame, and when, us.
        places: in that frame, those of one peer in a row, the likeliest first.
        motions: what would decide between those of a peer.
    """

    odom_utime: int
    odom: tuple[float, float, float]
    places: tuple[PossiblePlace, ...] = ()
    motions: tuple[DecidingMotion, ...] = ()


Message = Union[Status, OdometryBatch, GraphEntry, Pose, PublicPoses, Hypotheses]


@dataclass(frozen=True)
class Received:
    """One accepted message."""

    origin: Chain
    message: Message
