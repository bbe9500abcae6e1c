"""Whatever comes in: a robot counts it, says so, and goes on."""

from __future__ import annotations

import numpy as np
import pytest
from robot_scenes import ticked
from teams import VirtualTeam

from drslamd import report
from drslamd.conventions import SECOND_US
from drslamd.events import (
    ChannelMessage,
    Datagram,
    NetworkState,
    PortCondition,
    PortState,
    SerialData,
    Stop,
    Tick,
)
from drslamd.gossip import lc02


@pytest.fixture
def pair() -> VirtualTeam:
    """Two robots that have been talking for five seconds."""
    team = VirtualTeam(on=(0, 1))
    team.run(5.0)
    return team


@pytest.mark.row("D1")
@pytest.mark.row("N7")
def test_random_bytes_on_every_port_and_on_the_network_never_raise(pair: VirtualTeam) -> None:
    member = pair.member(0)
    rng = np.random.default_rng(1)
    utime = member.clock.local(pair.simulator.now)
    for _ in range(2_000):
        utime += int(rng.integers(0, 20_000))
        data = rng.bytes(int(rng.integers(0, 300)))
        member.robot.handle(SerialData(utime, "uwb", data))
        member.robot.handle(SerialData(utime, "wheels", data))
        member.robot.handle(Datagram(utime, data))
        member.robot.handle(ChannelMessage(utime, "DRSLAM_STATUS_001", data))
        member.robot.handle(Tick(utime))
    assert member.robot.team.refused.total() >= 4_000 - 10


def test_messages_of_peers_with_any_byte_changed_leave_no_trace_but_a_count(
    pair: VirtualTeam,
) -> None:
    member = pair.member(0)
    rng = np.random.default_rng(2)
    utime = member.clock.local(pair.simulator.now)
    before = report.status(member.robot, utime)
    changed = 0
    for _, channel, payload in pair.member(1).traces.sent[-20:]:
        good = bytearray(lc02.encode(1, channel, payload))
        for _ in range(40):
            bad = bytearray(good)
            bad[int(rng.integers(8, len(bad)))] ^= 1 << int(rng.integers(0, 8))
            member.robot.handle(Datagram(utime, bytes(bad)))
            changed += 1
    after = report.status(member.robot, utime)
    assert sum(after["network"]["refused"].values()) == changed + sum(
        before["network"]["refused"].values()
    )
    for part in ("peers", "pairs", "graph", "pose"):
        assert after[part] == before[part]


@pytest.mark.row("S4")
def test_a_replayed_recording_of_an_absent_robot_does_not_bring_it_back(
    pair: VirtualTeam,
) -> None:
    recorded = pair.member(1).traces.sent[-60:]
    pair.simulator.kill(pair.member(1))
    pair.simulator.kill(pair.member(0))
    fresh = pair.start(0, epoch=2, epochs={1: 1})
    utime = fresh.clock.local(pair.simulator.now)
    for number, (_, channel, payload) in enumerate(recorded):
        fresh.robot.handle(Datagram(utime + number * 1000, lc02.encode(number, channel, payload)))
    assert not fresh.robot.team.living(utime + 60_000)


@pytest.mark.row("T3")
def test_a_long_stall_is_followed_by_one_round_of_timers_not_by_a_burst(
    pair: VirtualTeam,
) -> None:
    robot = pair.member(0).robot
    utime = robot.next_tick + 30 * SECOND_US
    first = ticked(robot, utime)
    again = robot.handle(Tick(utime + 1))
    assert len(first) < 20
    assert not again


def test_port_and_network_states_are_reported_with_their_detail(pair: VirtualTeam) -> None:
    robot = pair.member(0).robot
    utime = pair.member(0).clock.local(pair.simulator.now)
    robot.handle(PortState(utime, "uwb", PortCondition.DENIED, "/dev/uwb: Permission denied"))
    robot.handle(NetworkState(utime, False, "no such interface: wlan7"))
    ticked(robot, utime + 2 * SECOND_US)
    sentences = "\n".join(robot.health.sentences().values())
    assert "no permission: /dev/uwb" in sentences
    assert "wlan7" in sentences
    robot.handle(NetworkState(utime, True, ""))
    ticked(robot, utime + 4 * SECOND_US)
    assert "wlan7" not in "\n".join(robot.health.sentences().values())


@pytest.mark.row("O11")
def test_a_condition_is_noted_when_it_begins_once_a_minute_and_when_it_ends(
    pair: VirtualTeam,
) -> None:
    robot = pair.member(0).robot
    utime = pair.member(0).clock.local(pair.simulator.now)
    effects = {0: robot.handle(NetworkState(utime, False, "cable"))}
    for second in range(1, 125):
        effects[second] = ticked(robot, utime + second * SECOND_US)
    effects[125] = robot.handle(NetworkState(utime + 125 * SECOND_US, True))
    noted = [(s, getattr(e, "event", "")) for s, said in effects.items() for e in said]
    faults = [(s, name) for s, name in noted if name in ("network.fault", "network.well")]
    assert [s for s, name in faults if name == "network.fault"] == [0, 60, 120]
    assert faults[-1] == (125, "network.well")


def test_stopping_says_goodbye_three_times_and_saves(pair: VirtualTeam) -> None:
    member = pair.member(0)
    effects = member.robot.handle(Stop(member.clock.local(pair.simulator.now)))
    assert [type(e).__name__ for e in effects] == ["Send"] * 3 + ["Save"]
    assert effects[-1].state["epochs"] == {1: 1}  # type: ignore[union-attr]
