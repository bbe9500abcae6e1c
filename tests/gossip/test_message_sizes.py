"""Whatever the code can say fits one datagram."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from acquainted import introduce
from message_builders import COVARIANCE, HEADER, a_seal, a_status, an_entry, sealed

from drslamd.config import OptimizerSection
from drslamd.conventions import Chain
from drslamd.events import ChannelMessage, Send
from drslamd.gossip import lc02, messages
from drslamd.gossip.envelopes.splitting import MEASUREMENTS_PER_ENTRY
from drslamd.gossip.lc02 import MAX_PAYLOAD
from drslamd.gossip.log_sync import LogSync
from drslamd.gossip.message_types import (
    MAX_MOTIONS,
    MAX_PLACES,
    Heard,
    Hypotheses,
    LogState,
    OdometryBatch,
    Pose,
    PoseState,
)
from drslamd.gossip.team import Team
from drslamd.slam.graph.measurements import ClosureMeasurement, Keyframe, RangeMeasurement
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.hypotheses.deciding_motion import NO_TURN, DecidingMotion
from drslamd.slam.hypotheses.places_left import PossiblePlace
from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.robot_model import UNTOLD


def fits(send: Send) -> bool:
    """On the air it goes, and LCM's framing takes it."""
    lc02.encode(0, send.channel, send.payload)
    return len(send.payload) <= 1400


@pytest.mark.row("N9")
def test_a_full_status_has_1391_bytes() -> None:
    """8 + 31 + 36 of frame, 28 peers of 22, 28 ids of 2 and 28 logs of 23."""
    logs = tuple(LogState(robot, 1, 0, 0, 0) for robot in range(28))
    status = a_status((Heard(1, 1, 1),) * 28, logs, ranged=(1,) * 28)
    assert len(messages.encode(HEADER, status)) == 75 + 28 * (22 + 2 + 23) == 1391


@pytest.mark.parametrize("others", [1, 5, 17, 26, 27, 28, 60])
def test_a_status_that_says_what_lies_beyond_gaps_fits(others: int) -> None:
    logs = LogSync(0)
    for robot in range(1, others + 1):
        for seq in range(1, 900, 9):
            logs.add(Chain(robot, 1), seq, b"", 0)
    rows = logs.next_states()
    status = a_status((Heard(1, 1, 1),) * 28, rows, ranged=(1,) * 28)
    payload = messages.encode(HEADER, status)
    assert len(payload) <= 1_400
    assert messages.decode("STATUS", payload) == status
    # (of all that lack something, whoever they are)
    assert len(rows) >= 5 * len({row.id for row in rows})


def test_the_status_of_a_robot_that_hears_254_others_fits() -> None:
    team = Team(a_seal(0))
    for robot in range(1, 255):
        introduce(team, Chain(robot, 1))
        team.receive(ChannelMessage(0, *sealed(a_seal(robot), a_status())))
    heard, logs = team.next_heard(0), team.logs.next_states()
    assert len(heard) == len(logs) == 28
    assert fits(team.send(a_status(heard, logs, ranged=tuple(range(28))), 0))


def test_a_full_batch_of_odometry_has_955_bytes() -> None:
    batch = OdometryBatch(0, 0, np.zeros((150, 3)))
    assert len(messages.encode(HEADER, batch)) == 8 + 31 + 5 * 4 + 2 + 149 * 6 == 955


def test_a_pose_has_94_bytes() -> None:
    pose = Pose(PoseState.LOCALISED, 3, 11, 0)
    assert len(messages.encode(HEADER, pose)) == 8 + 31 + 19 + 12 + 24 == 94


def test_as_many_hypotheses_as_are_said_at_once_have_1263_bytes() -> None:
    place = PossiblePlace(1, 0, 1.0, (0.0, 0.0, 0.0), COVARIANCE)
    motion = DecidingMotion(1, 0, 0.5, NO_TURN, NO_TURN, 1)
    full = Hypotheses(0, (0.0, 0.0, 0.0), (place,) * MAX_PLACES, (motion,) * MAX_MOTIONS)
    size = len(messages.encode(HEADER, full))
    assert size == 8 + 31 + 20 + 2 + 20 * 50 + 2 + 8 * 25 == 1263 <= MAX_PAYLOAD


def test_an_entry_with_one_keyframe_has_72_bytes() -> None:
    assert len(messages.encode(HEADER, an_entry(0, 5))) == 8 + 31 + 5 + 10 + 18 == 72


KEYFRAMES = tuple(Keyframe(n, 0, n, n, n) for n in range(50))
RANGES = tuple(
    RangeMeasurement(n, Chain(n, 1), n, (0.0, 0.0), (0.0, 0.0), 3.0, 0.1) for n in range(50)
)
CLOSURES = tuple(
    ClosureMeasurement(n, True, n, Chain(n, 1), n, (0.0, 0.0, 0.0), COVARIANCE) for n in range(50)
)


@pytest.mark.parametrize(
    ("keyframes", "ranges", "closures"),
    [(KEYFRAMES, (), ()), ((), RANGES, ()), ((), (), CLOSURES), (KEYFRAMES, RANGES, CLOSURES)],
)
def test_items_of_every_kind_are_said_completely_in_entries_that_fit(
    keyframes: tuple[Keyframe, ...],
    ranges: tuple[RangeMeasurement, ...],
    closures: tuple[ClosureMeasurement, ...],
) -> None:
    team = Team(a_seal(3))
    entries = [team.append(e, 0) for e in team.entries(UNTOLD, keyframes, ranges, closures)]
    assert all(fits(team.send_sealed(3, payload)) for _, payload in entries)
    assert [entry.seq for entry, _ in entries] == list(range(len(entries)))
    assert sum(len(e.keyframes) for e, _ in entries) == len(keyframes)
    assert sum(len(e.ranges) for e, _ in entries) == len(ranges)
    assert sum(len(e.closures) for e, _ in entries) == len(closures)


def test_twenty_closures_with_twenty_peers_and_the_traits_have_1366_bytes() -> None:
    team = Team(a_seal(3))
    (entry,) = team.entries(UNTOLD, (), (), CLOSURES[:MEASUREMENTS_PER_ENTRY])
    assert len(messages.encode(HEADER, entry)) == 54 + 32 + 20 * (10 + 54) == 1366


def test_of_a_robot_with_a_gyro_they_have_24_bytes_more_and_still_fit() -> None:
    turned = replace(UNTOLD, noise=replace(UNTOLD.noise, gyro=GyroNoise(0.25, 0.5, 70)))
    (entry,) = Team(a_seal(3)).entries(turned, (), (), CLOSURES[:MEASUREMENTS_PER_ENTRY])
    assert len(messages.encode(HEADER, entry)) == 1366 + 24 <= MAX_PAYLOAD


def test_the_largest_rank_that_can_be_configured_is_20() -> None:
    with pytest.raises(ValueError):
        OptimizerSection(rank=21)


@pytest.mark.parametrize(("rank", "at_once"), [(2, 35), (5, 14), (20, 3)])
def test_public_poses_go_out_as_many_at_a_time_as_fit(rank: int, at_once: int) -> None:
    """80 bytes of frame, 16 * rank of anchor, 4 + 16 * rank for each; 1400 is the most."""
    assert 80 + 16 * rank + at_once * (4 + 16 * rank) <= 1400
    assert 80 + 16 * rank + (at_once + 1) * (4 + 16 * rank) > 1400
    count = 3 * at_once + 1
    values = np.arange((count + 1) * 2 * rank).reshape(count + 1, 2 * rank) * (1 + 2j)
    public = PublicPoses(3, 11, rank, tuple(range(100, 100 + count)), values)
    sends = Team(a_seal(3)).send_public(public, 0)
    parts = [messages.decode("PUBLIC", send.payload) for send in sends]
    assert all(fits(send) for send in sends)
    assert [len(p.keyframes) for p in parts if isinstance(p, PublicPoses)] == [at_once] * 3 + [1]
    whole = None
    for part in parts:
        assert isinstance(part, PublicPoses)
        whole = part.after(whole)
    assert whole == public
    assert whole is not None
    assert np.array_equal(whole.values, values)
