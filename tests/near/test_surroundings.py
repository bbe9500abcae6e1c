"""Frames, speeds, jumps, and what is said on LCM."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from near_scenes import Steered

from drslamd.gossip.message_types import UNKNOWN_CLOCK, PoseState
from drslamd.near import near_message
from drslamd.slam import se2
from drslamd.slam.pose_now import pose_now


@pytest.fixture
def steered() -> Steered:
    scene = Steered()
    scene.drive(20)
    scene.solve()
    return scene


def test_before_the_first_odometry_there_is_nothing_to_say() -> None:
    assert Steered().robot.near.look(0) is None


def test_without_a_solution_there_is_dead_reckoning_and_speed() -> None:
    scene = Steered()
    scene.drive(20)
    near = scene.look()
    assert near.state == PoseState.NOT_LOCALISED
    assert near.odom == tuple(scene.robot.front.reckoning.pose)
    assert near.speed_mps == pytest.approx(0.5)
    assert near.turn_radps == pytest.approx(0.2)
    assert near.utc_minus_clock_us == UNKNOWN_CLOCK
    assert len(near.peers) == 0


def test_the_pose_is_that_which_is_published_once_a_second(steered: Steered) -> None:
    steered.look()
    steered.drive(35)
    near = steered.look()
    front, estimate = steered.robot.front, steered.robot.back.estimate
    assert estimate is not None
    assert near.utime % 100_000 == 0
    slow = pose_now(estimate, 0, front.reckoning.track, front.model.noise)
    assert slow is not None
    assert slow.utime == near.utime
    assert np.allclose(near.pose, slow.pose, atol=2e-4)
    assert np.allclose(near.covariance, se2.packed(slow.covariance), rtol=0.02, atol=1e-6)
    assert near.peers.robots == (1, 2)


def test_a_solution_moves_the_odometry_frame_and_nothing_else(steered: Steered) -> None:
    before = steered.look()
    estimate = steered.robot.back.estimate
    assert estimate is not None
    moved = {
        robot: replace(path, poses=path.poses + [0.01, 0.0, 0.0])
        for robot, path in estimate.trajectories.items()
    }
    steered.robot.back.estimate = replace(estimate, trajectories=moved)
    after = steered.look()
    assert after.odom == before.odom
    assert np.allclose(after.pose - before.pose, [0.01, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize(("sigmas", "resets"), [(3.3, 0), (3.4, 1)])
def test_a_jump_beyond_what_was_claimed_counts(
    steered: Steered, sigmas: float, resets: int
) -> None:
    """The square root of 11.34 is 3.37."""
    estimate = steered.robot.back.estimate
    assert estimate is not None
    sure = replace(estimate, joint=0.01 * np.eye(9), narrower={})
    steered.robot.back.estimate = sure
    steered.look()
    paths = dict(sure.trajectories)
    paths[0] = replace(paths[0], poses=paths[0].poses + [0.1 * sigmas, 0.0, 0.0])
    steered.robot.back.estimate = replace(sure, trajectories=paths)
    assert steered.look().resets == resets


def test_after_a_gap_there_is_no_pose_until_a_solution_reaches_beyond_it(
    steered: Steered,
) -> None:
    assert steered.look().state != PoseState.NOT_LOCALISED
    steered.gap()
    assert steered.look().state == PoseState.NOT_LOCALISED
    steered.drive(20)
    assert steered.look().state == PoseState.NOT_LOCALISED
    steered.solve()
    near = steered.look()
    assert near.state != PoseState.NOT_LOCALISED
    assert near.resets == 1


def test_nothing_is_said_on_lcm_unless_it_is_asked_for(steered: Steered) -> None:
    assert steered.robot.near.send(steered.utime) == []


def test_on_lcm_it_is_said_as_often_as_it_is_asked_for() -> None:
    scene = Steered("[near]\nlcm_hz = 10\n")
    scene.drive(20)
    scene.solve()
    said = []
    for _ in range(50):
        scene.drive(1)
        said += scene.robot.near.send(scene.utime)
    assert len(said) == 10
    assert {send.channel for send in said} == {"DRSLAM_NEAR_000"}
    found = near_message.decode(said[-1].payload)
    assert isinstance(found, near_message.Near)
    assert found.peers.robots == (1, 2)


def test_what_is_said_on_lcm_does_not_depend_on_who_reads_the_socket() -> None:
    payloads = []
    for reads in (False, True):
        scene = Steered("[near]\nlcm_hz = 1\n")
        scene.drive(20)
        scene.solve()
        said = []
        for _ in range(150):
            scene.drive(1)
            if reads:
                scene.look()
            said += scene.robot.near.send(scene.utime)
        payloads.append([send.payload for send in said])
    assert payloads[0] == payloads[1]
    assert len(payloads[0]) == 3


@pytest.mark.parametrize(
    ("sigma_rad", "state"), [(1e-6, PoseState.STALE), (1.0, PoseState.LOCALISED)]
)
def test_a_pose_that_module_3_does_not_have_yet_is_stale_here(
    steered: Steered, sigma_rad: float, state: PoseState, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its covariances are those of module 3."""
    now = steered.robot.pose()
    assert now is not None
    placed = now._replace(covariance=np.diag([0.1, 0.1, sigma_rad]) ** 2)
    relocation = steered.robot.front.relocation
    monkeypatch.setattr(relocation, "placed", lambda estimate, track: placed)
    assert steered.look().state is state
