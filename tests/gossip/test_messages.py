"""Messages to LCM bytes and back: nothing is changed."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from message_builders import COVARIANCE, HEADER, kinds

from drslamd import lcmtypes
from drslamd.conventions import Chain
from drslamd.gossip import messages
from drslamd.gossip.codecs import CODECS
from drslamd.gossip.message_types import (
    UNKNOWN_CLOCK,
    Heard,
    LogState,
    Message,
    OdometryBatch,
    Pose,
    PoseState,
    Status,
)
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.robot_model import RobotModel

i16 = st.integers(-(2**15), 2**15 - 1)
i32 = st.integers(-(2**31), 2**31 - 1)
i64 = st.integers(-(2**63), 2**63 - 1)
n32 = st.integers(0, 2**31 - 1)
samples = st.integers(0, 2**31 - 2)
times = st.integers(0, 100_000 * (2**31 - 2))
robots = st.integers(0, 254)
epochs = st.integers(0, 2**62)
chains = st.builds(Chain, robots, epochs)
metres = st.floats(-1e6, 1e6, width=32)
variances = st.floats(0.0, 2.0**39, width=32)
states = st.sampled_from(PoseState)


def millimetres(steps: int) -> float:
    return steps * 1e-3


def tenths(steps: int) -> float:
    return steps * 1e-4


covariances = st.tuples(variances, metres, metres, variances, metres, variances)
diagonals = st.floats(2**-20, 2**16, width=32).map(lambda v: (v, 0.0, 0.0, v, 0.0, v))
log_states = st.builds(
    lambda robot, epoch, numbers: LogState(robot, epoch, *sorted(numbers)),
    robot=robots,
    epoch=epochs,
    numbers=st.tuples(n32, n32, n32),
)
delays = st.one_of(times, times.map(lambda v: -v))
heard = st.builds(Heard, robots, epochs, delays, st.integers(-1, 2**31 - 1))
statuses = st.builds(
    Status,
    state=states,
    frame=robots,
    leaving=st.booleans(),
    uwb_id=st.integers(0, 2**32 - 1),
    uwb_clock_us=st.one_of(st.just(UNKNOWN_CLOCK), delays),
    graph_hash=i64,
    heard=st.lists(heard, max_size=28).map(tuple),
    ranged=st.lists(robots, max_size=28).map(tuple),
    logs=st.lists(log_states, max_size=28).map(tuple),
)
batches = st.builds(
    lambda start, later, first, steps: OdometryBatch(
        start, start + later, np.cumsum([first, *steps], axis=0).astype(float)
    ),
    start=st.integers(0, 2**30),
    later=st.integers(0, 2**30),
    first=st.tuples(*[st.integers(-(2**30), 2**30)] * 3),
    steps=st.lists(st.tuples(*[st.integers(-32_767, 32_767)] * 3), max_size=149),
)
places = st.integers(-99_999_999, 99_999_999)
antennas = st.tuples(i16.map(millimetres), i16.map(millimetres))
keyframes = st.builds(Keyframe, samples, st.integers(0, 2**15 - 1), i32, i32, i32)
ranges = st.builds(
    RangeMeasurement,
    a_n=samples,
    peer=chains,
    b_n=samples,
    q_a=antennas,
    q_b=antennas,
    range_m=places.map(tenths),
    sigma_m=st.integers(1, 2**15 - 1).map(millimetres),
)
closures = st.builds(
    ClosureMeasurement,
    number=n32,
    kept=st.booleans(),
    a_n=samples,
    peer=chains,
    b_n=samples,
    a_T_b=st.tuples(*[s.map(tenths) for s in (places, places, st.integers(-31_416, 31_416))]),
    covariance=diagonals,
)
sigmas = st.floats(2**-20, 8, width=32)
models = st.builds(
    RobotModel,
    st.builds(OdometryNoise, sigmas, sigmas, sigmas, sigmas),
    *[st.floats(-8, 8, width=32)] * 3,
)
entries = st.builds(
    GraphEntry,
    seq=samples,
    model=models | st.none(),
    keyframes=st.lists(keyframes, max_size=6).map(tuple),
    ranges=st.lists(ranges, max_size=6).map(tuple),
    closures=st.lists(closures, max_size=6).map(tuple),
)
poses = st.builds(
    Pose,
    states,
    robots,
    epochs,
    times,
    st.tuples(metres, metres, st.floats(-3.125, 3.125, width=32)),
    covariances,
)


@st.composite
def publics(draw: st.DrawFn) -> PublicPoses:
    rank, count = draw(st.sampled_from([1, 2, 5, 20])), draw(st.integers(0, 4))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    parts = rng.normal(0, draw(st.sampled_from([1e-9, 1.0, 1e5])), (2, count + 1, 2 * rank))
    real, imaginary = parts.astype(np.float32).astype(float)
    numbers = tuple(draw(samples) for _ in range(count))
    return PublicPoses(draw(robots), draw(epochs), rank, numbers, real + 1j * imaginary)


def through(message: Message) -> Message | str:
    return messages.decode(messages.kind_of(message), messages.encode(HEADER, message))


def is_same(a: Any, b: Any) -> bool:
    """Equality of messages, arrays and all."""
    if type(a) is not type(b):
        return False
    pairs = ((getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    return all(np.array_equal(x, y) if isinstance(x, np.ndarray) else x == y for x, y in pairs)


# ---- there and back ----------------------------------------------------------------------------


@settings(
    derandomize=True, max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
@given(st.one_of(statuses, batches, entries, poses, publics()))
def test_every_message_comes_back_as_it_was(message: Message) -> None:
    assert is_same(through(message), message)


@pytest.mark.parametrize("kind", CODECS)
def test_a_message_of_each_kind_comes_back_as_it_was(kind: str) -> None:
    assert is_same(through(kinds()[kind]), kinds()[kind])


def test_the_header_stands_where_every_lcm_program_finds_it() -> None:
    for kind, message in kinds().items():
        raw = CODECS[kind].struct.decode(messages.encode(HEADER, message))
        head = raw.header
        fields = (head.version, head.origin, head.epoch, head.counter, head.utime, head.tag)
        assert fields == (2, 3, 11, 12, 13, bytes(8))


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


def test_each_kind_has_a_channel_for_each_robot() -> None:
    assert messages.channel("GRAPH", 7) == "DRSLAM_GRAPH_007"
    for kind, message in kinds().items():
        assert messages.kind_of(message) == kind
        for robot in (0, 9, 254):
            assert messages.kind_of_channel(messages.channel(kind, robot)) == kind


@pytest.mark.parametrize(
    "channel",
    [
        "",
        "DRSLAM_GRAPH",
        "DRSLAM_GRAPH_",
        "DRSLAM_GRAPH_7",
        "DRSLAM_GRAPH_0007",
        "DRSLAM_GRAPH_255",
        "DRSLAM_GRAPH_-01",
        "DRSLAM_GRAPH_٠٠٧",
        "DRSLAM_TEAPOT_007",
        "drslam_GRAPH_007",
        "MBOT_ODOMETRY",
    ],
)
def test_another_channel_is_none_of_ours(channel: str) -> None:
    assert messages.kind_of_channel(channel) is None
