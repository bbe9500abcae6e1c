"""A made-up team that an onlooker hears: robots on circles, whose truth is a formula."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np

from drslamd.conventions import Chain
from drslamd.events import Datagram
from drslamd.gossip import lc02, messages
from drslamd.gossip.message_types import Heard, Message, Pose, PoseState, Status
from drslamd.gossip.seal import Seal, team_key
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.se2 import Array
from drslamd.view.scene.hearing import Said

STEP = 1e-4
OF_THE_FIRST = Chain(0, 5)
COVARIANCE = (0.04, 0.01, 0.0, 0.01, 0.0, 0.001)


@dataclass
class Actor:
    """One robot; its clock is ahead of the onlooker's by `ahead_s`.

    Its odometry begins where it stands at its time zero, as its frame does.
    """

    robot: int
    epoch: int = 5
    centre: tuple[float, float] = (0.0, 0.0)
    radius: float = 2.0
    turning: float = 0.25
    phase: float = 0.0
    ahead_s: float = 1000.0
    secret: bytes | None = None
    frame: Chain = OF_THE_FIRST
    state: PoseState = PoseState.LOCALISED
    covariance: tuple[float, ...] = COVARIANCE
    peers: tuple[int, ...] = ()
    uwb_id: int | None = None
    _numbers: itertools.count[int] = field(default_factory=itertools.count)

    def __post_init__(self) -> None:
        self.seal = Seal(team_key(self.secret), self.robot, self.epoch, {})

    @property
    def chain(self) -> Chain:
        return Chain(self.robot, self.epoch)

    def truth(self, t: float) -> Array:
        """(3,) in the frame of the team at a time of the onlooker, s."""
        angle = self.phase + self.turning * t
        x = self.centre[0] + self.radius * math.cos(angle)
        y = self.centre[1] + self.radius * math.sin(angle)
        heading = angle + math.copysign(math.pi / 2, self.turning)
        return np.array([x, y, math.remainder(heading, 2 * math.pi)])

    def n(self, t: float) -> int:
        """The sample of its 10 Hz grid at a time of the onlooker."""
        return round((t + self.ahead_s) * 10)

    # messages

    def pose(self, t: float) -> Pose:
        x, y, theta = self.truth(t).tolist()
        utime = self.n(t) * 100_000
        return Pose(self.state, *self.frame, utime, (x, y, theta), self.covariance)

    def status(self, *, leaving: bool = False) -> Status:
        heard = tuple(Heard(peer, 5, 0) for peer in self.peers)
        uwb_id = self.robot if self.uwb_id is None else self.uwb_id
        unknown = messages.UNKNOWN_CLOCK
        return Status(
            self.state, self.frame.robot, leaving, uwb_id, unknown, 1, heard, self.peers, ()
        )

    def keyframe(self, t: float, segment: int = 0) -> Keyframe:
        """Odometry in a frame of its own: the truth, moved and turned as a whole."""
        x, y, theta = self.truth(t)
        turned = -y, x, theta + math.pi / 2
        steps = [round(v / STEP) for v in (turned[0] + 3.0, turned[1] - 4.0, turned[2])]
        return Keyframe(self.n(t), segment, *steps)

    def range_to(self, other: Actor, t: float, off_m: float = 0.0) -> RangeMeasurement:
        """Of their middles, longer by `off_m` than the truth."""
        distance = math.dist(self.truth(t)[:2], other.truth(t)[:2]) + off_m
        zero = (0.0, 0.0)
        return RangeMeasurement(self.n(t), other.chain, other.n(t), zero, zero, distance, 0.1)

    def closure_to(
        self, other: Actor, t: float, number: int, kept: bool = True, off_m: float = 0.0
    ) -> ClosureMeasurement:
        """Where the other is, seen from here, farther ahead by `off_m`."""
        x, y, theta = self.truth(t)
        dx, dy = other.truth(t)[:2] - (x, y)
        ahead = math.cos(theta) * dx + math.sin(theta) * dy
        left = -math.sin(theta) * dx + math.cos(theta) * dy
        turn = math.remainder(other.truth(t)[2] - theta, 2 * math.pi)
        a_T_b = ahead + off_m, left, turn
        covariance = (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)
        return ClosureMeasurement(
            number, kept, self.n(t), other.chain, other.n(t), a_T_b, covariance
        )

    # on the way

    def said(self, message: Message, t: float) -> Said:
        """As `Hearing` hands it on."""
        return Said(self.chain, round((t + self.ahead_s) * 1e6), message)

    def datagram(self, message: Message, t: float, arrives: int | None = None) -> Datagram:
        """As it comes from the network.

        Args:
            arrives: us on the clock of the onlooker; t when left out.
        """
        channel = messages.channel(messages.kind_of(message), self.robot)
        header = self.seal.header(round((t + self.ahead_s) * 1e6))
        payload = self.seal.close(channel, messages.encode(header, message))
        data = lc02.encode(next(self._numbers), channel, payload)
        return Datagram(round(t * 1e6) if arrives is None else arrives, data, "10.0.0.9")


def entry(
    seq: int,
    keyframes: tuple[Keyframe, ...] = (),
    ranges: tuple[RangeMeasurement, ...] = (),
    closures: tuple[ClosureMeasurement, ...] = (),
) -> GraphEntry:
    return GraphEntry(seq, None, keyframes, ranges, closures)


def two() -> tuple[Actor, Actor]:
    """Two robots that hear each other, on circles beside each other."""
    return (
        Actor(0, peers=(1,)),
        Actor(1, centre=(5.0, 1.0), turning=-0.3, ahead_s=40_000.0, peers=(0,)),
    )
