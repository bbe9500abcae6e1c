"""The benchmark's own message: relative poses in full precision.

No robot says such things, so the daemon's types know nothing of them. Everything around them is the
daemon's: the envelope that its seal judges, the seal, LCM's datagrams and their largest size.

    8 bytes    FINGERPRINT, where LCM has that of a type
    31 bytes   header_t, as `drslamd.gossip.seal` reads it
    4, 2       number in the log of the origin; peer
    48 each    a_n, b_n; x, y, theta; tau, kappa

Big-endian, without gaps. How many there are follows from the length.
"""

from __future__ import annotations

import struct
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.gossip.lc02 import MAX_PAYLOAD
from drslamd.gossip.seal import TAG_BYTES, Header

FINGERPRINT = b"drslab-1"

EDGE = np.dtype(
    [
        ("a_n", ">i4"),
        ("b_n", ">i4"),
        ("x", ">f8"),
        ("y", ">f8"),
        ("theta", ">f8"),
        ("tau", ">f8"),
        ("kappa", ">f8"),
    ]
)
"""Pose a_T_b of the peer's keyframe b_n in the origin's a_n, m and rad; information of one axis of
the position, 1/m^2, and of the angle, 1/rad^2."""

_HEAD = struct.Struct(f">8sbhqiq{TAG_BYTES}sih")
MOST = (MAX_PAYLOAD - _HEAD.size) // EDGE.itemsize
"""Relative poses in one datagram: 28."""


@dataclass(frozen=True)
class RelativePoses:
    """One entry of a robot's log.

    Attributes:
        seq: in the log, from 0.
        peer: robot whose keyframes b_n are; those of a_n are the origin's.
        edges: (k,) of EDGE.
    """

    seq: int
    peer: int
    edges: NDArray[np.void]


def channel(robot: int) -> str:
    """As long as the daemon's."""
    return f"DRSLAM_EDGES_{robot:03d}"


def encode(header: Header, poses: RelativePoses) -> bytes:
    """Bytes with an empty tag."""
    head = _HEAD.pack(FINGERPRINT, *astuple(header), bytes(TAG_BYTES), poses.seq, poses.peer)
    return head + poses.edges.tobytes()


def decode(payload: bytes) -> RelativePoses:
    """What `encode` made.

    Raises:
        ValueError: there is a part of a relative pose too much.
    """
    *_, seq, peer = _HEAD.unpack_from(payload)
    return RelativePoses(seq, peer, np.frombuffer(payload, EDGE, offset=_HEAD.size))
