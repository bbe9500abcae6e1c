"""What is within bounds: the words for what is not, and that what can be said is also believed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from message_builders import COVARIANCE, HEADER, kinds

from drslamd.conventions import LAST_N, Chain
from drslamd.gossip import bounds, messages
from drslamd.gossip.epochs import MAX_EPOCH
from drslamd.gossip.message_types import UNKNOWN_CLOCK, Message, OdometryBatch, Pose, PoseState
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.public_poses import PublicPoses

PEER = Chain(4, 12)
FOR_EVERY_CASE = settings(derandomize=True, max_examples=300, deadline=None)


@pytest.mark.parametrize(
    ("bound", "least", "most"),
    [
        (bounds.robot, 0, 254),
        (bounds.flag, 0, 1),
        (bounds.pose_state, PoseState.NOT_LOCALISED, PoseState.POSITION),
        (bounds.epoch, 0, MAX_EPOCH),
        (bounds.sample, 0, LAST_N),
        (bounds.uwb_clock, -bounds.MAX_UWB_CLOCK_US, bounds.MAX_UWB_CLOCK_US),
    ],
)
def test_a_number_keeps_its_value_up_to_both_bounds_and_is_named_beyond(
    bound: Callable[[int], int], least: int, most: int
) -> None:
    assert (bound(least), bound(most)) == (least, most)
    for value in (least - 1, most + 1, 2**63 - 1, -(2**63) + 1):
        with pytest.raises(ValueError, match=rf"{value}, allowed are {int(least)} to {int(most)}"):
            bound(value)


def test_a_clock_that_is_not_known_is_no_clock_beyond_its_bound() -> None:
    assert bounds.uwb_clock(UNKNOWN_CLOCK) == UNKNOWN_CLOCK


def near(*edges: float) -> st.SearchStrategy[float]:
    """Numbers at and beside these, on both sides of zero, as 64 and as 32 bits have them."""
    beside = [
        sign * value
        for edge in edges
        for value in (
            edge,
            math.nextafter(edge, math.inf),
            math.nextafter(edge, 0.0),
            float(np.nextafter(np.float32(edge), np.float32(0.0))),
            edge * (1 + 1e-9),
            edge * (1 - 1e-9),
        )
        for sign in (1, -1)
    ]
    return st.one_of(st.sampled_from(beside), st.floats(-2 * max(edges), 2 * max(edges)))


samples = st.sampled_from([0, 1, LAST_N - 1, LAST_N])
steps = st.sampled_from([0, 1, 2**31 - 1, 2**31 - 2**20 - 1]).flatmap(
    lambda v: st.sampled_from([v - 1, v, v + 1, -v])
)
places = near(1e4)
angles = near(math.pi, math.pi + 1e-4)
variances = near(1e-8, 9e4)
keyframes = st.builds(Keyframe, samples, st.sampled_from([0, 2**15 - 1]), steps, steps, steps)
ranges = st.builds(
    RangeMeasurement,
    a_n=samples,
    peer=st.just(PEER),
    b_n=samples,
    q_a=st.tuples(near(32.767), near(32.767)),
    q_b=st.just((0.0, 0.0)),
    range_m=places,
    sigma_m=near(32.767),
)
closures = st.builds(
    ClosureMeasurement,
    number=st.just(1),
    kept=st.booleans(),
    a_n=samples,
    peer=st.just(PEER),
    b_n=samples,
    a_T_b=st.tuples(places, places, angles),
    covariance=st.tuples(variances, variances, variances, variances, variances, variances)
    | variances.map(lambda v: (v, 0.0, 0.0, v, 0.0, v))
    | variances.map(lambda v: (1.0, v, 0.0, 1.0, 0.0, 1.0)),
)
batches = st.builds(
    lambda first, step, n0: OdometryBatch(0, n0, np.array([first, [v + step for v in first]])),
    st.tuples(steps.map(float), steps.map(float), steps.map(float)),
    st.sampled_from([0, 1, -1]),
    samples,
)
poses = st.builds(
    Pose,
    st.sampled_from(PoseState),
    st.just(3),
    st.just(11),
    st.just(0),
    st.tuples(near(1e6), near(1e6), angles),
    near(1e12, 1e-45).map(lambda v: (v, 0.0, -v, 1.0, 0.0, 1.0)),
)
publics = near(1e6).map(
    lambda v: PublicPoses(3, 11, 1, (40,), np.full((2, 2), complex(v, -v), dtype=complex))
)


def message_of(item: Any) -> Message:
    """What says it."""
    if isinstance(item, Keyframe):
        return GraphEntry(0, keyframes=(item,))
    if isinstance(item, RangeMeasurement):
        return GraphEntry(0, ranges=(item,))
    if isinstance(item, ClosureMeasurement):
        return GraphEntry(0, closures=(item,))
    message: Message = item
    return message


@FOR_EVERY_CASE
@given(st.one_of(keyframes, ranges, closures, batches, poses, publics))
def test_whatever_can_be_said_is_believed_by_who_reads_it(item: Any) -> None:
    if bounds.is_sayable(item):
        message = message_of(item)
        kind = messages.kind_of(message)
        answer = messages.decode(kind, messages.encode(HEADER, message))
        assert not isinstance(answer, str), (item, answer)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(6))
def test_no_covariance_with_a_number_that_is_none_can_be_said(place: int, value: float) -> None:
    covariance = list(COVARIANCE)
    covariance[place] = value
    entry, pose = kinds()["GRAPH"], kinds()["POSE"]
    assert isinstance(entry, GraphEntry)
    assert isinstance(pose, Pose)
    items: tuple[ClosureMeasurement | Pose, ...] = (*entry.closures, pose)
    for item in items:
        assert bounds.is_sayable(item)
        assert not bounds.is_sayable(replace(item, covariance=tuple(covariance)))


@pytest.mark.parametrize(
    ("variance", "sayable"), [(1e12, True), (1.1e12, False), (1e39, False), (math.nan, False)]
)
def test_a_pose_that_is_uncertain_beyond_all_places_is_not_said(
    variance: float, sayable: bool
) -> None:
    pose = Pose(PoseState.LOCALISED, 3, 11, 0, (0.0, 0.0, 0.0), (variance, 0.0, 0.0, 1.0, 0.0, 1.0))
    assert bounds.is_sayable(pose) == sayable


@pytest.mark.parametrize(("value", "sayable"), [(1e6, True), (1.1e6, False), (math.inf, False)])
def test_lifted_poses_beyond_all_places_are_not_said(value: float, sayable: bool) -> None:
    values = np.full((2, 4), complex(0.0, value))
    assert bounds.is_sayable(PublicPoses(3, 11, 2, (40,), values)) == sayable


@pytest.mark.parametrize(("steps", "sayable"), [(bounds.SPENT_STEP, True), (2**31 - 2, False)])
def test_a_robot_too_near_to_the_end_of_its_numbers_says_no_more_of_its_way(
    steps: int, sayable: bool
) -> None:
    for value in (steps, -steps):
        assert bounds.is_sayable(Keyframe(1, 0, value, 0, 0)) == sayable
        assert bounds.is_sayable(OdometryBatch(0, 0, np.array([[0.0, value, 0.0]]))) == sayable


@pytest.mark.parametrize(
    "item",
    [
        Keyframe(LAST_N + 1, 0, 0, 0, 0),
        Keyframe(1, bounds.LAST_SEGMENT + 1, 0, 0, 0),
        OdometryBatch(0, LAST_N, np.zeros((2, 3))),
    ],
)
def test_what_is_past_the_last_of_its_numbers_is_not_said(item: Any) -> None:
    assert not bounds.is_sayable(item)
