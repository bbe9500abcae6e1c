"""Any message that can be said, drawn by hypothesis: within the bounds of what is believed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hypothesis import strategies as st

from drslamd.conventions import Chain
from drslamd.gossip.message_types import (
    MAX_MOTIONS,
    MAX_PLACES,
    UNKNOWN_CLOCK,
    Heard,
    Hypotheses,
    LogState,
    Message,
    OdometryBatch,
    Pose,
    PoseState,
    Status,
)
from drslamd.slam.graph.chapters.books import PER_ENTRY
from drslamd.slam.graph.measurements import (
    Chapter,
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.public_poses import MAX_HELD, MAX_PUBLIC, PublicPoses
from drslamd.slam.hypotheses.deciding_motion import NO_TURN, DecidingMotion
from drslamd.slam.hypotheses.places_left import PossiblePlace
from drslamd.slam.odometry.gyro_noise import OPEN, GyroNoise
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


def fiftieths(steps: int) -> float:
    return steps * (1 / 50)


covariances = st.tuples(variances, metres, metres, variances, metres, variances)
diagonals = st.floats(2**-20, 2**16, width=32).map(lambda v: (v, 0.0, 0.0, v, 0.0, v))


def rows_of_log(robot: int, epoch: int, numbers: Sequence[int]) -> list[LogState]:
    """From where to where it is held, first to last, and how far it goes: ascending numbers."""
    *edges, newest = numbers
    spans = zip(edges[::2], edges[1::2], strict=True)
    return [LogState(robot, epoch, first, end, newest) for first, end in spans]


def logs(numbers: st.SearchStrategy[Any], most: int) -> st.SearchStrategy[Any]:
    """The rows of so many logs, each named once."""
    log = st.builds(rows_of_log, robots, epochs, numbers.map(sorted))
    drawn = st.lists(log, max_size=most, unique_by=lambda rows: rows[0].id)
    return drawn.map(lambda found: tuple(row for rows in found for row in rows))


whole_logs = logs(st.tuples(n32, n32, n32), 28)
logs_with_gaps = logs(
    st.integers(1, 4).flatmap(
        lambda spans: st.lists(n32, min_size=2 * spans + 1, max_size=2 * spans + 1, unique=True)
    ),
    8,
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
    logs=whole_logs | logs_with_gaps,
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
angles = st.integers(-31_416, 31_416).map(tenths)
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
    turn_a=angles,
    turn_b=angles,
)
closures = st.builds(
    ClosureMeasurement,
    number=n32,
    kept=st.booleans(),
    a_n=samples,
    peer=chains,
    b_n=samples,
    a_T_b=st.tuples(places.map(tenths), places.map(tenths), angles),
    covariance=diagonals,
    corrected=st.tuples(*[st.integers(-127, 127).map(fiftieths)] * 4),
)
sigmas = st.floats(2**-20, 8, width=32)
gyros = st.tuples(samples, samples | st.just(OPEN)).flatmap(
    lambda span: st.builds(GyroNoise, sigmas, sigmas, st.just(min(span)), st.just(max(span)))
)
models = st.builds(
    RobotModel,
    st.builds(OdometryNoise, sigmas, sigmas, sigmas, sigmas, st.none() | gyros),
    *[st.floats(-8, 8, width=32)] * 3,
    st.floats(0, 8, width=32),
)
entries = st.builds(
    GraphEntry,
    seq=samples,
    model=models | st.none(),
    keyframes=st.lists(keyframes, max_size=6).map(tuple),
    ranges=st.lists(ranges, max_size=6).map(tuple),
    closures=st.lists(closures, max_size=6).map(tuple),
)


@st.composite
def chapters(draw: st.DrawFn) -> GraphEntry:
    """An entry that is part of a chapter."""
    seq = draw(samples)
    first = max(0, seq - draw(st.integers(0, 64)))
    parts, replaces = 0, tuple[tuple[int, int], ...]()
    if seq > first and draw(st.booleans()):
        parts = draw(st.integers(1, min(127, seq - first)))
        edges = st.sets(st.integers(first, seq + 1 - parts), min_size=2, max_size=8)
        ends = sorted(draw(edges))
        replaces = tuple(zip(ends[::2], ends[1::2], strict=False))
    places = st.integers(first * PER_ENTRY, (seq + 1) * PER_ENTRY - 1)

    def placed(items: st.SearchStrategy[Any]) -> tuple[Any, ...]:
        """By their peer, then by their place."""
        found = draw(st.dictionaries(places, items, max_size=3))
        return tuple(sorted(found.items(), key=lambda entry: (entry[1].peer, entry[0])))

    said = Chapter(
        parts,
        replaces,
        tuple(draw(st.lists(st.tuples(st.integers(first, seq), models), max_size=2))),
        tuple(draw(st.lists(keyframes, max_size=4))),
        placed(ranges),
        placed(closures),
    )
    return GraphEntry(seq, chapter=said)


poses = st.builds(
    Pose,
    states,
    robots,
    epochs,
    times,
    st.tuples(metres, metres, st.floats(-3.125, 3.125, width=32)),
    covariances,
)


wrapped = st.floats(-3.125, 3.125, width=32)
possible_places = st.builds(
    PossiblePlace,
    robots,
    times,
    st.floats(0, 1, width=32),
    st.tuples(metres, metres, wrapped),
    covariances,
)
turns = st.floats(0, 3.125, width=32)
sectors = st.just(NO_TURN) | st.tuples(turns, turns).map(lambda both: (min(both), max(both)))
motions = st.builds(
    DecidingMotion,
    robots,
    robots,
    st.floats(0.125, 8, width=32),
    sectors,
    sectors,
    st.integers(1, 4),
)
hypotheses = st.builds(
    Hypotheses,
    times,
    st.tuples(metres, metres, wrapped),
    st.lists(possible_places, max_size=MAX_PLACES).map(tuple),
    st.lists(motions, max_size=MAX_MOTIONS).map(tuple),
)
rounds = st.integers(0, 2**62 - 1)


@st.composite
def publics(draw: st.DrawFn) -> PublicPoses:
    rank, count = draw(st.sampled_from([1, 2, 5, 20])), draw(st.integers(0, 4))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    parts = rng.normal(0, draw(st.sampled_from([1e-9, 1.0, 1e5])), (2, count + 1, 2 * rank))
    real, imaginary = parts.astype(np.float32).astype(float)
    numbers = sorted(draw(st.sets(samples, min_size=count, max_size=count)))
    since, move = sorted(draw(st.tuples(rounds, rounds)))
    many = draw(st.integers(1, MAX_PUBLIC))
    return PublicPoses(
        draw(robots),
        draw(epochs),
        rank,
        tuple(numbers),
        real + 1j * imaginary,
        round=move,
        since=since,
        part=draw(st.integers(0, many - 1)),
        parts=many,
        asks=draw(st.booleans()),
        held=tuple(draw(st.lists(st.tuples(robots, rounds), max_size=MAX_HELD))),
    )


any_message: st.SearchStrategy[Message] = st.one_of(
    statuses, batches, entries, chapters(), poses, publics(), hypotheses
)
