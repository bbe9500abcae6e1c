"""Messages of a made-up team, and sealed bytes put together with struct and hashlib alone."""

from __future__ import annotations

import struct
from hashlib import blake2b

import numpy as np

from drslamd.conventions import Chain
from drslamd.gossip import messages
from drslamd.gossip.message_types import (
    Heard,
    Hypotheses,
    LogState,
    Message,
    OdometryBatch,
    Pose,
    PoseState,
    Status,
)
from drslamd.gossip.seal import Header, Seal, team_key
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.hypotheses.deciding_motion import NO_TURN, DecidingMotion
from drslamd.slam.hypotheses.places_left import PossiblePlace
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.robot_model import RobotModel

MS = 1_000
SECOND = 1_000_000
SECRET = bytes(range(32))
OTHER_SECRET = bytes(range(1, 33))

HEADER = Header(3, 3, 11, 12, 13)

COVARIANCE = (0.25, 0.0, 0.0, 0.25, 0.0, 0.0625)
"""Powers of two, so that a float on the wire changes nothing."""
CORRECTED = (0.5, 0.0, -0.5, 1.0)
"""Whole steps of a fiftieth."""


def a_seal(robot: int, epoch: int = 1, secret: bytes | None = SECRET) -> Seal:
    return Seal(team_key(secret), robot, epoch, {})


def a_status(
    heard: tuple[Heard, ...] = (),
    logs: tuple[LogState, ...] = (),
    *,
    leaving: bool = False,
    uwb_id: int = 7,
    uwb_clock_us: int = messages.UNKNOWN_CLOCK,
    ranged: tuple[int, ...] = (),
) -> Status:
    state, frame, graph_hash = PoseState.NOT_LOCALISED, 3, 99
    return Status(state, frame, leaving, uwb_id, uwb_clock_us, graph_hash, heard, ranged, logs)


def an_entry(seq: int, *keyframes: int) -> GraphEntry:
    return GraphEntry(seq, keyframes=tuple(Keyframe(n, 0, n, -n, 5 * n) for n in keyframes))


def one_of_each_kind() -> list[Message]:
    """One message of every kind, with every kind of item."""
    peer = Chain(4, 12)
    steps = np.array([[100, -200, 30], [105, -190, 31], [111, -181, 33]], dtype=float)
    lifted = (np.arange(12) + 1j * np.arange(12, 24)).reshape(3, 4)
    return [
        Status(
            PoseState.LOCALISED,
            3,
            True,
            70_000,
            -5,
            -6,
            (Heard(4, 12, -700),),
            (4, 9),
            (LogState(3, 11, 0, 5, 6), LogState(4, 12, 2, 2, 2)),
        ),
        OdometryBatch(40, 40, steps),
        GraphEntry(
            2,
            RobotModel(OdometryNoise(0.5, 0.25, 0.125, 0.0625), 0.5, -0.5, 0.25, 0.75),
            (Keyframe(40, 1, -100, 200, -30),),
            (RangeMeasurement(40, peer, 41, (0.25, 0.0), (-0.125, 0.5), 3.5, 0.125, 0.25, -0.5),),
            (ClosureMeasurement(8, True, 40, peer, 41, (1.5, -2.5, 0.25), COVARIANCE, CORRECTED),),
        ),
        Pose(PoseState.LOCALISED, 3, 11, 4_000_000, (1.25, -2.5, 3.0), COVARIANCE),
        PublicPoses(
            3, 11, 2, (40, 50), lifted, round=9, since=7, part=1, parts=3, held=((4, 6), (9, 0))
        ),
        Hypotheses(
            5_000_000,
            (1.5, -2.5, 0.25),
            (
                PossiblePlace(4, 4_900_000, 0.75, (1.25, -2.5, 3.0), COVARIANCE),
                PossiblePlace(4, 4_900_000, 0.25, (1.25, 2.5, -3.0), COVARIANCE),
            ),
            (DecidingMotion(4, 3, 1.5, (0.5, 2.5), NO_TURN, 1),),
        ),
    ]


def kinds() -> dict[str, Message]:
    return {messages.kind_of(message): message for message in one_of_each_kind()}


def sealed(seal: Seal, message: Message, utime: int = 0) -> tuple[str, bytes]:
    """Channel and bytes of the next message of this robot."""
    channel = messages.channel(messages.kind_of(message), seal.robot)
    return channel, seal.close(channel, messages.encode(seal.header(utime), message))


def resealed(
    channel: str, payload: bytes, key: bytes = SECRET, origin_of_key: int | None = None
) -> bytes:
    """`payload` with the tag that the module docstring of `seal` describes.

    The header: 8 bytes fingerprint, then version, origin, epoch, counter, utime and the tag.
    """
    origin = struct.unpack_from(">h", payload, 9)[0] if origin_of_key is None else origin_of_key
    origin_key = blake2b(struct.pack(">h", origin), key=key, person=b"drslamd origin").digest()
    untagged = payload[:31] + bytes(8) + payload[39:]
    tag = blake2b(channel.encode() + b"\0" + untagged, digest_size=8, key=origin_key).digest()
    return payload[:31] + tag + payload[39:]


def forged(
    message: Message,
    *,
    robot: int = 3,
    epoch: int = 1,
    counter: int = 1,
    utime: int = 0,
    version: int = 3,
    secret: bytes = SECRET,
) -> tuple[str, bytes]:
    """A message under any header, with a right tag."""
    channel = messages.channel(messages.kind_of(message), robot)
    header = Header(version, robot, epoch, counter, utime)
    return channel, resealed(channel, messages.encode(header, message), secret)
