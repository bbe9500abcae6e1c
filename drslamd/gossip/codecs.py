"""How each kind of message fills its LCM struct, and how it is read back.

A reader trusts nothing: it raises ValueError (or IndexError) for whatever its filler could not
have made, so that reading and filling again gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from drslamd import lcmtypes
from drslamd.conventions import (
    LAST_N,
    LAST_UTIME,
)
from drslamd.gossip import bounds
from drslamd.gossip.bounds import LONGEST_STEP, bounded
from drslamd.gossip.entries import stretches
from drslamd.gossip.entries.chapter_packing import packed, unpacked
from drslamd.gossip.entries.hypothesis_codecs import fill_hypotheses, read_hypotheses
from drslamd.gossip.entries.measurement_codecs import (
    filled,
    filled_closure,
    filled_peer,
    filled_range,
    peers_of,
    read_closure,
    read_keyframe,
    read_model,
    read_peer,
    read_range,
    traits_of,
)
from drslamd.gossip.message_types import (
    MAX_BATCH,
    MAX_BEYOND,
    MAX_HEARD,
    MAX_LOGS,
    NOTHING_WANTED,
    Heard,
    Hypotheses,
    LogState,
    OdometryBatch,
    Pose,
    Status,
)
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.public_poses import MAX_HELD, MAX_PUBLIC, PublicPoses


class Codec(NamedTuple):
    """One kind of message and its LCM struct."""

    message: type[Any]
    struct: type[Any]
    fill: Callable[[Any, Any], None]
    read: Callable[[Any], Any]


# status


def _fill_status(out: Any, m: Status) -> None:
    out.state, out.frame, out.leaving = m.state, m.frame, int(m.leaving)
    out.uwb_id, out.uwb_clock_us, out.graph_hash = m.uwb_id, m.uwb_clock_us, m.graph_hash
    out.heard = [filled(lcmtypes.heard_t, h) for h in m.heard]
    logs, out.beyond = stretches.packed(m.logs)
    out.logs = [filled(lcmtypes.log_t, log) for log in logs]
    out.ranged = list(m.ranged)
    out.n_heard, out.n_logs, out.n_ranged = len(m.heard), len(logs), len(m.ranged)
    out.n_beyond = len(out.beyond)


def _read_status(raw: Any) -> Status:
    bounded("heard", raw.n_heard, 0, MAX_HEARD)
    bounded("logs", raw.n_logs, 0, MAX_LOGS)
    bounded("bytes about gaps", raw.n_beyond, 0, MAX_BEYOND)
    bounded("ranged", raw.n_ranged, 0, MAX_HEARD)
    logs = tuple(
        LogState(bounds.robot(r.id), bounds.epoch(r.epoch), r.first, r.complete, r.newest)
        for r in raw.logs
    )
    if any(not 0 <= log.first <= log.complete <= log.newest for log in logs):
        raise ValueError("log that ends before it starts")
    return Status(
        state=bounds.pose_state(raw.state),
        frame=bounds.robot(raw.frame),
        leaving=bool(bounds.flag(raw.leaving)),
        uwb_id=bounded("uwb id", raw.uwb_id, 0, bounds.MAX_UWB_ID),
        uwb_clock_us=bounds.uwb_clock(raw.uwb_clock_us),
        graph_hash=raw.graph_hash,
        heard=tuple(_read_heard(h) for h in raw.heard),
        ranged=tuple(bounds.robot(robot) for robot in raw.ranged),
        logs=stretches.unpacked(logs, raw.beyond),
    )


def _read_heard(raw: Any) -> Heard:
    return Heard(
        bounds.robot(raw.id),
        bounds.epoch(raw.epoch),
        bounded("delay", raw.delay_us, -LAST_UTIME, LAST_UTIME),
        bounded("sample wanted", raw.wanted_n, NOTHING_WANTED, LAST_N + 1),
    )


# odometry


def _fill_odometry(out: Any, m: OdometryBatch) -> None:
    """What lies before a step that is too long to be said is left out: a hole, not a fault."""
    change = np.diff(m.steps.astype(int), axis=0)
    too_long = np.flatnonzero((np.abs(change) > LONGEST_STEP).any(axis=1))
    first = int(too_long[-1]) + 1 if len(too_long) else 0
    out.segment_start, out.n0, out.n = m.segment_start, m.n0 + first, len(change) - first
    out.x0, out.y0, out.theta0 = (int(v) for v in m.steps[first])
    out.dx, out.dy, out.dtheta = change[first:].T.tolist()


def _read_odometry(raw: Any) -> OdometryBatch:
    bounded("differences", raw.n, 0, MAX_BATCH - 1)
    bounded("last sample", raw.n0 + raw.n, 0, LAST_N)
    if not 0 <= raw.segment_start <= raw.n0:
        raise ValueError("segment starts after its samples")
    change = np.array([raw.dx, raw.dy, raw.dtheta], dtype=float).T
    first = np.array([[raw.x0, raw.y0, raw.theta0]], dtype=float)
    steps = np.cumsum(np.concatenate([first, change]), axis=0)
    if (np.abs(steps) > bounds.LAST_STEP).any():
        raise ValueError("steps that lead out of their 32 bits")
    return OdometryBatch(raw.segment_start, raw.n0, steps)


# graph


def _fill_graph(out: Any, m: GraphEntry) -> None:
    peers = peers_of(m)
    number = {peer: k for k, peer in enumerate(peers)}
    traits = traits_of(m.model) if m.model else ()
    out.seq, out.traits, out.n_traits = m.seq, list(traits), len(traits)
    out.peers = [filled_peer(chain) for chain in peers]
    out.keyframes = [filled(lcmtypes.keyframe_t, k) for k in m.keyframes]
    out.ranges = [filled_range(item, number[item.peer]) for item in m.ranges]
    out.closures = [filled_closure(item, number[item.peer]) for item in m.closures]
    out.n_keyframes, out.n_peers = len(m.keyframes), len(peers)
    out.n_ranges, out.n_closures = len(m.ranges), len(m.closures)
    out.packed = packed(m.chapter) if m.chapter else b""
    out.n_packed = len(out.packed)


def _read_graph(raw: Any) -> GraphEntry:
    # their upper bound is that all of them fit one datagram
    counts = raw.n_keyframes, raw.n_peers, raw.n_ranges, raw.n_closures
    if min(*counts, raw.n_packed) < 0:
        raise ValueError("negative number")
    seq = bounded("entry", raw.seq, 0, bounds.LAST_SEQ)
    if raw.n_packed:
        if any(counts) or raw.n_traits:
            raise ValueError("chapter that says something beside it")
        return GraphEntry(seq, chapter=unpacked(raw.packed, seq))
    model = read_model(raw.traits) if raw.n_traits else None
    peers = [read_peer(p) for p in raw.peers]
    keyframes = tuple(read_keyframe(k) for k in raw.keyframes)
    ranges = tuple(read_range(r, peers) for r in raw.ranges)
    closures = tuple(read_closure(c, peers) for c in raw.closures)
    entry = GraphEntry(seq, model, keyframes, ranges, closures)
    if peers != peers_of(entry):
        raise ValueError("peers that are not those of the measurements")
    return entry


# poses


def _fill_pose(out: Any, m: Pose) -> None:
    out.state, out.frame, out.frame_epoch = m.state, m.frame, m.frame_epoch
    out.pose_utime, out.covariance = m.pose_utime, list(m.covariance)
    out.x, out.y, out.theta = m.pose


def _read_pose(raw: Any) -> Pose:
    pose, covariance = (raw.x, raw.y, raw.theta), tuple(raw.covariance)
    if not bounds.is_pose(pose, covariance):
        raise ValueError("pose or covariance that is none")
    return Pose(
        bounds.pose_state(raw.state),
        bounds.robot(raw.frame),
        bounds.epoch(raw.frame_epoch),
        bounded("time", raw.pose_utime, 0, LAST_UTIME),
        pose,
        covariance,
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
    bounded("rank", raw.rank, 1, bounds.MAX_RANK)
    if raw.n < 0 or raw.n_values != 4 * raw.rank * (raw.n + 1):
        raise ValueError("sizes that do not fit each other")
    bounded("move", raw.round, 0, bounds.LAST_ROUND)
    bounded("move before", raw.since, 0, raw.round)
    bounded("parts", raw.parts, 1, MAX_PUBLIC)
    bounded("part", raw.part, 0, raw.parts - 1)
    bounded("neighbours", raw.n_held, 0, MAX_HELD)
    values = np.array(raw.values, dtype=float).view(complex).reshape(raw.n + 1, 2 * raw.rank)
    public = PublicPoses(
        frame=bounds.robot(raw.frame),
        frame_epoch=bounds.epoch(raw.frame_epoch),
        rank=raw.rank,
        keyframes=tuple(bounds.sample(n) for n in raw.keyframes),
        values=values,
        round=raw.round,
        since=raw.since,
        part=raw.part,
        parts=raw.parts,
        asks=bool(bounds.flag(raw.asks)),
        held=tuple(_read_held(held) for held in raw.held),
    )
    if (np.diff(raw.keyframes) <= 0).any():
        raise ValueError("keyframes out of order")
    if not bounds.is_sayable(public):
        raise ValueError("lifted pose that no team can reach")
    return public


def _read_held(raw: Any) -> tuple[int, int]:
    return bounds.robot(raw.id), bounded("move", raw.round, 0, bounds.LAST_ROUND)


CODECS = {
    "STATUS": Codec(Status, lcmtypes.status_t, _fill_status, _read_status),
    "ODOMETRY": Codec(OdometryBatch, lcmtypes.odometry_t, _fill_odometry, _read_odometry),
    "GRAPH": Codec(GraphEntry, lcmtypes.graph_t, _fill_graph, _read_graph),
    "POSE": Codec(Pose, lcmtypes.pose_t, _fill_pose, _read_pose),
    "PUBLIC": Codec(PublicPoses, lcmtypes.public_poses_t, _fill_public, _read_public),
    "HYPOTHESES": Codec(Hypotheses, lcmtypes.hypotheses_t, fill_hypotheses, read_hypotheses),
}
