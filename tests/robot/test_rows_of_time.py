"""What time does to a team: wall clocks that are set, sleep, stalls, clocks that disagree."""

from __future__ import annotations

import itertools
import time
from dataclasses import replace

import numpy as np
import pytest
from lab.play.simulator import Clock, Member
from places import Recorded
from teams import EASY, VirtualTeam

from drslamd.conventions import GRID_US, SECOND_US
from drslamd.events import Slept

SHORT = replace(EASY, robots=2, seconds=20.0)
LONG = replace(EASY, seconds=75.0)
ASLEEP_S = 10.0


def said(team: VirtualTeam) -> list[tuple[int, str, bytes]]:
    return [sent for member in team.simulator.members.values() for sent in member.traces.sent]


@pytest.mark.row("T1")
def test_a_wall_clock_that_is_set_changes_no_word(monkeypatch: pytest.MonkeyPatch) -> None:
    calm = VirtualTeam(SHORT)
    calm.run(15.0)
    steps = itertools.cycle([1, -1, 3_600, -3_600, 315_576_000, -315_576_000, 10**8, -(10**8)])
    monkeypatch.setattr(time, "time_ns", lambda: next(steps) * 10**9)
    monkeypatch.setattr(time, "time", lambda: float(next(steps)))
    odd = VirtualTeam(SHORT)
    odd.run(15.0)
    assert said(odd) == said(calm)
    assert len(said(calm)) > 20


def sleep(team: VirtualTeam, robot: int, stands: bool) -> Member:
    """Its computer sleeps; its devices go on, and nobody reads them.

    Args:
        stands: does its clock stand meanwhile, and nobody tells it?
    """
    member, simulator = team.member(robot), team.simulator
    member.running = False
    team.run(simulator.now / SECOND_US + ASLEEP_S)
    member.running = True
    if stands:
        member.clock = Clock(member.clock.offset_us - round(ASLEEP_S * SECOND_US), member.clock.ppm)
    else:
        asleep_us = round(ASLEEP_S * SECOND_US)
        simulator.handle(member, lambda utime: Slept(utime, asleep_us))
    simulator._tick(member)
    now = simulator.now / SECOND_US
    simulator.play(member, [chunk for chunk in team.hardware[robot].chunks() if chunk.t >= now])
    return member


def clock_errors(team: VirtualTeam) -> list[tuple[int, int]]:
    """How wrong each robot is about each other's clock, and how wrong it says to be, us."""
    out, now = [], team.simulator.now
    members = team.simulator.members
    for a, b in itertools.permutations(members.values(), 2):
        peer = a.robot.team.peers.get(b.robot.own.robot)
        found = peer.clock.offset(a.clock.local(now)) if peer else None
        if found is not None:
            truth = b.clock.local(now) - a.clock.local(now)
            out.append((abs(found.us - truth), found.uncertainty_us))
    return out


@pytest.mark.slow
@pytest.mark.row("T2")
@pytest.mark.parametrize("stands", [False, True])
def test_after_a_sleep_clocks_begin_anew_and_no_window_spans_it(stands: bool) -> None:
    team = VirtualTeam(LONG)
    team.run(35.0)
    before = team.member(1).robot.front.reckoning.track.end
    member = sleep(team, 1, stands)
    woke = team.simulator.now
    if not stands:
        assert "was asleep for 10 s" in team.problems(1)
        local = member.clock.local(woke)
        assert all(peer.clock.since == local for peer in member.robot.team.peers.values())
    for half in range(1, 40):
        team.run(woke / SECOND_US + half / 2)
        wrong = [error for error, claimed in clock_errors(team) if error > claimed]
        # nobody can know before the first message after it
        assert not wrong or (stands and half <= 2), (half, wrong)
    errors = clock_errors(team)
    assert len(errors) == 6
    assert max(error for error, _ in errors) <= 10_000
    for one in team.simulator.members.values():
        for pair in one.robot.front.pairs.values():
            for end in pair_ends(team, one, pair.peer.robot):
                assert end >= before


def pair_ends(team: VirtualTeam, member: Member, peer: int) -> list[int]:
    """From which sample on windows of a pair with robot 1 may begin, on the grid of robot 1."""
    robot = member.robot
    if robot.own.robot == 1:
        return [robot.front.reckoning.track.segment_start]
    return [robot.team.peers[1].track.segment_start] if peer == 1 else []


@pytest.mark.row("T3")
@pytest.mark.parametrize("seconds", [0.1, 1.0, 5.0])
def test_after_a_stall_nothing_is_said_in_a_burst_and_odometry_goes_on(seconds: float) -> None:
    team = VirtualTeam(SHORT)
    team.run(12.0)
    member, simulator = team.member(0), team.simulator
    track = member.robot.front.reckoning.track
    before, end = len(member.traces.sent), track.end
    held: list[tuple[str, bytes]] = []
    feed = simulator.feed

    def late(one: Member, port: str, data: bytes) -> None:
        if one is member:
            held.append((port, data))
        else:
            feed(one, port, data)

    simulator.feed = late  # type: ignore[method-assign, assignment]
    tick, member.tick_at = member.tick_at, -1
    team.run(12.0 + seconds)
    simulator.feed = feed  # type: ignore[method-assign]
    for port, data in held:
        simulator.feed(member, port, data)
    assert tick >= 0
    simulator._tick(member)
    in_stall = len(member.traces.sent) - before
    team.run(13.0 + seconds)
    assert len(member.traces.sent) - before - in_stall <= 12
    assert track.end - end >= (seconds + 0.7) * SECOND_US / GRID_US


@pytest.mark.slow
@pytest.mark.row("T4")
def test_clocks_that_disagree_change_no_result(record_property: Recorded) -> None:
    found = []
    for offsets in ((0, 0, 0), (0, 1000, 500)):
        team = VirtualTeam(replace(EASY, seconds=50.0), on=())
        team._clocks = {robot: Clock(s * SECOND_US) for robot, s in enumerate(offsets)}
        for robot in range(3):
            team.start(robot)
        team.run(50.0)
        found.append(team.outcome().final)
    aligned, apart = found
    assert set(aligned) == set(apart) == {0, 1, 2}
    for robot in range(3):
        both = aligned[robot], apart[robot]
        t = np.linspace(both[0].t[0] + 1, both[0].t[-1] - 1, 50)
        a, b = (np.array([np.interp(t, p.t, p.poses[:, k]) for k in (0, 1)]) for p in both)
        assert np.abs(a - b).max() < 1e-3
        record_property("measured", f"{1e3 * np.abs(a - b).max():.2g} mm apart")
