"""What others call a message: whatever `encode` could not have made is refused with a phrase."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from message_builders import HEADER, a_status, kinds

from drslamd import lcmtypes
from drslamd.gossip import messages
from drslamd.gossip.codecs import CODECS
from drslamd.gossip.message_types import Heard, LogState, Message, OdometryBatch, Status
from drslamd.gossip.seal import Header


def raw_of(kind: str) -> Any:
    return CODECS[kind].struct.decode(messages.encode(HEADER, kinds()[kind]))


def verdict(kind: str, *path: Any) -> Message | str:
    """What becomes of a message in whose LCM struct the field at `path` has the last value."""
    raw = raw_of(kind)
    *way, last, value = path
    at = raw
    for step in way:
        at = at[step] if isinstance(step, int) else getattr(at, step)
    setattr(at, last, value)
    return messages.decode(kind, raw.encode())


def named(case: tuple[Any, ...]) -> str:
    *path, value = case
    return f"{'.'.join(map(str, path))}={value}"


NAN, INF = math.nan, math.inf
LAST_SAMPLE = 2**31 - 2
"""One past it has still 32 bits."""
LAST_TIME = 100_000 * LAST_SAMPLE
ACCEPTED: list[tuple[Any, ...]] = [
    ("STATUS", "state", 0),
    ("STATUS", "state", 3),
    ("STATUS", "frame", 254),
    ("STATUS", "leaving", 0),
    ("STATUS", "uwb_id", 2**32 - 1),
    ("STATUS", "heard", 0, "id", 254),
    ("STATUS", "heard", 0, "epoch", 0),
    ("STATUS", "heard", 0, "epoch", 2**62),
    ("STATUS", "heard", 0, "delay_us", LAST_TIME),
    ("STATUS", "heard", 0, "delay_us", -LAST_TIME),
    ("STATUS", "heard", 0, "wanted_n", -1),
    ("STATUS", "heard", 0, "wanted_n", 2**31 - 1),
    ("STATUS", "uwb_clock_us", -(2**63)),
    ("STATUS", "uwb_clock_us", 2 * LAST_TIME),
    ("STATUS", "uwb_clock_us", -2 * LAST_TIME),
    ("STATUS", "logs", 0, "epoch", 2**62),
    ("STATUS", "logs", 0, "first", 5),
    ("STATUS", "logs", 0, "newest", 5),
    ("ODOMETRY", "segment_start", 40),
    ("ODOMETRY", "segment_start", 0),
    ("ODOMETRY", "n0", LAST_SAMPLE - 2),
    ("ODOMETRY", "x0", 2**31 - 1 - 11),
    ("ODOMETRY", "y0", -(2**31) + 1),
    ("GRAPH", "seq", 0),
    ("GRAPH", "seq", 2**31 - 2),
    ("GRAPH", "peers", 0, "epoch", 2**62),
    ("GRAPH", "keyframes", 0, "n", LAST_SAMPLE),
    ("GRAPH", "keyframes", 0, "segment", 2**15 - 1),
    ("GRAPH", "keyframes", 0, "theta", -(2**31)),
    ("GRAPH", "ranges", 0, "a_n", LAST_SAMPLE),
    ("GRAPH", "ranges", 0, "b_n", LAST_SAMPLE),
    ("GRAPH", "ranges", 0, "range", 99_999_999),
    ("GRAPH", "ranges", 0, "range", -99_999_999),
    ("GRAPH", "closures", 0, "number", 2**31 - 1),
    ("GRAPH", "closures", 0, "a_n", LAST_SAMPLE),
    ("GRAPH", "closures", 0, "x", -99_999_999),
    ("GRAPH", "closures", 0, "theta", 31_416),
    ("GRAPH", "closures", 0, "covariance", (2e-8, 0, 0, 89_000, 0, 2e-8)),
    ("GRAPH", "traits", (9.5, 2.0**-30, 1e-9, 1e-9, -9.5, 9.5, 0.0)),
    ("GRAPH", "keyframes", 0, "n", 0),
    ("GRAPH", "ranges", 0, "sigma", 1),
    ("GRAPH", "ranges", 0, "range", -5000),
    ("GRAPH", "closures", 0, "kept", 0),
    ("GRAPH", "closures", 0, "covariance", (1, 0.99, 0, 1, 0, 1)),
    ("POSE", "state", 0),
    ("POSE", "state", 3),
    ("POSE", "x", 1e6),
    ("POSE", "theta", -math.pi),
    ("POSE", "frame_epoch", 2**62),
    ("POSE", "pose_utime", 0),
    ("POSE", "pose_utime", LAST_TIME),
    ("POSE", "covariance", (1e12, 0, 0, 0, 0, 0)),
    ("PUBLIC", "keyframes", (0, 0)),
    ("PUBLIC", "keyframes", (0, LAST_SAMPLE)),
    ("PUBLIC", "values", (1e6,) * 24),
]
REFUSED: list[tuple[Any, ...]] = [
    ("STATUS", "state", 4),
    ("STATUS", "state", -1),
    ("STATUS", "frame", 255),
    ("STATUS", "frame", -1),
    ("STATUS", "leaving", 2),
    ("STATUS", "uwb_id", 2**32),
    ("STATUS", "uwb_id", -1),
    ("STATUS", "heard", 0, "id", 255),
    ("STATUS", "heard", 0, "id", -1),
    ("STATUS", "heard", 0, "epoch", -1),
    ("STATUS", "heard", 0, "epoch", 2**62 + 1),
    ("STATUS", "heard", 0, "delay_us", LAST_TIME + 1),
    ("STATUS", "heard", 0, "delay_us", -LAST_TIME - 1),
    ("STATUS", "heard", 0, "wanted_n", -2),
    ("STATUS", "uwb_clock_us", -(2**63) + 1),
    ("STATUS", "uwb_clock_us", 2 * LAST_TIME + 1),
    ("STATUS", "uwb_clock_us", -2 * LAST_TIME - 1),
    ("STATUS", "logs", 0, "epoch", -1),
    ("STATUS", "logs", 0, "epoch", 2**62 + 1),
    ("STATUS", "ranged", (4, 255)),
    ("STATUS", "logs", 0, "id", 255),
    ("STATUS", "logs", 0, "first", -1),
    ("STATUS", "logs", 0, "first", 6),
    ("STATUS", "logs", 0, "newest", 4),
    ("ODOMETRY", "segment_start", 41),
    ("ODOMETRY", "segment_start", -1),
    ("ODOMETRY", "n0", LAST_SAMPLE - 1),
    ("ODOMETRY", "x0", 2**31 - 11),
    ("ODOMETRY", "y0", -(2**31)),
    ("GRAPH", "seq", -1),
    ("GRAPH", "seq", 2**31 - 1),
    ("GRAPH", "peers", 0, "epoch", -1),
    ("GRAPH", "peers", 0, "epoch", 2**62 + 1),
    ("GRAPH", "keyframes", 0, "n", LAST_SAMPLE + 1),
    ("GRAPH", "ranges", 0, "a_n", LAST_SAMPLE + 1),
    ("GRAPH", "ranges", 0, "b_n", LAST_SAMPLE + 1),
    ("GRAPH", "ranges", 0, "range", 100_000_000),
    ("GRAPH", "ranges", 0, "range", -100_000_000),
    ("GRAPH", "closures", 0, "b_n", LAST_SAMPLE + 1),
    ("GRAPH", "closures", 0, "x", 100_000_000),
    ("GRAPH", "closures", 0, "y", -100_000_000),
    ("GRAPH", "closures", 0, "theta", -31_417),
    ("GRAPH", "closures", 0, "covariance", (0.9e-8, 0, 0, 1, 0, 1)),
    ("GRAPH", "closures", 0, "covariance", (1, 0, 0, 91_000, 0, 1)),
    ("GRAPH", "traits", (0.9 * 2.0**-30, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "traits", (0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "traits", (1.0, 1.0, 1.0, 10.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "traits", (1.0, 1.0, 1.0, 1.0, 10.0, 0.0, 0.0)),
    ("GRAPH", "traits", (NAN, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "traits", (1.0, 1.0, 1.0, 1.0, 0.0, NAN, 0.0)),
    ("GRAPH", "traits", (1.0, INF, 1.0, 1.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "n_traits", 5),
    ("GRAPH", "n_traits", 4),
    ("GRAPH", "keyframes", 0, "n", -1),
    ("GRAPH", "keyframes", 0, "segment", -1),
    ("GRAPH", "peers", 0, "id", 255),
    ("GRAPH", "ranges", 0, "peer", 1),
    ("GRAPH", "ranges", 0, "peer", -1),
    ("GRAPH", "ranges", 0, "a_n", -1),
    ("GRAPH", "ranges", 0, "b_n", -1),
    ("GRAPH", "ranges", 0, "sigma", 0),
    ("GRAPH", "ranges", 0, "sigma", -1),
    ("GRAPH", "closures", 0, "kept", 2),
    ("GRAPH", "closures", 0, "peer", 1),
    ("GRAPH", "closures", 0, "peer", -1),
    ("GRAPH", "closures", 0, "number", -1),
    ("GRAPH", "closures", 0, "a_n", -1),
    ("GRAPH", "closures", 0, "b_n", -1),
    ("GRAPH", "closures", 0, "covariance", (0, 0, 0, 1, 0, 1)),
    ("GRAPH", "closures", 0, "covariance", (1, 0, 0, 1, 0, -1)),
    ("GRAPH", "closures", 0, "covariance", (1, 1.01, 0, 1, 0, 1)),
    ("GRAPH", "closures", 0, "covariance", (1, NAN, 0, 1, 0, 1)),
    ("GRAPH", "closures", 0, "covariance", (1, 0, 0, INF, 0, 1)),
    ("POSE", "state", 4),
    ("POSE", "state", -1),
    ("POSE", "frame", -1),
    ("POSE", "x", NAN),
    ("POSE", "y", -1.0001e6),
    ("POSE", "theta", INF),
    ("POSE", "theta", 3.1418),
    ("POSE", "frame_epoch", 2**62 + 1),
    ("POSE", "pose_utime", -1),
    ("POSE", "pose_utime", LAST_TIME + 1),
    ("POSE", "covariance", (1.0001e12, 0, 0, 0, 0, 0)),
    ("POSE", "covariance", (1, 0, 0, -1e-9, 0, 1)),
    ("POSE", "covariance", (1, 0, 0, 1, -INF, 1)),
    ("PUBLIC", "frame", 255),
    ("PUBLIC", "rank", 0),
    ("PUBLIC", "rank", 3),
    ("PUBLIC", "frame_epoch", -1),
    ("PUBLIC", "n", 1),
    ("PUBLIC", "keyframes", (40, -1)),
    ("PUBLIC", "keyframes", (40, LAST_SAMPLE + 1)),
    ("PUBLIC", "values", (0.0,) * 23 + (-1.0001e6,)),
    ("PUBLIC", "values", (NAN,) * 24),
    ("PUBLIC", "values", (0.0,) * 23 + (INF,)),
    ("PUBLIC", "n_values", 23),
]


@pytest.mark.parametrize("case", ACCEPTED, ids=named)
def test_a_value_at_its_bound_is_accepted(case: tuple[Any, ...]) -> None:
    assert not isinstance(verdict(*case), str)


@pytest.mark.parametrize("case", REFUSED, ids=named)
def test_a_value_beyond_its_bound_is_refused_with_a_phrase(case: tuple[Any, ...]) -> None:
    answer = verdict(*case)
    assert isinstance(answer, str)
    assert answer


COUNTS = {
    "heard": ("STATUS", 39 + 28, ">h"),
    "ranged": ("STATUS", 39 + 28 + 2 + 22, ">h"),
    "logs": ("STATUS", 39 + 28 + 2 + 22 + 2 + 4, ">h"),
    "samples": ("ODOMETRY", 39 + 20, ">h"),
    "traits": ("GRAPH", 39 + 4, ">b"),
    "keyframes": ("GRAPH", 39 + 5 + 28, ">h"),
    "peers": ("GRAPH", 39 + 5 + 28 + 2 + 18, ">h"),
    "ranges": ("GRAPH", 39 + 5 + 28 + 2 + 18 + 2 + 10, ">h"),
    "closures": ("GRAPH", 39 + 5 + 28 + 2 + 18 + 2 + 10 + 2 + 23, ">h"),
    "public poses": ("PUBLIC", 39 + 12, ">h"),
    "values": ("PUBLIC", 39 + 14 + 8, ">i"),
}
"""Where the counts stand in the messages of `kinds`, by the .lcm files."""


@pytest.mark.parametrize("change", [-128, -1, 1, 100])
@pytest.mark.parametrize("what", COUNTS)
def test_a_count_that_lies_is_refused(what: str, change: int) -> None:
    kind, at, form = COUNTS[what]
    payload = bytearray(messages.encode(HEADER, kinds()[kind]))
    (count,) = struct.unpack_from(form, payload, at)
    assert count in (1, 2, 3, 7, 24)
    struct.pack_into(form, payload, at, max(-128, count + change))
    assert isinstance(messages.decode(kind, bytes(payload)), str)


@pytest.mark.parametrize(
    "change",
    [
        lambda raw: raw.peers.append(raw.peers[0]),
        lambda raw: raw.peers.insert(0, lcmtypes.peer_t()),
    ],
)
def test_peers_that_no_item_names_are_refused(change: Callable[[Any], object]) -> None:
    raw = raw_of("GRAPH")
    change(raw)
    raw.n_peers += 1
    assert isinstance(messages.decode("GRAPH", raw.encode()), str)


@pytest.mark.parametrize(
    ("heard", "logs", "ranged", "fits"),
    [
        (28, 28, 28, True),
        (29, 0, 0, False),
        (0, 29, 0, False),
        (0, 0, 29, False),
    ],
)
def test_a_status_names_at_most_28_of_each(heard: int, logs: int, ranged: int, fits: bool) -> None:
    status = a_status(
        tuple(Heard(k, 1, 0) for k in range(heard)),
        tuple(LogState(k, 1, 0, 0, 0) for k in range(logs)),
        ranged=tuple(range(ranged)),
    )
    answer = messages.decode("STATUS", messages.encode(HEADER, status))
    assert isinstance(answer, Status) == fits


@pytest.mark.parametrize(("samples", "fits"), [(1, True), (150, True), (151, False)])
def test_a_batch_has_at_most_150_samples(samples: int, fits: bool) -> None:
    batch = OdometryBatch(0, 0, np.zeros((samples, 3)))
    answer = messages.decode("ODOMETRY", messages.encode(HEADER, batch))
    assert isinstance(answer, OdometryBatch) == fits


@pytest.mark.parametrize("kind", CODECS)
def test_bytes_left_over_are_refused(kind: str) -> None:
    payload = messages.encode(HEADER, kinds()[kind])
    assert messages.decode(kind, payload + b"\0") == "bytes left over"


@pytest.mark.parametrize("kind", CODECS)
def test_a_message_cut_at_any_byte_is_refused(kind: str) -> None:
    payload = messages.encode(HEADER, kinds()[kind])
    for length in range(len(payload)):
        assert isinstance(messages.decode(kind, payload[:length]), str)


@pytest.mark.parametrize("kind", CODECS)
def test_a_message_under_the_name_of_another_kind_is_refused(kind: str) -> None:
    for other in set(CODECS) - {kind}:
        assert isinstance(messages.decode(other, messages.encode(HEADER, kinds()[kind])), str)


def is_judged(kind: str, payload: bytes) -> bool:
    """Refused, or a message that `encode` makes again from what was read."""
    message = messages.decode(kind, payload)
    if isinstance(message, str):
        return bool(message)
    head = CODECS[kind].struct.decode(payload).header
    header = Header(head.version, head.origin, head.epoch, head.counter, head.utime)
    again = messages.encode(header, message)
    return bool(again[:31] + head.tag + again[39:] == payload)


@pytest.mark.parametrize("kind", CODECS)
def test_a_message_with_any_bit_flipped_is_refused_or_says_what_it_says(kind: str) -> None:
    payload = messages.encode(HEADER, kinds()[kind])
    for bit in range(8 * len(payload)):
        flipped = bytearray(payload)
        flipped[bit // 8] ^= 1 << bit % 8
        assert is_judged(kind, bytes(flipped)), bit


@pytest.mark.parametrize("kind", CODECS)
def test_random_bytes_behind_a_fingerprint_are_judged(kind: str) -> None:
    draw = random.Random(kind)
    head = messages.encode(HEADER, kinds()[kind])[:39]
    for _ in range(3_000):
        kept = draw.choice([0, 8, 39])
        assert is_judged(kind, head[:kept] + draw.randbytes(draw.randrange(200)))
