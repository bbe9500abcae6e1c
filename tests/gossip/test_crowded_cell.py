"""More robots in one radio cell than one status can name: everybody is named in turn."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from acquainted import introduce
from gossip_team import Air
from message_builders import SECOND, a_seal, a_status, an_entry, sealed

from drslamd.broadcast import Broadcast
from drslamd.config import Config
from drslamd.conventions import Chain
from drslamd.events import ChannelMessage, Send
from drslamd.gossip import messages
from drslamd.gossip.message_types import Message, OdometryBatch, PoseState, Status
from drslamd.gossip.team import Team
from drslamd.slam.back_end import BackEnd
from drslamd.slam.front_end import FrontEnd

QUIET = 3 * SECOND


def knows_that_it_is_heard(air: Air, robot: int) -> bool:
    """By everybody."""
    return len(air.teams[robot].living(air.utime)) == len(air.teams) - 1


@pytest.mark.parametrize("robots", [29, 30])
def test_on_both_sides_of_the_bound_everybody_is_known_to_be_heard(robots: int) -> None:
    """28 others fit one status, 29 do not; a rotation of two takes six seconds."""
    air = Air(robots, period=QUIET)
    air.seconds(7)
    for _ in range(3):
        air.seconds(1)
        assert all(knows_that_it_is_heard(air, robot) for robot in air.teams)


@pytest.mark.slow
@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_forty_robots_know_that_they_are_heard_hold_all_logs_and_do_not_crowd_the_channel(
    loss: float,
) -> None:
    """A full status has 1,361 bytes and an entry 72; each robot sends 8 of these and 4 of those.

    Half of the others are named in each status, so each is named four times; at a loss of a fifth
    all four are lost for 0.2 % of pairs.
    """
    air = Air(40, loss, period=2 * SECOND).meet()
    air.seconds(4, speakers=range(40))
    air.seconds(12)
    assert all(len(held) == 4 * 40 for held in air.held.values())
    known = [p.hears(team.own) for team in air.teams.values() for p in team.peers.values()]
    assert len(known) == 40 * 39
    assert np.mean(known) >= (1 if loss == 0 else 0.99)
    relayed = 0 if loss == 0 else 80
    assert max(air.bytes_sent.values()) <= 8 * 1361 + (4 + relayed) * 72


# heartbeats


def a_broadcast(team: Team, ranged: set[int]) -> Broadcast:
    """Of a localised robot with nothing to say that ranges to these UWB ids."""
    front = SimpleNamespace(ranged=lambda utime: list(ranged), needed=lambda near, utime: ())
    estimate = SimpleNamespace(frame=SimpleNamespace(robot=0))
    back = SimpleNamespace(estimate=estimate, said_digest=lambda: 0)
    config = SimpleNamespace(uwb_id=9)
    return Broadcast(cast(Config, config), team, cast(FrontEnd, front), cast(BackEnd, back))


@pytest.mark.parametrize("others", [28, 29, 42, 84])
def test_a_robot_in_a_crowd_stays_quiet_and_still_names_everybody(others: int) -> None:
    """Statuses that are not sent must not use up turns: of 42 or 84 always the same would speak."""
    team = Team(a_seal(0))
    seals = [a_seal(robot) for robot in range(1, others + 1)]
    introduce(team, *seals)
    broadcast = a_broadcast(team, {1000 + robot for robot in range(1, others + 1)})
    said: list[tuple[int, Status]] = []
    for second in range(20):
        utime = (100 + second) * SECOND
        for seal in seals:
            status = a_status(uwb_id=1000 + seal.robot)
            team.receive(ChannelMessage(utime, *sealed(seal, status, utime)))
        for send in broadcast.heartbeat([], None, PoseState.LOCALISED, utime):
            assert isinstance(send, Send)
            heartbeat = messages.decode("STATUS", send.payload)
            assert isinstance(heartbeat, Status)
            said.append((second, heartbeat))
    assert [second for second, _ in said] == [0, 3, 6, 9, 12, 15, 18]
    rotation = -(-others // 28)
    for first in range(len(said) - rotation + 1):
        statuses = [status for _, status in said[first : first + rotation]]
        assert {h.id for s in statuses for h in s.heard} == set(range(1, others + 1))
        assert all(s.ranged == tuple(sorted(h.id for h in s.heard)) for s in statuses)


def test_a_quiet_robot_speaks_when_any_of_a_crowd_comes_or_goes() -> None:
    team = Team(a_seal(0))
    seals = {robot: a_seal(robot) for robot in range(1, 41)}
    for seal in seals.values():
        team.receive(ChannelMessage(0, *sealed(seal, a_status())))
    broadcast = a_broadcast(team, set())
    assert broadcast.heartbeat([], None, PoseState.LOCALISED, SECOND)
    assert not broadcast.heartbeat([], None, PoseState.LOCALISED, 2 * SECOND)
    team.receive(ChannelMessage(0, *sealed(a_seal(99), a_status())))
    assert broadcast.heartbeat([], None, PoseState.LOCALISED, 2 * SECOND)
    team.receive(ChannelMessage(0, *sealed(seals[40], a_status(leaving=True))))
    assert Chain(40, 1) not in team.audible(2 * SECOND)
    assert broadcast.heartbeat([], None, PoseState.LOCALISED, 3 * SECOND)


@pytest.mark.parametrize("lost", ["odometry", "entry of a log"])
def test_a_robot_that_lacks_something_is_not_quiet(lost: str) -> None:
    team, seal = introduce(Team(a_seal(0)), Chain(1, 1)), a_seal(1)

    def says(message: Message) -> None:
        team.receive(ChannelMessage(0, *sealed(seal, message)))

    def spoke(ms: int) -> bool:
        return bool(broadcast.heartbeat([], None, PoseState.LOCALISED, 1000 * ms))

    broadcast = a_broadcast(team, set())
    says(OdometryBatch(0, 0, np.zeros((10, 3))))
    says(an_entry(0, 1))
    assert [spoke(ms) for ms in (0, 100)] == [True, False]
    says(OdometryBatch(0, 15, np.zeros((5, 3))) if lost == "odometry" else an_entry(2, 1))
    assert [spoke(ms) for ms in (200, 300)] == [True, True]
    says(OdometryBatch(0, 10, np.zeros((10, 3))) if lost == "odometry" else an_entry(1, 1))
    assert not spoke(400)


def test_a_quiet_robot_speaks_when_it_ranges_to_somebody_new_or_no_longer_does() -> None:
    team = introduce(Team(a_seal(0)), Chain(1, 1))
    team.receive(ChannelMessage(0, *sealed(a_seal(1), a_status(uwb_id=1001))))
    ranged: set[int] = set()
    broadcast = a_broadcast(team, ranged)
    spoke = []
    nobody: set[int] = set()
    scene = [(0, nobody), (200, nobody), (400, {1001}), (600, {1001}), (800, nobody)]
    for ms, now in scene:
        ranged.clear()
        ranged.update(now)
        spoke.append(bool(broadcast.heartbeat([], None, PoseState.LOCALISED, 1000 * ms)))
    assert spoke == [True, False, True, False, True]
