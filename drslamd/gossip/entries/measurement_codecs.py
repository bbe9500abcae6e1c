"""How keyframes, ranges, closures and models fill their LCM structs, and how they are read back.

A reader raises ValueError (or IndexError) for whatever its filler could not have made.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from drslamd import lcmtypes
from drslamd.conventions import (
    FIRST_NODE,
    LAST_N,
    ROTATION_STEP_RAD,
    TRANSLATION_STEP_M,
    Chain,
    is_node,
    node_chain,
)
from drslamd.gossip import bounds
from drslamd.gossip.bounds import LEAST_SIGMA, MAX_TRAIT, bounded
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.robot_model import BY_GYRO, PLAIN, SPLIT, RobotModel

NODES = 255
"""In the place of a peer's id: a module that no robot carries, its UWB id in the place of the epoch
(`MAX_ROBOT_ID` leaves that number free)."""
MILLIMETRE_M = 1e-3
CORRECTION_STEP = 1 / 50
"""Of the scale and turn with which a closure was found."""
MOST_STEPS = 127
"""Of a correction: 2.5 times."""


def filled(kind: type[Any], values: Any) -> Any:
    """An LCM struct whose fields carry the names of the dataclass `values`."""
    out = kind()
    for name in kind.__slots__:
        setattr(out, name, getattr(values, name))
    return out


def traits_of(model: RobotModel) -> tuple[float, ...]:
    """As they travel: 8 numbers, of a robot whose heading comes from a gyro 14."""
    numbers = model.numbers()
    sigmas = (*numbers[:4], *numbers[PLAIN : PLAIN + 2])
    told = [max(sigma, LEAST_SIGMA) for sigma in sigmas]
    return (*told[:4], *numbers[4:PLAIN], *told[4:], *numbers[PLAIN + 2 :])


def read_model(traits: Sequence[float]) -> RobotModel:
    """What a robot's sensors are like."""
    if len(traits) not in (PLAIN, BY_GYRO):
        raise ValueError(f"{len(traits)} traits, allowed are {PLAIN}, {BY_GYRO} or none")
    sigmas, antenna = (*traits[:4], *traits[PLAIN : PLAIN + 2]), traits[4 : PLAIN - 1]
    if not all(LEAST_SIGMA <= v < MAX_TRAIT for v in sigmas):
        raise ValueError("sigma out of range")
    if not all(abs(v) < MAX_TRAIT for v in antenna):
        raise ValueError("antenna out of range")
    if not 0 <= traits[PLAIN - 1] < MAX_TRAIT:
        raise ValueError("track out of range")
    if not all(0 <= v < SPLIT and v == int(v) for v in traits[PLAIN + 2 :]):
        raise ValueError("samples of a gyro that are no whole numbers of 16 bits")
    model = RobotModel.of_numbers(tuple(traits))
    gyro = model.noise.gyro
    if gyro is not None and (
        gyro.since > min(gyro.until, LAST_N) or (gyro.until > LAST_N and not gyro.is_in_use)
    ):
        raise ValueError("a gyro that was used until before it was used")
    return model


def read_peer(p: Any) -> Chain:
    if p.id == NODES:
        return node_chain(bounded("uwb id", p.epoch, 0, bounds.MAX_UWB_ID))
    return Chain(bounds.robot(p.id), bounds.epoch(p.epoch))


def said_peer(chain: Chain) -> tuple[int, int]:
    """The id and the epoch that stand for a peer in a message."""
    return (NODES, chain.robot - FIRST_NODE) if is_node(chain.robot) else chain


def peers_of(entry: GraphEntry) -> list[Chain]:
    """Whom the measurements of an entry refer to, each named once."""
    return sorted({*(r.peer for r in entry.ranges), *(c.peer for c in entry.closures)})


def filled_peer(chain: Chain) -> Any:
    out = lcmtypes.peer_t()
    out.id, out.epoch = said_peer(chain)
    return out


def read_keyframe(k: Any) -> Keyframe:
    segment = bounded("segment", k.segment, 0, bounds.LAST_SEGMENT)
    return Keyframe(bounds.sample(k.n), segment, k.x, k.y, k.theta)


def filled_range(item: RangeMeasurement, peer: int) -> Any:
    out = lcmtypes.range_t()
    out.a_n, out.peer, out.b_n = item.a_n, peer, item.b_n
    out.qa, out.qb = ([round(v / MILLIMETRE_M) for v in q] for q in (item.q_a, item.q_b))
    out.range = round(item.range_m / TRANSLATION_STEP_M)
    out.sigma = max(1, round(item.sigma_m / MILLIMETRE_M))
    out.turn = [round(turn / ROTATION_STEP_RAD) for turn in (item.turn_a, item.turn_b)]
    return out


def read_range(r: Any, peers: list[Chain]) -> RangeMeasurement:
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


def filled_closure(item: ClosureMeasurement, peer: int) -> Any:
    out = lcmtypes.closure_t()
    out.number, out.kept = item.number, int(item.kept)
    out.a_n, out.peer, out.b_n = item.a_n, peer, item.b_n
    out.x, out.y = (round(v / TRANSLATION_STEP_M) for v in item.a_T_b[:2])
    out.theta = round(item.a_T_b[2] / ROTATION_STEP_RAD)
    out.covariance = list(item.covariance)
    steps = (round(part / CORRECTION_STEP) for part in item.corrected)
    out.corrected = [max(-MOST_STEPS, min(MOST_STEPS, step)) for step in steps]
    return out


def read_closure(c: Any, peers: list[Chain]) -> ClosureMeasurement:
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
