"""The bench sees what is planted: each promise broken once, on purpose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.recordings import world
from lab.soak import run as runs
from lab.soak.invariants import Broken, Invariants, Numbers
from lab.soak.stage import STRANGER, Bench, Stage

from drslamd.conventions import SECOND_US
from drslamd.events import Send, Tick
from drslamd.gossip.message_types import Pose, PoseState
from drslamd.gossip.seal import Header

SCENE = world.Scene(robots=2, seconds=12.0, odometry_hz=10, range_hz=5, both_measure=False)
COVARIANCE = (1.0, 0.0, 0.0, 1.0, 0.0, 1.0)


def bench(journal: bool = False) -> tuple[Bench, Invariants]:
    stage = Stage(world.simulate(SCENE, 1), np.random.default_rng(1), 4.0, 8.0)
    team = Bench(stage, 1)
    return team, Invariants(team, journal)


def test_a_datagram_that_no_counter_knows_is_seen() -> None:
    team, _ = bench()
    team.run(3.0)
    team.members[0].robot.team.accepted += 1
    with pytest.raises(Broken, match="P3"):
        team.run(5.0)


def test_a_robot_that_runs_is_not_switched_on_a_second_time() -> None:
    """Two faults of a mixture may each end with a start of the same robot."""
    team, _ = bench()
    team.run(1.0)
    first = team.members[0]
    team.switch_on(0)
    assert team.members[0] is first
    team.kill(first)
    team.switch_on(0)
    assert team.members[0] is not first


def test_a_container_beyond_its_bound_is_seen() -> None:
    team, invariants = bench()
    team.run(1.0)
    invariants.look()
    scanner = team.members[0].robot.uwb._scanner
    scanner._rest = bytes(4096)
    invariants.look()
    scanner._rest = bytes(4097)
    with pytest.raises(Broken, match="P4"):
        invariants.look()


def pose_of(team: Bench, age_us: int, state: PoseState = PoseState.LOCALISED) -> Send:
    robot = team.members[0].robot
    return robot.team.send(
        Pose(state, 0, 1, 100 * SECOND_US - age_us, (1.0, 2.0, 3.0), COVARIANCE), 0
    )


@pytest.mark.parametrize(
    ("age_us", "state", "is_kept"),
    [
        (SECOND_US, PoseState.LOCALISED, True),
        (SECOND_US + 1, PoseState.LOCALISED, False),
        (SECOND_US + 1, PoseState.STALE, True),
    ],
)
def test_an_old_pose_is_not_called_localised(age_us: int, state: PoseState, is_kept: bool) -> None:
    team, invariants = bench()
    send = pose_of(team, age_us, state)
    event = Tick(100 * SECOND_US)
    if is_kept:
        invariants.after(team.members[0], event, [send])
    else:
        with pytest.raises(Broken, match="P2"):
            invariants.after(team.members[0], event, [send])


def test_what_a_stranger_is_believed_is_seen_and_what_it_is_not_is_counted() -> None:
    team, _ = bench()
    team.run(3.0)
    robot = team.members[0].robot
    before = robot.team.refused.copy()
    team.arrive(team.members[0], b"nothing of ours", STRANGER)
    assert sum(robot.team.refused.values()) == sum(before.values()) + 1
    true = team.seen[0][-1]
    team.arrive(team.members[0], true, STRANGER)  # heard before: counts and changes nothing
    robot.team.peers.pop(1)
    robot.team.seal._windows.clear()
    with pytest.raises(Broken, match="P5"):
        team.arrive(team.members[0], true, STRANGER)


def test_strangers_repeat_only_what_was_taken() -> None:
    """A copy of what came before its sender had answered is that message itself, late."""
    team, _ = bench()
    team.run(3.0)
    member = team.members[0]
    count, taken = len(team.seen[0]), member.robot.team.accepted
    team.arrive(member, b"nothing of ours", "robot 1")
    assert (len(team.seen[0]), member.robot.team.accepted) == (count, taken)
    team.run(4.0)
    assert len(team.seen[0]) - count >= member.robot.team.accepted - taken > 0


def test_a_number_is_used_once_and_an_entry_may_be_said_again() -> None:
    numbers = Numbers()
    header = Header(3, 3, 10, 1, 0)
    assert numbers.use(header, "GRAPH", b"entry") == ""
    assert numbers.use(header, "GRAPH", b"entry") == ""
    assert "again" in numbers.use(header, "GRAPH", b"another entry")
    assert "again" in numbers.use(header, "POSE", b"pose")
    assert numbers.use(replace(header, counter=2), "POSE", b"pose") == ""
    assert numbers.use(Header(3, 3, 11, 1, 0), "POSE", b"pose") == ""
    assert "after" in numbers.use(Header(3, 3, 10, 3, 0), "POSE", b"pose")


def test_a_fresh_robot_answers_as_the_first_one_did_unless_it_is_another() -> None:
    team, invariants = bench(journal=True)
    team.run(8.0)
    invariants.end()
    member, journal = next(iter(invariants.journals.values()))
    journal.answers[-1] = b"otherwise"
    with pytest.raises(Broken, match="P7"):
        invariants.end()
    assert member.running


def test_equal_entries_in_unequal_graphs_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    team, invariants = bench()
    team.run(2.0)
    monkeypatch.setattr("lab.soak.agreement.held", lambda robot: {0: (1, frozenset({0}))})
    monkeypatch.setattr("lab.soak.agreement.whole_digest", lambda robot: 7)
    invariants.look()
    monkeypatch.setattr("lab.soak.agreement.whole_digest", lambda robot: int(robot.own.robot))
    with pytest.raises(Broken, match="P6"):
        invariants.look()


def test_what_ends_a_robot_is_a_failure_with_the_command_that_repeats_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def handle(robot: object, event: object) -> list[object]:
        raise ZeroDivisionError("planted")

    monkeypatch.setattr("drslamd.robot.Robot.handle", handle)
    result = runs.run("parted", 7)
    assert result.fault == "P1: ZeroDivisionError: planted"
    assert "repeat: tools/soak parted --seed 7 --until " in result.line
    assert result.line.startswith("FAIL parted seed=7 commit=")
