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
    ROTATION_STEP_RAD,
    TRANSLATION_STEP_M,
    Chain,
)
from drslamd.gossip import bounds
from drslamd.gossip.bounds import LEAST_SIGMA, LONGEST_STEP, MAX_TRAIT, TRAITS, bounded
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
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.public_poses import MAX_HELD, MAX_PUBLIC, PublicPoses
from drslamd.slam.robot_model import RobotModel

MILLIMETRE_M = 1e-3
CORRECTION_STEP = 1 / 50
"""Of the scale and turn with which a closure was found."""
MOST_STEPS = 127
"""Of a correction: 2.5 times."""


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
    out.heard = [_filled(lcmtypes.heard_t, h) for h in m.heard]
    out.logs = [_filled(lcmtypes.log_t, log) for log in m.logs]
    out.ranged = list(m.ranged)
    out.n_heard, out.n_logs, out.n_ranged = len(m.heard), len(m.logs), len(m.ranged)


def _read_status(raw: Any) -> Status:
    bounded("heard", raw.n_heard, 0, MAX_HEARD)
    bounded("logs", raw.n_logs, 0, MAX_LOGS)
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
        logs=logs,
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
    peers = _peers(m)
    number = {peer: k for k, peer in enumerate(peers)}
    traits = _traits(m.model) if m.model else ()
    out.seq, out.traits, out.n_traits = m.seq, list(traits), len(traits)
    out.peers = [_filled_peer(chain) for chain in peers]
    out.keyframes = [_filled(lcmtypes.keyframe_t, k) for k in m.keyframes]
    out.ranges = [_filled_range(item, number[item.peer]) for item in m.ranges]
    out.closures = [_filled_closure(item, number[item.peer]) for item in m.closures]
    out.n_keyframes, out.n_peers = len(m.keyframes), len(peers)
    out.n_ranges, out.n_closures = len(m.ranges), len(m.closures)


def _read_graph(raw: Any) -> GraphEntry:
    # their upper bound is that all of them fit one datagram
    if min(raw.n_keyframes, raw.n_peers, raw.n_ranges, raw.n_closures) < 0:
        raise ValueError("negative number")
    if raw.n_traits not in (0, TRAITS):
        raise ValueError(f"{raw.n_traits} traits, allowed are {TRAITS} or none")
    sigmas, antenna, half_track = raw.traits[:4], raw.traits[4:7], raw.traits[7:]
    if not all(LEAST_SIGMA <= v < MAX_TRAIT for v in sigmas):
        raise ValueError("sigma out of range")
    if not all(abs(v) < MAX_TRAIT for v in antenna):
        raise ValueError("antenna out of range")
    if not all(0 <= v < MAX_TRAIT for v in half_track):
        raise ValueError("track out of range")
    model = RobotModel.of_numbers(tuple(raw.traits)) if raw.n_traits else None
    peers = [Chain(bounds.robot(p.id), bounds.epoch(p.epoch)) for p in raw.peers]
    keyframes = tuple(_read_keyframe(k) for k in raw.keyframes)
    ranges = tuple(_read_range(r, peers) for r in raw.ranges)
    closures = tuple(_read_closure(c, peers) for c in raw.closures)
    seq = bounded("entry", raw.seq, 0, bounds.LAST_SEQ)
    entry = GraphEntry(seq, model, keyframes, ranges, closures)
    if peers != _peers(entry):
        raise ValueError("peers that are not those of the measurements")
    return entry


def _traits(model: RobotModel) -> tuple[float, ...]:
    numbers = model.numbers()
    return (*(max(sigma, LEAST_SIGMA) for sigma in numbers[:4]), *numbers[4:])


def _peers(entry: GraphEntry) -> list[Chain]:
    """Whom the measurements of an entry refer to, each named once."""
    return sorted({*(r.peer for r in entry.ranges), *(c.peer for c in entry.closures)})


def _filled_peer(chain: Chain) -> Any:
    out = lcmtypes.peer_t()
    out.id, out.epoch = chain
    return out


def _read_keyframe(k: Any) -> Keyframe:
    segment = bounded("segment", k.segment, 0, bounds.LAST_SEGMENT)
    return Keyframe(bounds.sample(k.n), segment, k.x, k.y, k.theta)


def _filled_range(item: RangeMeasurement, peer: int) -> Any:
    out = lcmtypes.range_t()
    out.a_n, out.peer, out.b_n = item.a_n, peer, item.b_n
    out.qa, out.qb = ([round(v / MILLIMETRE_M) for v in q] for q in (item.q_a, item.q_b))
    out.range = round(item.range_m / TRANSLATION_STEP_M)
    out.sigma = max(1, round(item.sigma_m / MILLIMETRE_M))
    out.turn = [round(turn / ROTATION_STEP_RAD) for turn in (item.turn_a, item.turn_b)]
    return out


def _read_range(r: Any, peers: list[Chain]) -> RangeMeasurement:
    if r.peer < 0 or r.sigma < 1:
        raise ValueError("range without peer or sigma")
    range_m = r.range * TRANSLATION_STEP_M
    if not bounds.is_range(range_m):
        raise ValueError(f"range of {range_m} m")
    q_a, q_b = ((q[0] * MILLIMETRE_M, q[1] * MILLIMETRE_M) for q in (r.qa, r.qb))
    turn_a, turn_b = (turn * ROTATION_STEP_RAD for turn in r.turn)
    if max(abs(turn_a), abs(turn_b)) > bounds.MAX_ANGLE:
        raise ValueError("robots turned by more than half a turn")
    return RangeMeasurement(
        a_n=bounds.sample(r.a_n),
        peer=peers[r.peer],
        b_n=bounds.sample(r.b_n),
        q_a=q_a,
        q_b=q_b,
        range_m=range_m,
        sigma_m=r.sigma * MILLIMETRE_M,
        turn_a=turn_a,
        turn_b=turn_b,
    )


def _filled_closure(item: ClosureMeasurement, peer: int) -> Any:
    out = lcmtypes.closure_t()
    out.number, out.kept = item.number, int(item.kept)
    out.a_n, out.peer, out.b_n = item.a_n, peer, item.b_n
    out.x, out.y = (round(v / TRANSLATION_STEP_M) for v in item.a_T_b[:2])
    out.theta = round(item.a_T_b[2] / ROTATION_STEP_RAD)
    out.covariance = list(item.covariance)
    steps = (round(part / CORRECTION_STEP) for part in item.corrected)
    out.corrected = [max(-MOST_STEPS, min(MOST_STEPS, step)) for step in steps]
    return out


def _read_closure(c: Any, peers: list[Chain]) -> ClosureMeasurement:
    if min(c.peer, c.number) < 0:
        raise ValueError("closure without peer or number")
    pose = (c.x * TRANSLATION_STEP_M, c.y * TRANSLATION_STEP_M, c.theta * ROTATION_STEP_RAD)
    covariance = tuple(c.covariance)
    if not bounds.is_closure(pose, covariance):
        raise ValueError("closure with a pose or a covariance that is none")
    for steps in c.corrected:
        bounded("correction", steps, -MOST_STEPS, MOST_STEPS)
    a_scale, a_turn, b_scale, b_turn = (steps * CORRECTION_STEP for steps in c.corrected)
    corrected = a_scale, a_turn, b_scale, b_turn
    return ClosureMeasurement(
        number=c.number,
        kept=bool(bounds.flag(c.kept)),
        a_n=bounds.sample(c.a_n),
        peer=peers[c.peer],
        b_n=bounds.sample(c.b_n),
        a_T_b=pose,
        covariance=covariance,
        corrected=corrected,
    )


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


# parts


def _filled(kind: type[Any], values: Any) -> Any:
    """An LCM struct whose fields carry the names of the dataclass `values`."""
    out = kind()
    for name in kind.__slots__:
        setattr(out, name, getattr(values, name))
    return out


CODECS = {
    "STATUS": Codec(Status, lcmtypes.status_t, _fill_status, _read_status),
    "ODOMETRY": Codec(OdometryBatch, lcmtypes.odometry_t, _fill_odometry, _read_odometry),
    "GRAPH": Codec(GraphEntry, lcmtypes.graph_t, _fill_graph, _read_graph),
    "POSE": Codec(Pose, lcmtypes.pose_t, _fill_pose, _read_pose),
    "PUBLIC": Codec(PublicPoses, lcmtypes.public_poses_t, _fill_public, _read_public),
}
