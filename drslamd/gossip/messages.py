"""What is said: typed messages, and their passage through the LCM types of `drslamd.lcmtypes`.

`encode` and `decode` are inverse for every message whose numbers are already whole steps (rounding
is done where a number is born). `decode` accepts only what `encode` could have made: counts within
their bounds, every number finite, no byte left over.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from io import BytesIO
from typing import Any, Union, cast

import numpy as np

from drslamd import lcmtypes
from drslamd.conventions import MAX_ROBOT_ID, ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain
from drslamd.gossip.seal import Header
from drslamd.slam.items import ClosureItem, GraphEntry, Keyframe, PublicPoses, RangeItem
from drslamd.slam.se2 import Array

CHANNEL_PREFIX = "DRSLAM_"
UNKNOWN_CLOCK = -(2**63)
MILLIMETRE = 1e-3

MAX_HEARD = 32
"""Peers named in one status: with `MAX_LOGS` it still fits one datagram."""
MAX_LOGS = 32
MAX_BATCH = 150
"""Odometry samples in one message: 15 s, 900 bytes."""


@dataclass(frozen=True)
class Heard:
    id: int
    epoch: int
    delay_us: int


@dataclass(frozen=True)
class LogState:
    """Of one log: held from `first` to `complete`, heard of below `newest`."""

    id: int
    epoch: int
    first: int
    complete: int
    newest: int


@dataclass(frozen=True)
class Status:
    state: int
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
    state: int
    frame: int
    frame_epoch: int
    pose_utime: int
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0)
    covariance: tuple[float, ...] = (0.0,) * 6


Message = Union[Status, OdometryBatch, GraphEntry, Pose, PublicPoses]

KINDS: dict[str, tuple[type[Any], type[Any]]] = {
    "STATUS": (Status, lcmtypes.status_t),
    "ODOMETRY": (OdometryBatch, lcmtypes.odometry_t),
    "GRAPH": (GraphEntry, lcmtypes.graph_t),
    "POSE": (Pose, lcmtypes.pose_t),
    "PUBLIC": (PublicPoses, lcmtypes.public_poses_t),
}
FINGERPRINTS = {kind: types[1]._get_packed_fingerprint() for kind, types in KINDS.items()}
_KIND_OF = {types[0]: kind for kind, types in KINDS.items()}

DECODE_EXCEPTIONS = (ValueError, struct.error, IndexError, OverflowError)
"""What the generated decoders raise on bytes that are not theirs."""


def channel(kind: str, robot: int) -> str:
    return f"{CHANNEL_PREFIX}{kind}_{robot:03d}"


def kind_of_channel(name: str) -> str | None:
    """The kind that a channel carries, None when it is not one of ours."""
    kind = name.removeprefix(CHANNEL_PREFIX).rpartition("_")[0]
    return kind if name.startswith(CHANNEL_PREFIX) and kind in KINDS else None


def kind_of(message: Message) -> str:
    return _KIND_OF[type(message)]


def encode(header: Header, message: Message) -> bytes:
    """LCM bytes with an empty tag."""
    out = KINDS[kind_of(message)][1]()
    out.header.version, out.header.origin = header.version, header.origin
    out.header.epoch, out.header.counter = header.epoch, header.counter
    out.header.utime, out.header.tag = header.utime, bytes(16)
    _ENCODERS[type(message)](out, message)
    return bytes(out.encode())


def decode(kind: str, payload: bytes) -> Message | str:
    """The message, or one phrase that says what is wrong with it."""
    stream = BytesIO(payload)
    try:
        raw = KINDS[kind][1].decode(stream)
        if stream.read(1):
            return "bytes left over"
        return cast(Message, _DECODERS[kind](raw))
    except DECODE_EXCEPTIONS as error:
        return str(error) or type(error).__name__


# ---- one pair of functions for each kind -------------------------------------------------------


def _encode_status(out: Any, m: Status) -> None:
    out.state, out.frame, out.leaving = m.state, m.frame, int(m.leaving)
    out.uwb_id, out.uwb_clock_us, out.graph_hash = m.uwb_id, m.uwb_clock_us, m.graph_hash
    out.heard = [_filled(lcmtypes.heard_t, h) for h in m.heard]
    out.logs = [_filled(lcmtypes.log_t, log) for log in m.logs]
    out.ranged = list(m.ranged)
    out.n_heard, out.n_logs, out.n_ranged = len(m.heard), len(m.logs), len(m.ranged)


def _decode_status(raw: Any) -> Status:
    _bounded("heard", raw.n_heard, MAX_HEARD)
    _bounded("logs", raw.n_logs, MAX_LOGS)
    _bounded("ranged", raw.n_ranged, MAX_HEARD)
    logs = tuple(LogState(r.id, r.epoch, r.first, r.complete, r.newest) for r in raw.logs)
    if any(not 0 <= log.first <= log.complete <= log.newest for log in logs):
        raise ValueError("log that ends before it starts")
    heard = tuple(Heard(h.id, h.epoch, h.delay_us) for h in raw.heard)
    for robot in [log.id for log in logs] + [h.id for h in heard]:
        _robot(robot)
    if raw.state not in (0, 1):
        raise ValueError(f"state {raw.state}")
    return Status(raw.state, raw.frame, bool(raw.leaving), raw.uwb_id, raw.uwb_clock_us,
                  raw.graph_hash, heard, tuple(raw.ranged), logs)  # fmt: skip


def _encode_odometry(out: Any, m: OdometryBatch) -> None:
    steps = m.steps.astype(int)
    out.segment_start, out.n0, out.n = m.segment_start, m.n0, len(steps)
    out.x0, out.y0, out.theta0 = (int(v) for v in steps[0])
    change = np.diff(steps, axis=0, prepend=steps[:1])
    out.dx, out.dy, out.dtheta = (column.tolist() for column in change.T)


def _decode_odometry(raw: Any) -> OdometryBatch:
    _bounded("samples", raw.n, MAX_BATCH, least=1)
    change = np.array([raw.dx, raw.dy, raw.dtheta], dtype=float).T
    change[0] += [raw.x0, raw.y0, raw.theta0]
    if raw.segment_start > raw.n0 or raw.segment_start < 0:
        raise ValueError("segment starts after its samples")
    return OdometryBatch(raw.segment_start, raw.n0, np.cumsum(change, axis=0))


def _encode_graph(out: Any, m: GraphEntry) -> None:
    out.seq, out.traits, out.n_traits = m.seq, list(m.traits), len(m.traits)
    peers = sorted({*(r.peer for r in m.ranges), *(c.peer for c in m.closures)})
    out.peers = [_peer(chain) for chain in peers]
    number = {peer: k for k, peer in enumerate(peers)}
    out.keyframes = [_filled(lcmtypes.keyframe_t, k) for k in m.keyframes]
    for item in m.ranges:
        r = lcmtypes.range_t()
        r.a_n, r.b_n, r.peer = item.a_n, item.b_n, number[item.peer]
        r.qa = [round(v / MILLIMETRE) for v in item.q_a]
        r.qb = [round(v / MILLIMETRE) for v in item.q_b]
        r.range = round(item.range_m / TRANSLATION_STEP_M)
        r.sigma = round(item.sigma_m / MILLIMETRE)
        out.ranges.append(r)
    for closure in m.closures:
        c = lcmtypes.closure_t()
        c.number, c.kept, c.a_n, c.b_n = closure.number, closure.kept, closure.a_n, closure.b_n
        c.peer = number[closure.peer]
        c.x, c.y = (round(v / TRANSLATION_STEP_M) for v in closure.a_T_b[:2])
        c.theta = round(closure.a_T_b[2] / ROTATION_STEP_RAD)
        c.covariance = list(closure.covariance)
        out.closures.append(c)
    out.n_keyframes, out.n_peers = len(m.keyframes), len(peers)
    out.n_ranges, out.n_closures = len(m.ranges), len(m.closures)


def _decode_graph(raw: Any) -> GraphEntry:
    # one datagram holds no more than MAX_PAYLOAD allows; the counts are bounded by it
    if raw.seq < 0 or min(raw.n_keyframes, raw.n_peers, raw.n_ranges, raw.n_closures) < 0:
        raise ValueError("negative number")
    if raw.n_traits not in (0, 6):
        raise ValueError("traits that are not six")
    if not all(0 < v < 10 for v in raw.traits[:4]) or not all(-10 < v < 10 for v in raw.traits[4:]):
        raise ValueError("traits out of range")
    peers = [Chain(_robot(p.id), p.epoch) for p in raw.peers]
    keyframes = tuple(Keyframe(k.n, k.segment, k.x, k.y, k.theta) for k in raw.keyframes)
    if any(k.n < 0 or k.segment < 0 for k in keyframes):
        raise ValueError("negative keyframe")
    ranges = tuple(_decode_range(r, peers) for r in raw.ranges)
    closures = tuple(_decode_closure(c, peers) for c in raw.closures)
    return GraphEntry(raw.seq, tuple(raw.traits), keyframes, ranges, closures)


def _decode_range(r: Any, peers: list[Chain]) -> RangeItem:
    if r.peer < 0 or r.sigma <= 0:
        raise ValueError("range without peer or sigma")
    q_a, q_b = ((q[0] * MILLIMETRE, q[1] * MILLIMETRE) for q in (r.qa, r.qb))
    return RangeItem(r.a_n, peers[r.peer], r.b_n, q_a, q_b,
                     r.range * TRANSLATION_STEP_M, r.sigma * MILLIMETRE)  # fmt: skip


def _decode_closure(c: Any, peers: list[Chain]) -> ClosureItem:
    xx, xy, xt, yy, yt, tt = c.covariance
    full = np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]])
    if c.peer < 0 or not np.isfinite(full).all() or np.linalg.eigvalsh(full)[0] <= 0:
        raise ValueError("closure without peer or with a covariance that is none")
    pose = (c.x * TRANSLATION_STEP_M, c.y * TRANSLATION_STEP_M, c.theta * ROTATION_STEP_RAD)
    return ClosureItem(c.number, bool(c.kept), c.a_n, peers[c.peer], c.b_n, pose,
                       tuple(c.covariance))  # fmt: skip


def _encode_pose(out: Any, m: Pose) -> None:
    out.state, out.frame, out.frame_epoch = m.state, m.frame, m.frame_epoch
    out.pose_utime, out.covariance = m.pose_utime, list(m.covariance)
    out.x, out.y, out.theta = m.pose


def _decode_pose(raw: Any) -> Pose:
    values = (raw.x, raw.y, raw.theta, *raw.covariance)
    if not all(map(math.isfinite, values)) or raw.state not in (0, 1):
        raise ValueError("pose that is not finite")
    return Pose(raw.state, raw.frame, raw.frame_epoch, raw.pose_utime,
                (raw.x, raw.y, raw.theta), tuple(raw.covariance))  # fmt: skip


def _encode_public(out: Any, m: PublicPoses) -> None:
    out.frame, out.frame_epoch, out.rank = m.frame, m.frame_epoch, m.rank
    out.n, out.keyframes = len(m.keyframes), list(m.keyframes)
    out.values = np.ascontiguousarray(m.values).view(float).ravel().tolist()
    out.n_values = len(out.values)


def _decode_public(raw: Any) -> PublicPoses:
    if raw.n < 0 or raw.rank < 1 or raw.n_values != 4 * raw.rank * (raw.n + 1):
        raise ValueError("sizes that do not fit each other")
    values = np.array(raw.values, dtype=float)
    if not np.isfinite(values).all():
        raise ValueError("lifted pose that is not finite")
    values = values.view(complex).reshape(raw.n + 1, 2 * raw.rank)
    return PublicPoses(raw.frame, raw.frame_epoch, raw.rank, tuple(raw.keyframes), values)


def _peer(chain: Chain) -> Any:
    out = lcmtypes.peer_t()
    out.id, out.epoch = chain
    return out


def _filled(kind: type[Any], values: Any) -> Any:
    """An LCM struct whose fields carry the names of the dataclass `values`."""
    out = kind()
    for name in kind.__slots__:
        setattr(out, name, getattr(values, name))
    return out


def _bounded(what: str, count: int, most: int, least: int = 0) -> None:
    if not least <= count <= most:
        raise ValueError(f"{count} {what}, allowed are {least} to {most}")


def _robot(robot: int) -> int:
    if not 0 <= robot <= MAX_ROBOT_ID:
        raise ValueError(f"robot id {robot}")
    return robot


_ENCODERS: dict[type[Any], Any] = {
    Status: _encode_status,
    OdometryBatch: _encode_odometry,
    GraphEntry: _encode_graph,
    Pose: _encode_pose,
    PublicPoses: _encode_public,
}
_DECODERS: dict[str, Any] = {
    "STATUS": _decode_status,
    "ODOMETRY": _decode_odometry,
    "GRAPH": _decode_graph,
    "POSE": _decode_pose,
    "PUBLIC": _decode_public,
}
