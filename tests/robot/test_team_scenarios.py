"""Whole teams in virtual time: what they promise when everything works, and when it does not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lab.play.simulator import Network
from lab.recordings import world
from teams import EASY, VirtualTeam

from drslamd.conventions import SECOND_US
from drslamd.events import SaveDone
from drslamd.gossip import messages
from drslamd.gossip.message_types import PoseState

SETTLED = 63.0


@pytest.fixture(scope="module")
def clean() -> VirtualTeam:
    """A team to whom nothing happens."""
    team = VirtualTeam()
    team.run(SETTLED)
    return team


def kinds_sent(team: VirtualTeam, robot: int) -> set[str | None]:
    sent = team.member(robot).traces.sent
    return {messages.kind_of_channel(channel) for _, channel, _ in sent}


@pytest.mark.slow
def test_a_team_agrees_on_one_frame_that_of_the_lowest_robot(clean: VirtualTeam) -> None:
    assert clean.frames() == {0: 0, 1: 0, 2: 0}


def test_it_knows_where_everybody_is_without_having_been_told_any_start(
    clean: VirtualTeam,
) -> None:
    errors = clean.errors()
    assert errors["ate_rmse_m"] < 0.06
    assert errors["rot_mean_deg"] < 1.5


def test_all_robots_hold_the_same_graph_and_reach_the_same_answer(clean: VirtualTeam) -> None:
    assert len(clean.digests()) == 1
    estimates = [member.robot.back.estimate for member in clean.simulator.members.values()]
    for robot in range(3):
        paths = [e.trajectories[robot].poses for e in estimates if e is not None]
        assert np.abs(paths[0] - paths[1]).max() < 2e-3
        assert np.abs(paths[0] - paths[2]).max() < 2e-3


@pytest.mark.row("T4")
def test_clocks_that_are_hours_apart_are_measured_within_what_is_claimed(
    clean: VirtualTeam,
) -> None:
    now = clean.simulator.now
    for robot, member in clean.simulator.members.items():
        for other, peer in member.robot.team.peers.items():
            there, here = clean.member(other).clock.local(now), member.clock.local(now)
            offset = peer.clock.offset(here)
            assert offset is not None, (robot, other)
            assert abs(offset.us - (there - here)) <= offset.uncertainty_us
            assert offset.uncertainty_us <= 10_000


def test_what_is_published_is_finite_and_says_in_whose_frame_it_is(clean: VirtualTeam) -> None:
    for robot, member in clean.simulator.members.items():
        poses = [
            (sent / SECOND_US, messages.decode("POSE", payload))
            for sent, channel, payload in member.traces.sent
            if messages.kind_of_channel(channel) == "POSE"
        ]
        assert len(poses) > 20, robot
        for sent_s, pose in poses:
            assert isinstance(pose, messages.Pose)
            assert all(map(math.isfinite, (*pose.pose, *pose.covariance)))
            # the recording ends after a minute, and with it the odometry
            states = [PoseState.LOCALISED] if sent_s < 60.8 else list(PoseState)
            assert pose.state in states
            assert pose.covariance[0] > 0


@pytest.mark.slow
def test_the_same_seed_sends_the_same_bytes() -> None:
    def sent() -> list[list[tuple[int, str, bytes]]]:
        team = VirtualTeam(network=Network(loss=0.2))
        team.run(15.0)
        return [member.traces.sent for member in team.simulator.members.values()]

    assert sent() == sent()


@pytest.mark.parametrize(
    "network",
    [
        pytest.param(Network(loss=0.3), id="30 percent lost", marks=pytest.mark.slow),
        pytest.param(Network(duplicate=0.5), id="half of it twice", marks=pytest.mark.slow),
        pytest.param(
            Network(delay_us=0, jitter_us=300_000),
            id="late and out of order",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_bad_radio_delays_the_answer_and_does_not_change_it(
    network: Network, clean: VirtualTeam
) -> None:
    team = VirtualTeam(network=network)
    team.run(SETTLED + 10)
    assert team.frames() == {0: 0, 1: 0, 2: 0}
    assert len(team.digests()) == 1
    assert team.errors()["ate_rmse_m"] < clean.errors()["ate_rmse_m"] + 0.03


@pytest.mark.row("S6")
@pytest.mark.slow
def test_a_robot_that_restarts_joins_again_and_the_others_keep_their_map() -> None:
    team = VirtualTeam()
    team.run(25.0)
    team.simulator.kill(team.member(1))
    team.run(27.0)
    team.start(1, epoch=2, epochs={0: 1, 2: 1})
    team.run(SETTLED)
    assert team.frames() == {0: 0, 1: 0, 2: 0}
    assert len(team.digests()) == 1
    chain = team.member(0).robot.back.graph.chains[1].chain
    assert chain.epoch == 2


@pytest.mark.slow
def test_when_the_lowest_robot_dies_the_next_gives_the_frame() -> None:
    team = VirtualTeam()
    team.run(40.0)
    team.simulator.kill(team.member(0))
    team.run(SETTLED)
    assert team.frames() == {1: 1, 2: 1}


@pytest.mark.slow
def test_a_robot_that_leaves_in_order_is_gone_within_two_heartbeats() -> None:
    team = VirtualTeam()
    team.run(30.0)
    team.simulator.stop(team.member(0))
    team.run(33.0)
    assert team.frames() == {1: 1, 2: 1}


@pytest.mark.row("N6")
@pytest.mark.slow
def test_a_partition_heals() -> None:
    def connected(a: int, b: int, t_us: int) -> bool:
        return not (25e6 < t_us < 45e6 and 2 in (a, b))

    team = VirtualTeam(network=Network(connected=connected))
    team.run(44.0)
    assert len(team.digests()) > 1
    team.run(SETTLED)
    assert len(team.digests()) == 1
    assert team.frames() == {0: 0, 1: 0, 2: 0}
    assert team.errors()["ate_rmse_m"] < 0.10


@pytest.mark.row("N5")
@pytest.mark.slow
def test_robots_that_hear_each_other_only_through_a_third_hold_the_same_graph() -> None:
    team = VirtualTeam(network=Network(connected=lambda a, b, _: {a, b} != {0, 2}))
    team.run(SETTLED + 5)
    assert team.frames() == {0: 0, 1: 0, 2: 0}
    assert len(team.digests()) == 1


def test_a_robot_alone_sends_only_its_heartbeat() -> None:
    team = VirtualTeam(on=(1,))
    team.run(20.0)
    assert kinds_sent(team, 1) == {"STATUS"}
    assert team.frames() == {1: None}
    assert "no other robot is heard" in team.problems(1)


def test_robots_out_of_uwb_range_of_everybody_send_only_their_heartbeat() -> None:
    team = VirtualTeam(on=())
    team.cut = lambda robot, port, t: port == "uwb"
    for robot in (0, 1):
        team.start(robot)
    team.run(20.0)
    assert kinds_sent(team, 0) == kinds_sent(team, 1) == {"STATUS"}
    assert "no ranges to robots 1" in team.problems(0)


@pytest.mark.row("M5")
def test_robots_that_stand_still_do_not_invent_poses() -> None:
    team = VirtualTeam(world.Scene(robots=2, seconds=30.0, speed=0.0, odometry_hz=20, range_hz=10))
    team.run(30.0)
    assert team.frames() == {0: None, 1: None}
    assert "not enough motion" in team.problems(0)
    assert "made by robots 0; ask them" in team.problems(1)


@pytest.mark.row("D5")
@pytest.mark.slow
def test_a_pulled_uwb_cable_is_named_and_the_team_goes_on_when_it_is_back() -> None:
    team = VirtualTeam(on=())
    team.cut = lambda robot, port, t: robot == 1 and port == "uwb" and 30 < t < 40
    for robot in range(3):
        team.start(robot)
    team.run(38.0)
    assert "UWB module" in team.problems(1)
    team.run(45.0)
    assert "UWB module" not in team.problems(1)
    team.run(SETTLED)
    assert team.frames() == {0: 0, 1: 0, 2: 0}
    assert team.errors()["ate_rmse_m"] < 0.10


@pytest.mark.slow
def test_after_silent_wheels_the_path_is_a_new_piece_that_finds_its_place() -> None:
    team = VirtualTeam(world.Scene(**{**EASY.__dict__, "seconds": 90.0}), on=())
    team.cut = lambda robot, port, t: robot == 1 and port == "wheels" and 30 < t < 40
    for robot in range(3):
        team.start(robot)
    team.run(38.0)
    assert "wheels" in team.problems(1)
    team.run(93.0)
    keyframes = team.member(0).robot.back.graph.chains[1].keyframes.rows
    assert len(np.unique(keyframes[:, 1])) == 2
    assert team.frames() == {0: 0, 1: 0, 2: 0}
    assert team.errors()["ate_rmse_m"] < 0.15


@pytest.mark.row("S2")
@pytest.mark.slow
def test_another_team_key_does_not_merge_and_both_sides_say_so() -> None:
    team = VirtualTeam(secrets={0: bytes(32), 1: bytes(32), 2: bytes([1] * 32)})
    team.run(45.0)
    assert team.frames() == {0: 0, 1: 0, 2: None}
    for robot in (0, 2):
        assert "do not fit the team key" in team.problems(robot)
    assert not team.member(2).robot.team.peers


@pytest.mark.row("S7")
def test_a_robot_whose_memory_was_lost_begins_above_what_its_peers_know() -> None:
    team = VirtualTeam(on=(0, 1))
    team.run(5.0)
    team.simulator.kill(team.member(1))
    late = team.start(1, epoch=50, epochs={0: 1})
    team.run(10.0)
    team.simulator.kill(late)
    forgetful = team.start(1, epoch=2)
    team.run(15.0)
    assert forgetful.robot.own.epoch > 50
    assert team.member(0).robot.team.peers[1].chain.epoch == forgetful.robot.own.epoch


@pytest.mark.row("S7")
def test_a_robot_that_can_keep_nothing_says_no_word_under_a_number_that_peers_know() -> None:
    """Its clock is behind as well."""
    team = VirtualTeam(on=(0, 1))
    team.run(5.0)
    team.simulator.kill(team.member(1))
    late = team.start(1, epoch=50, epochs={0: 1})
    team.run(10.0)
    team.simulator.kill(late)
    forgetful = team.start(1, epoch=50)  # by chance the very same number
    team.simulator.handle(forgetful, lambda utime: SaveDone(utime, "Read-only file system"))
    team.run(11.5)
    assert "only listens for ten seconds" in team.problems(1)
    team.run(24.0)
    said = {int.from_bytes(payload[11:19], "big") for _, _, payload in forgetful.traces.sent}
    assert said
    assert min(said) > 50
    assert team.member(0).robot.team.peers[1].chain.epoch == forgetful.robot.own.epoch


@pytest.mark.slow
def test_a_robot_that_starts_under_an_epoch_that_it_used_before_begins_again_above_it() -> None:
    """A copied disk, or a computer without clock and disk: its peers hold what it never said."""
    team = VirtualTeam()
    team.run(12.0)
    team.simulator.kill(team.member(1))
    team.run(20.0)
    team.start(1, epoch=1, epochs={0: 1, 2: 1})
    team.run(36.5)
    assert team.member(1).robot.own.epoch > 1
    chains = [m.robot.back.graph.chains[1] for m in team.simulator.members.values()]
    assert {data.chain for data in chains} == {team.member(1).robot.own}
    assert len({data.keyframes.rows.tobytes() for data in chains}) == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "extra",
    [
        pytest.param('[optimizer]\nalgorithm = "rbcd"\nrate_hz = 5\n', id="rbcd"),
        pytest.param(
            '[relative_pose]\nalgorithm = "paper"\n[optimizer]\nalgorithm = "rbcd"\nrate_hz = 5\n',
            id="the paper throughout",
        ),
    ],
)
def test_the_papers_algorithms_bring_the_team_together_too(extra: str) -> None:
    team = VirtualTeam(extra=extra)
    team.run(SETTLED)
    assert team.frames() == {0: 0, 1: 0, 2: 0}
    assert team.errors()["ate_rmse_m"] < 0.30
    assert "PUBLIC" in kinds_sent(team, 0)


@pytest.mark.slow
def test_closures_alone_bring_the_team_together_too() -> None:
    team = VirtualTeam(extra='[optimizer]\nalgorithm = "closures"\n')
    team.run(SETTLED)
    assert team.frames() == {0: 0, 1: 0, 2: 0}
    assert team.errors()["ate_rmse_m"] < 0.30
    assert "PUBLIC" not in kinds_sent(team, 0)


@pytest.mark.slow
def test_a_robot_needs_none_of_its_modules_to_run_as_often_as_the_others() -> None:
    rates = (
        "[relative_pose]\nrate_hz = 0.5\n[consistency]\nrate_hz = 2\n[optimizer]\nrate_hz = 0.2\n"
    )
    team = VirtualTeam(extra=rates)
    team.run(SETTLED)
    assert team.frames() == {0: 0, 1: 0, 2: 0}
    solved = {name: len(ms) for name, ms in team.member(0).traces.solve_ms.items()}
    assert 20 <= solved["relative_pose"] <= 64
    assert 5 <= solved["optimizer"] <= 13


@pytest.mark.slow
def test_antennas_at_different_heights_are_told_to_the_peers() -> None:
    """A tall robot and a low one, half a metre to five metres apart."""
    team = VirtualTeam(on=())
    heights = {0: 0.3, 1: 2.0, 2: 0.3}
    for robot, metres in heights.items():
        team.hardware[robot].antenna_z_m = metres
    raised = team.recording.ranges.copy()
    rise = np.array([heights[int(a)] - heights[int(b)] for a, b in raised[:, 1:3]])
    team.recording.ranges[:, 3] = np.hypot(raised[:, 3], rise)
    for robot in heights:
        team.start(robot)
    team.run(63.0)
    assert team.errors()["ate_rmse_m"] < 0.08
