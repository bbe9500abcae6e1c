"""How each kind of message fills its LCM struct, and how it is read back.

A reader trusts nothing: it raises ValueError (or IndexError) for whatever its filler could not
have made, so that reading and filling again gives the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from drslamd import lcmtypes
from drslamd.conventions import MAX_ROBOT_ID, ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain
from drslamd.gossip.message_types import (
    MAX_BATCH,
    MAX_HEARD,
    MAX_LOGS,
    NOTHING_WANTED,
    Heard,
    LogState,
    OdometryBatch,
    Pose,
    Status,
)
from drslamd.slam import se2
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.public_poses import MAX_HELD, PublicPoses
from drslamd.slam.robot_model import RobotModel

MILLIMETRE_M = 1e-3
LONGEST_STEP = 2**15 - 1
"""Between two samples: 3.2 m or 3.2 rad in a tenth of a second."""
TRAITS = 7
MAX_ROUND = 2**62
"""Far from where one more would not be a number of 64 bits; see `pose_exchange.LEAP`."""
MAX_TRAIT = 10.0
MAX_UWB_ID = 2**32 - 1


class Codec(NamedTuple):
    """One kind of message and its LCM struct."""

    message: type[Any]
    struct: type[Any]
    fill: Callable[[Any, Any], None]
    read: Callable[[Any], Any]


# ---- status ------------------------------------------------------------------------------------


def _fill_status(out: Any, m: Status) -> None:
    out.state, out.frame, out.leaving = m.state, m.frame, int(m.leaving)
    out.uwb_id, out.uwb_clock_us, out.graph_hash = m.uwb_id, m.uwb_clock_us, m.graph_hash
    out.heard = [_filled(lcmtypes.heard_t, h) for h in m.heard]
    out.logs = [_filled(lcmtypes.log_t, log) for log in m.logs]
    out.ranged = list(m.ranged)
    out.n_heard, out.n_logs, out.n_ranged = len(m.heard), len(m.logs), len(m.ranged)


def _read_status(raw: Any) -> Status:
    _bounded("heard", raw.n_heard, 0, MAX_HEARD)
    _bounded("logs", raw.n_logs, 0, MAX_LOGS)
    _bounded("ranged", raw.n_ranged, 0, MAX_HEARD)
    _bounded("uwb id", raw.uwb_id, 0, MAX_UWB_ID)
    logs = tuple(LogState(_robot(r.id), r.epoch, r.first, r.complete, r.newest) for r in raw.logs)
    if any(not 0 <= log.first <= log.complete <= log.newest for log in logs):
        raise ValueError("log that ends before it starts")
    heard = tuple(Heard(_robot(h.id), h.epoch, h.delay_us, h.wanted_n) for h in raw.heard)
    if any(h.wanted_n < NOTHING_WANTED for h in heard):
        raise ValueError("odometry before the first sample wanted")
    ranged = tuple(_robot(robot) for robot in raw.ranged)
    return Status(
        state=_flag(raw.state),
        frame=_robot(raw.frame),
        leaving=bool(_flag(raw.leaving)),
        uwb_id=raw.uwb_id,
        uwb_clock_us=raw.uwb_clock_us,
        graph_hash=raw.graph_hash,
        heard=heard,
        ranged=ranged,
        logs=logs,
    )


# ---- odometry ----------------------------------------------------------------------------------


def _fill_odometry(out: Any, m: OdometryBatch) -> None:
    """What lies before a step that is too long to be said is left out: a hole, not a fault."""
    change = np.diff(m.steps.astype(int), axis=0)
    too_long = np.flatnonzero((np.abs(change) > LONGEST_STEP).any(axis=1))
    first = int(too_long[-1]) + 1 if len(too_long) else 0
    out.segment_start, out.n0, out.n = m.segment_start, m.n0 + first, len(change) - first
    out.x0, out.y0, out.theta0 = (int(v) for v in m.steps[first])
    out.dx, out.dy, out.dtheta = change[first:].T.tolist()


def _read_odometry(raw: Any) -> OdometryBatch:
    _bounded("differences", raw.n, 0, MAX_BATCH - 1)
    change = np.array([raw.dx, raw.dy, raw.dtheta], dtype=float).T
    if not 0 <= raw.segment_start <= raw.n0:
        raise ValueError("segment starts after its samples")
    first = np.array([[raw.x0, raw.y0, raw.theta0]], dtype=float)
    steps = np.cumsum(np.concatenate([first, change]), axis=0)
    return OdometryBatch(raw.segment_start, raw.n0, steps)


# ---- graph -------------------------------------------------------------------------------------


def _fill_graph(out: Any, m: GraphEntry) -> None:
    peers = _peers(m)
    number = {peer: k for k, peer in enumerate(peers)}
    traits = m.model.numbers() if m.model else ()
    out.seq, out.traits, out.n_traits = m.seq, list(traits), len(traits)
    out.peers = [_filled_peer(chain) for chain in peers]
    out.keyframes = [_filled(lcmtypes.keyframe_t, k) for k in m.keyframes]
    out.ranges = [_filled_range(item, number[item.peer]) for item in m.ranges]
    out.closures = [_filled_closure(item, number[item.peer]) for item in m.closures]
    out.n_keyframes, out.n_peers = len(m.keyframes), len(peers)
    out.n_ranges, out.n_closures = len(m.ranges), len(m.closures)


def _read_graph(raw: Any) -> GraphEntry:
    # their upper bound is that all of them fit one datagram
    if min(raw.seq, raw.n_keyframes, raw.n_peers, raw.n_ranges, raw.n_closures) < 0:
        raise ValueError("negative number")
    if raw.n_traits not in (0, TRAITS):
        raise ValueError(f"{raw.n_traits} traits, allowed are {TRAITS} or none")
    sigmas, antenna = raw.traits[:4], raw.traits[4:]
    if not all(0 < v < MAX_TRAIT for v in sigmas) or not all(abs(v) < MAX_TRAIT for v in antenna):
        raise ValueError("traits out of range")
    model = RobotModel.of_numbers(tuple(raw.traits)) if raw.n_traits else None
    peers = [Chain(_robot(p.id), p.epoch) for p in raw.peers]
    keyframes = tuple(Keyframe(k.n, k.segment, k.x, k.y, k.theta) for k in raw.keyframes)
    if any(k.n < 0 or k.segment < 0 for k in keyframes):
        raise ValueError("negative keyframe")
    ranges = tuple(_read_range(r, peers) for r in raw.ranges)
    closures = tuple(_read_closure(c, peers) for c in raw.closures)
    entry = GraphEntry(raw.seq, model, keyframes, ranges, closures)
    if peers != _peers(entry):
        raise ValueError("peers that are not those of the measurements")
    return entry


def _peers(entry: GraphEntry) -> list[Chain]:
    """Whom the measurements of an entry refer to, each named once."""
    return sorted({*(r.peer for r in entry.ranges), *(c.peer for c in entry.closures)})


def _filled_peer(chain: Chain) -> Any:
    out = lcmtypes.peer_t()
    out.id, out.epoch = chain
    return out


def _filled_range(item: RangeMeasurement, peer: int) -> Any:
    out = lcmtypes.range_t()
    out.a_n, out.peer, out.b_n = item.a_n, peer, item.b_n
    out.qa, out.qb = ([round(v / MILLIMETRE_M) for v in q] for q in (item.q_a, item.q_b))
    out.range = round(item.range_m / TRANSLATION_STEP_M)
    out.sigma = max(1, round(item.sigma_m / MILLIMETRE_M))
    return out


def _read_range(r: Any, peers: list[Chain]) -> RangeMeasurement:
    if min(r.peer, r.a_n, r.b_n) < 0 or r.sigma < 1:
        raise ValueError("range without peer, keyframe or sigma")
    q_a, q_b = ((q[0] * MILLIMETRE_M, q[1] * MILLIMETRE_M) for q in (r.qa, r.qb))
    return RangeMeasurement(
        a_n=r.a_n,
        peer=peers[r.peer],
        b_n=r.b_n,
        q_a=q_a,
        q_b=q_b,
        range_m=r.range * TRANSLATION_STEP_M,
        sigma_m=r.sigma * MILLIMETRE_M,
    )


def _filled_closure(item: ClosureMeasurement, peer: int) -> Any:
    out = lcmtypes.closure_t()
    out.number, out.kept = item.number, int(item.kept)
    out.a_n, out.peer, out.b_n = item.a_n, peer, item.b_n
    out.x, out.y = (round(v / TRANSLATION_STEP_M) for v in item.a_T_b[:2])
    out.theta = round(item.a_T_b[2] / ROTATION_STEP_RAD)
    out.covariance = list(item.covariance)
    return out


def _read_closure(c: Any, peers: list[Chain]) -> ClosureMeasurement:
    if min(c.peer, c.number, c.a_n, c.b_n) < 0:
        raise ValueError("closure without peer, number or keyframe")
    full = se2.unpacked(c.covariance)
    if not np.isfinite(full).all() or np.linalg.eigvalsh(full)[0] <= 0:
        raise ValueError("closure with a covariance that is none")
    pose = (c.x * TRANSLATION_STEP_M, c.y * TRANSLATION_STEP_M, c.theta * ROTATION_STEP_RAD)
    return ClosureMeasurement(
        number=c.number,
        kept=bool(_flag(c.kept)),
        a_n=c.a_n,
        peer=peers[c.peer],
        b_n=c.b_n,
        a_T_b=pose,
        covariance=tuple(c.covariance),
    )


# ---- poses -------------------------------------------------------------------------------------


def _fill_pose(out: Any, m: Pose) -> None:
    out.state, out.frame, out.frame_epoch = m.state, m.frame, m.frame_epoch
    out.pose_utime, out.covariance = m.pose_utime, list(m.covariance)
    out.x, out.y, out.theta = m.pose


def _read_pose(raw: Any) -> Pose:
    pose, covariance = (raw.x, raw.y, raw.theta), tuple(raw.covariance)
    if not all(map(math.isfinite, pose + covariance)):
        raise ValueError("pose that is not finite")
    return Pose(
        _flag(raw.state), _robot(raw.frame), raw.frame_epoch, raw.pose_utime, pose, covariance
    )


def _fill_public(out: Any, m: PublicPoses) -> None:
    out.frame, out.frame_epoch, out.rank = m.frame, m.frame_epoch, m.rank
    out.round, out.since, out.part, out.parts = m.round, m.since, m.part, m.parts
    out.asks, out.n_held = int(m.asks), len(m.held)
    out.held = [_filled_held(robot, held) for robot, held in m.held]
    out.n, out.keyframes = len(m.keyframes), list(m.keyframes)
    out.values = np.ascontiguousarray(m.values).view(float).ravel().tolist()
    out.n_values = len(out.values)


def _filled_held(robot: int, held: int) -> Any:
    out = lcmtypes.held_t()
    out.id, out.round = robot, held
    return out


def _read_public(raw: Any) -> PublicPoses:
    if raw.n < 0 or raw.rank < 1 or raw.n_values != 4 * raw.rank * (raw.n + 1):
        raise ValueError("sizes that do not fit each other")
    if any(n < 0 for n in raw.keyframes) or (np.diff(raw.keyframes) <= 0).any():
        raise ValueError("keyframes out of order")
    if not 0 <= raw.since <= raw.round < MAX_ROUND or not 0 <= raw.part < raw.parts:
        raise ValueError("part of nothing")
    _bounded("neighbours", raw.n_held, 0, MAX_HELD)
    held = tuple((_robot(h.id), h.round) for h in raw.held)
    if any(not 0 <= count < MAX_ROUND for _, count in held):
        raise ValueError("move before the first")
    values = np.array(raw.values, dtype=float)
    if not np.isfinite(values).all():
        raise ValueError("lifted pose that is not finite")
    return PublicPoses(
        frame=_robot(raw.frame),
        frame_epoch=raw.frame_epoch,
        rank=raw.rank,
        keyframes=tuple(raw.keyframes),
        values=values.view(complex).reshape(raw.n + 1, 2 * raw.rank),
        round=raw.round,
        since=raw.since,
        part=raw.part,
        parts=raw.parts,
        asks=bool(_flag(raw.asks)),
        held=held,
    )


# ---- parts -------------------------------------------------------------------------------------


def _filled(kind: type[Any], values: Any) -> Any:
    """An LCM struct whose fields carry the names of the dataclass `values`."""
    out = kind()
    for name in kind.__slots__:
        setattr(out, name, getattr(values, name))
    return out


def _bounded(what: str, value: int, least: int, most: int) -> None:
    if not least <= value <= most:
        raise ValueError(f"{what}: {value}, allowed are {least} to {most}")


def _robot(robot: int) -> int:
    _bounded("robot id", robot, 0, MAX_ROBOT_ID)
    return robot


def _flag(value: int) -> int:
    _bounded("flag", value, 0, 1)
    return value


CODECS = {
    "STATUS": Codec(Status, lcmtypes.status_t, _fill_status, _read_status),
    "ODOMETRY": Codec(OdometryBatch, lcmtypes.odometry_t, _fill_odometry, _read_odometry),
    "GRAPH": Codec(GraphEntry, lcmtypes.graph_t, _fill_graph, _read_graph),
    "POSE": Codec(Pose, lcmtypes.pose_t, _fill_pose, _read_pose),
    "PUBLIC": Codec(PublicPoses, lcmtypes.public_poses_t, _fill_public, _read_public),
}
