"""What robots say of their own accord: no more than somebody needs, and no less."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from lab.play.simulator import Network
from message_builders import a_status
from robot_scenes import RobotScene
from teams import EASY, VirtualTeam

from drslamd.broadcast import SOONER_US, Broadcast
from drslamd.config import Config
from drslamd.conventions import SECOND_US, Segment
from drslamd.gossip import messages
from drslamd.gossip.message_types import Heard, OdometryBatch, PoseState
from drslamd.gossip.seal import Seal, team_key
from drslamd.gossip.team import Team
from drslamd.slam import se2
from drslamd.slam.back_end import BackEnd
from drslamd.slam.front_end import FrontEnd
from drslamd.slam.graph.estimate import PoseNow
from drslamd.slam.se2 import Array
from drslamd.whereabouts import Whereabouts

RUN_S = 55


@pytest.fixture(scope="module")
def team() -> VirtualTeam:
    """Three robots that found each other."""
    team = VirtualTeam(EASY)
    team.run(RUN_S)
    assert set(team.frames().values()) == {0}
    return team


def sent(team: VirtualTeam, robot: int, kind: str) -> list[tuple[float, bytes]]:
    """Times in s of the run, and payloads."""
    name = messages.channel(kind, robot)
    traces = team.member(robot).traces
    return [(t / SECOND_US, payload) for t, channel, payload in traces.sent if channel == name]


def batches(team: VirtualTeam, robot: int) -> list[OdometryBatch]:
    out = [messages.decode("ODOMETRY", payload) for _, payload in sent(team, robot, "ODOMETRY")]
    assert all(isinstance(batch, OdometryBatch) for batch in out)
    return [batch for batch in out if isinstance(batch, OdometryBatch)]


@pytest.mark.slow
def test_nobody_says_odometry_to_robots_that_make_no_closures_with_it(team: VirtualTeam) -> None:
    """The lower id makes the closures of a pair."""
    # when they meet it asks once, before it knows that the other measures the ranges too
    assert len(batches(team, 0)) <= 1
    assert batches(team, 1) != []
    assert batches(team, 2) != []


@pytest.mark.slow
def test_every_sample_of_odometry_is_said_once_while_nothing_is_lost(team: VirtualTeam) -> None:
    later = batches(team, 2)[5:]
    assert len(later) > 30
    for before, batch in pairwise(later):
        assert batch.n0 == before.n0 + len(before.steps)


@pytest.mark.slow
def test_a_heartbeat_without_news_comes_every_third_second(team: VirtualTeam) -> None:
    times = np.array([t for t, _ in sent(team, 1, "STATUS")])
    early, late = np.diff(times[times < 8]), np.diff(times[times > 30])
    assert early == pytest.approx(1.0, abs=0.05)
    assert np.median(late) == pytest.approx(3.0, abs=0.05)


@pytest.mark.slow
def test_a_localised_robot_says_where_it_is_every_second(team: VirtualTeam) -> None:
    times = np.array([t for t, _ in sent(team, 1, "POSE")])
    assert np.diff(times[times > 30]).max() < 1.2


@pytest.mark.slow
def test_at_ten_solutions_a_second_a_pose_is_said_when_it_is_news() -> None:
    team = VirtualTeam(EASY, extra="[optimizer]\nrate_hz = 10.0\n")
    team.run(40.0)
    said = sum(t > 30 for t, _ in sent(team, 1, "POSE"))
    assert 11 <= said <= 70


@pytest.mark.parametrize(
    ("moved", "said"),
    [
        ((0.0, 0.0, 0.0), False),
        ((0.19, -0.09, 0.29), False),
        ((0.21, 0.0, 0.0), True),
        ((0.0, -0.11, 0.0), True),
        ((0.0, 0.0, 2 * np.pi - 0.29), False),
        ((0.0, 0.0, 2 * np.pi - 0.31), True),
    ],
)
@pytest.mark.row("O12")
def test_a_pose_that_moved_less_than_it_is_uncertain_waits_for_its_second(
    moved: tuple[float, float, float], said: bool
) -> None:
    frame = Segment(0, 1, 0)
    broadcast = Broadcast(
        cast(Config, None),
        Team(Seal(team_key(None), 0, 1, {})),
        cast(FrontEnd, None),
        cast(BackEnd, SimpleNamespace(estimate=SimpleNamespace(frame=frame))),
    )
    covariance = np.diag([0.2, 0.1, 0.3]) ** 2
    first = np.array([1.0, 2.0, 3.0])

    def at(pose: Array) -> Whereabouts:
        wrapped = np.append(pose[:2], se2.wrap(pose[2]))
        return Whereabouts(PoseState.LOCALISED, PoseNow(0, wrapped, covariance))

    assert broadcast.pose(at(first), SECOND_US)
    assert bool(broadcast.pose(at(first + moved), SECOND_US + 100_000)) == said
    assert broadcast.pose(at(first + moved), 3 * SECOND_US)


@pytest.mark.slow
def test_odometry_that_was_lost_is_said_again_so_that_no_hole_remains() -> None:
    team = VirtualTeam(EASY, network=Network(loss=0.3))
    team.run(40.0)
    for owner, peer in ((0, 1), (0, 2), (1, 2)):
        track = team.member(owner).robot.team.peers[peer].track
        assert len(track) > 300
        assert np.isfinite(track.poses).all()


@pytest.mark.slow
def test_a_robot_that_comes_late_gets_the_odometry_of_the_last_fifteen_seconds() -> None:
    team = VirtualTeam(EASY, on=(1, 2))
    team.run(30.0)
    team.start(0)
    team.run(36.0)
    track = team.member(0).robot.team.peers[2].track
    assert 150 <= len(track) <= 220


@pytest.mark.parametrize(
    ("state", "after_us", "is_said"),
    [
        (PoseState.STALE, 250_000, True),
        (PoseState.LOCALISED, 250_000, False),
        (PoseState.LOCALISED, SECOND_US - SOONER_US - 1, False),
        (PoseState.LOCALISED, SECOND_US - SOONER_US, True),
    ],
)
def test_who_is_lost_gets_odometry_at_each_call_and_all_others_once_a_second(
    state: PoseState, after_us: int, is_said: bool
) -> None:
    scene = RobotScene()
    scene.drive(2)
    wants = Heard(0, 1, 0, wanted_n=scene.robot.front.reckoning.track.end - 5)
    scene.hear(7, replace(a_status((wants,), ranged=(0,)), state=state))
    scene.drive(1)
    now, neighbours = scene.utime, scene.robot.neighbours(scene.utime)
    assert [peer.wanted_n for peer in neighbours] == [wants.wanted_n]
    broadcast = scene.robot.broadcast
    assert broadcast.odometry(neighbours, now)
    scene.drive(0.2)
    assert bool(broadcast.odometry(neighbours, now + after_us)) is is_said
