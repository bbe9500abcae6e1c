"""How each kind of message fills its LCM struct: there and back, and what is refused on the way.

Whatever a filler could not have made is refused with a phrase.
"""

from __future__ import annotations

import dataclasses
import math
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from message_builders import COVARIANCE, HEADER, a_status, kinds
from message_strategies import any_message

from drslamd import lcmtypes
from drslamd.conventions import Chain
from drslamd.gossip import messages
from drslamd.gossip.codecs import CODECS
from drslamd.gossip.message_types import Heard, LogState, Message, OdometryBatch, Status
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry, RangeMeasurement

PLAIN = (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.5)
"""Traits of a robot without a gyro."""


def through(message: Message) -> Message | str:
    return messages.decode(messages.kind_of(message), messages.encode(HEADER, message))


def is_same(a: Any, b: Any) -> bool:
    """Equality of messages, arrays and all."""
    if type(a) is not type(b):
        return False
    pairs = ((getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    return all(np.array_equal(x, y) if isinstance(x, np.ndarray) else x == y for x, y in pairs)


@settings(
    derandomize=True, max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
@given(any_message)
def test_every_message_comes_back_as_it_was(message: Message) -> None:
    assert is_same(through(message), message)


@pytest.mark.parametrize("kind", CODECS)
def test_a_message_of_each_kind_comes_back_as_it_was(kind: str) -> None:
    assert is_same(through(kinds()[kind]), kinds()[kind])


def test_positions_travel_in_tenths_of_millimetres_and_angles_in_tenths_of_milliradians() -> None:
    closure = ClosureMeasurement(
        0, True, 1, Chain(4, 5), 2, (1.23456, -0.00004, 0.00016), COVARIANCE
    )
    back = through(GraphEntry(0, closures=(closure,)))
    assert isinstance(back, GraphEntry)
    assert back.closures[0].a_T_b == pytest.approx((1.2346, 0.0, 0.0002), abs=1e-12)


def test_a_range_finer_than_a_millimetre_of_sigma_is_still_a_range() -> None:
    item = RangeMeasurement(1, Chain(4, 5), 2, (0.0, 0.0), (0.0, 0.0), 3.0, 0.0004)
    back = through(GraphEntry(0, ranges=(item,)))
    assert isinstance(back, GraphEntry)
    assert back.ranges[0].sigma_m == pytest.approx(0.001)


def test_turns_of_robots_travel_in_tenths_of_milliradians_and_corrections_in_fiftieths() -> None:
    peer, nowhere = Chain(4, 5), (0.0, 0.0)
    turned = RangeMeasurement(1, peer, 2, nowhere, nowhere, 3.0, 0.1, 0.12346, -3.14159)
    pose = (1.0, 2.0, 0.0)
    closure = ClosureMeasurement(
        0, True, 1, peer, 2, pose, COVARIANCE, (0.031, -0.029, 2.549, -1.999)
    )
    back = through(GraphEntry(0, ranges=(turned,), closures=(closure,)))
    assert isinstance(back, GraphEntry)
    assert back.ranges[0].turn_a == pytest.approx(0.1235, abs=1e-12)
    assert back.ranges[0].turn_b == pytest.approx(-3.1416, abs=1e-12)
    assert back.closures[0].corrected == pytest.approx((0.04, -0.02, 2.54, -2.0), abs=1e-12)


@pytest.mark.parametrize(("told", "heard"), [(2.54, 2.54), (2.56, 2.54), (-9.0, -2.54)])
def test_corrections_are_said_up_to_two_and_a_half_times(told: float, heard: float) -> None:
    closure = ClosureMeasurement(
        0, True, 1, Chain(4, 5), 2, (1.0, 2.0, 0.0), COVARIANCE, (0.0, told, told, 0.0)
    )
    back = through(GraphEntry(0, closures=(closure,)))
    assert isinstance(back, GraphEntry)
    assert back.closures[0].corrected == pytest.approx((0.0, heard, heard, 0.0))


def test_sample_k_of_a_batch_is_its_first_pose_plus_the_first_k_differences() -> None:
    """As odometry_t.lcm says."""
    steps = np.array([[10, 20, 30], [11, 18, 33], [15, 18, 32]], dtype=float)
    raw = lcmtypes.odometry_t.decode(messages.encode(HEADER, OdometryBatch(4, 5, steps)))
    assert (raw.x0, raw.y0, raw.theta0, raw.n0, raw.segment_start) == (10, 20, 30, 5, 4)
    assert (raw.dx, raw.dy, raw.dtheta) == ((1, 4), (-2, 0), (3, -1))


def test_what_lies_before_a_step_of_more_than_32767_is_left_out_of_a_batch() -> None:
    most = np.array([[0, 0, 0], [32_767, -32_767, 0]], dtype=float)
    assert is_same(through(OdometryBatch(5, 7, most)), OdometryBatch(5, 7, most))
    leap = np.array([[0, 0, 0], [1, 0, 0], [1, -32_767, 0], [2, 0, 0], [2, 0, 1]], dtype=float)
    assert is_same(through(OdometryBatch(5, 7, leap)), OdometryBatch(5, 7, leap))
    leap[2] = [1, -32_768, 0]
    assert is_same(through(OdometryBatch(5, 7, leap)), OdometryBatch(5, 10, leap[3:]))


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
    if last == "traits":
        raw.n_traits = len(value)
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
    ("GRAPH", "traits", (9.5, 2.0**-30, 1e-9, 1e-9, -9.5, 9.5, 0.0, 0.0)),
    ("GRAPH", "traits", (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 9.5)),
    ("GRAPH", "traits", (*PLAIN, 9.5, 2.0**-30, 0, 0, 0, 0)),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.5, 32_767, 65_534, 32_767, 65_535)),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.5, 1, 7, 1, 7)),
    ("GRAPH", "ranges", 0, "turn", (31_416, -31_416)),
    ("GRAPH", "closures", 0, "corrected", (127, -127, 127, -127)),
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
    ("PUBLIC", "keyframes", (0, 1)),
    ("PUBLIC", "round", 2**62 - 1),
    ("PUBLIC", "since", 0),
    ("PUBLIC", "since", 9),
    ("PUBLIC", "part", 0),
    ("PUBLIC", "part", 2),
    ("PUBLIC", "parts", 4_000),
    ("PUBLIC", "asks", 1),
    ("PUBLIC", "keyframes", (0, LAST_SAMPLE)),
    ("PUBLIC", "values", (1e6,) * 24),
]
REFUSED: list[tuple[Any, ...]] = [
    ("STATUS", "state", 5),
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
    ("GRAPH", "traits", (0.9 * 2.0**-30, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "traits", (0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "traits", (1.0, 1.0, 1.0, 10.0, 0.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "traits", (1.0, 1.0, 1.0, 1.0, 10.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "traits", (NAN, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "traits", (1.0, 1.0, 1.0, 1.0, 0.0, NAN, 0.0, 0.0)),
    ("GRAPH", "traits", (1.0, INF, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)),
    ("GRAPH", "traits", (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, -1e-9)),
    ("GRAPH", "traits", (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 10.0)),
    ("GRAPH", "traits", (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, NAN)),
    ("GRAPH", "traits", (*PLAIN, 10.0, 0.5, 0, 0, 0, 0)),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.0, 0, 0, 0, 0)),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.5, 0.5, 0, 1, 0)),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.5, -1, 0, 1, 0)),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.5, 0, 65_536, 2, 0)),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.5, 1, 7, 1, 6)),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.5, 0, 0, 32_768, 0)),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.5, 32_767, 65_535, 32_767, 65_535)),
    ("GRAPH", "traits", PLAIN[:7]),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.5, 0, 0, 0)),
    ("GRAPH", "traits", (*PLAIN, 0.5, 0.5, 0, 0, NAN, 0)),
    ("GRAPH", "ranges", 0, "turn", (31_417, 0)),
    ("GRAPH", "ranges", 0, "turn", (0, -31_417)),
    ("GRAPH", "closures", 0, "corrected", (0, -128, 0, 0)),
    ("GRAPH", "closures", 0, "corrected", (0, 0, 0, -128)),
    ("GRAPH", "n_traits", 5),
    ("GRAPH", "n_traits", 4),
    ("GRAPH", "n_traits", 7),
    ("GRAPH", "keyframes", 0, "n", -1),
    ("GRAPH", "keyframes", 0, "segment", -1),
    ("GRAPH", "peers", 0, "id", 256),
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
    ("POSE", "state", 5),
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
    ("PUBLIC", "keyframes", (-1, 40)),
    ("PUBLIC", "keyframes", (40, 40)),
    ("PUBLIC", "keyframes", (50, 40)),
    ("PUBLIC", "round", 2**62),
    ("PUBLIC", "round", 6),
    ("PUBLIC", "since", -1),
    ("PUBLIC", "since", 10),
    ("PUBLIC", "part", -1),
    ("PUBLIC", "part", 3),
    ("PUBLIC", "parts", 0),
    ("PUBLIC", "parts", 4_001),
    ("PUBLIC", "asks", 2),
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
    "keyframes": ("GRAPH", 39 + 5 + 32, ">h"),
    "peers": ("GRAPH", 39 + 5 + 32 + 2 + 18, ">h"),
    "ranges": ("GRAPH", 39 + 5 + 32 + 2 + 18 + 2 + 10, ">h"),
    "closures": ("GRAPH", 39 + 5 + 32 + 2 + 18 + 2 + 10 + 2 + 27, ">h"),
    "neighbours": ("PUBLIC", 39 + 33, ">h"),
    "public poses": ("PUBLIC", 39 + 35 + 20, ">h"),
    "values": ("PUBLIC", 39 + 35 + 20 + 2 + 8, ">i"),
    "places": ("HYPOTHESES", 39 + 20, ">h"),
    "motions": ("HYPOTHESES", 39 + 20 + 2 + 2 * 50, ">h"),
}
"""Where the counts stand in the messages of `kinds`, by the .lcm files."""


@pytest.mark.parametrize("change", [-128, -1, 1, 100])
@pytest.mark.parametrize("what", COUNTS)
def test_a_count_that_lies_is_refused(what: str, change: int) -> None:
    kind, at, form = COUNTS[what]
    payload = bytearray(messages.encode(HEADER, kinds()[kind]))
    (count,) = struct.unpack_from(form, payload, at)
    assert count in (1, 2, 3, 8, 24)
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
