"""Every number of every message at the borders of its type, sealed as its origin would seal it."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from typing import Any

import numpy as np
from message_builders import CORRECTED, COVARIANCE, SECOND, a_status, resealed

from drslamd.conventions import LAST_N, LAST_UTIME, Chain
from drslamd.gossip import messages
from drslamd.gossip.codecs import CODECS
from drslamd.gossip.epochs import LAST_CLOCK_EPOCH, MAX_EPOCH
from drslamd.gossip.message_types import (
    Heard,
    LogState,
    Message,
    OdometryBatch,
    Pose,
    PoseState,
)
from drslamd.gossip.seal import Header
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.robot_model import UNTOLD

LIAR = 2
"""Under whose seal the lies come."""
Path = tuple[Any, ...]
"""Names and places that lead to a number in an LCM struct."""


def whole(bits: int) -> list[int]:
    """Both ends of a type, zero, and what stands beside them."""
    least, most = -(2 ** (bits - 1)), 2 ** (bits - 1) - 1
    return [least, least + 1, -1, 0, 1, most - 1, most]


BORDERS: dict[str, list[Any]] = {
    "int8_t": whole(8),
    "int16_t": whole(16),
    "int32_t": [*whole(32), LAST_N],
    "int64_t": [*whole(64), LAST_UTIME, LAST_CLOCK_EPOCH, LAST_CLOCK_EPOCH + 2**32, MAX_EPOCH],
    "float": [
        math.nan,
        math.inf,
        -math.inf,
        3.4028234e38,
        -3.4028234e38,
        1e30,
        1.4e-45,
        -1.4e-45,
        -0.0,
        1.0,
        -1.0,
    ],
}


def numbers(raw: Any) -> Iterator[tuple[Path, str]]:
    """The way to each number of an LCM struct, and its type; of a list the first and the last.

    Counts are left out: bytes that do not fit them are no message.
    """
    counts = {name for size in raw.__dimensions__ if size for name in size}
    for name, kind, size in zip(raw.__slots__, raw.__typenames__, raw.__dimensions__, strict=True):
        value = getattr(raw, name)
        places: list[Path] = [(name,)]
        if size is not None and kind != "byte":
            places = [(name, at) for at in sorted({0, len(value) - 1}) if len(value)]
        for place in places:
            inner = at(raw, place)
            if hasattr(inner, "__typenames__"):
                yield from ((place + rest, k) for rest, k in numbers(inner))
            elif kind in BORDERS and name not in counts:
                yield place, kind


def at(raw: Any, path: Path) -> Any:
    for step in path:
        raw = raw[step] if isinstance(step, int) else getattr(raw, step)
    return raw


def put(raw: Any, path: Path, value: Any) -> None:
    """Set the number at the end of a way."""
    *way, last = path
    place = at(raw, tuple(way))
    if isinstance(last, int):
        # the generated classes give tuples
        *before, name = way
        items = list(place)
        items[last] = value
        setattr(at(raw, tuple(before)), name, items)
    else:
        setattr(place, last, value)


Lie = tuple[str, str, bytes]
"""What it says, its channel, its payload."""


def lies(header: Header, key: bytes, like: dict[str, Message]) -> Iterator[Lie]:
    """Messages of one robot, each with one number at a border.

    Args:
        header: of the first; each has the next counter, and an entry a number of its own, unless
            that is what lies.
        key: of the team.
        like: messages to begin with, by kind.
    """
    counter = header.counter
    for kind, message in like.items():
        head = Header(header.version, header.origin, header.epoch, counter, header.utime)
        encoded = messages.encode(head, message)
        for path, number in numbers(CODECS[kind].struct.decode(encoded)):
            for value in BORDERS[number]:
                raw = CODECS[kind].struct.decode(encoded)
                raw.header.counter = counter
                if kind == "GRAPH":
                    raw.seq += counter - header.counter
                counter += 1
                put(raw, path, value)
                channel = messages.channel(kind, header.origin)
                name = f"{kind} {'.'.join(map(str, path))} = {value}"
                yield name, channel, resealed(channel, raw.encode(), key)


def spoken(counter: int = 20) -> tuple[Header, dict[str, Message]]:
    """What robot 2 could say in the middle of the conversation, of each kind."""
    own, peer = Chain(LIAR, 1), Chain(0, 1)
    n = 1_040
    place = RangeMeasurement(n, peer, n, (0.25, 0.0), (-0.125, 0.5), 3.5, 0.125, 0.25, -0.5)
    pose = (1.5, -2.5, 0.25)
    closure = ClosureMeasurement(8, True, n, peer, n, pose, COVARIANCE, CORRECTED)
    header = Header(3, LIAR, 1, counter, 104 * SECOND)
    return header, {
        "STATUS": a_status(
            (Heard(0, 1, 7), Heard(1, 1, 7)),
            (LogState(*own, 0, 4, 4), LogState(*peer, 0, 4, 4)),
            uwb_clock_us=5,
            ranged=(0, 1),
        ),
        "ODOMETRY": OdometryBatch(1_000, n, np.arange(9.0).reshape(3, 3)),
        "GRAPH": GraphEntry(4, UNTOLD, (Keyframe(n, 0, 1, 2, 3),), (place,), (closure,)),
        "POSE": Pose(PoseState.LOCALISED, 0, 1, 104 * SECOND, (1.25, -2.5, 3.0), COVARIANCE),
        "PUBLIC": PublicPoses(
            0, 1, 2, (n, n + 5), np.ones((3, 4), dtype=complex), round=5, since=4, held=((1, 3),)
        ),
    }


def sampled(lies: Iterator[Lie], count: int, seed: int = 0) -> list[Lie]:
    """Some of them."""
    everything = list(lies)
    return random.Random(seed).sample(everything, min(count, len(everything)))


def borders_are_complete() -> bool:
    """Are all types that the messages use among `BORDERS`, but for structs, tags and counts?"""
    used = {kind for codec in CODECS.values() for kind in codec.struct.__typenames__}
    plain = {kind for kind in used if not kind.startswith("drslamd") and kind != "byte"}
    return plain <= BORDERS.keys()
