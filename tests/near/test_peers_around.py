"""Peers of a solution: when they were there, how fast, and who is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from acquainted import introduce
from near_scenes import STEP_US, Steered

from drslamd.conventions import GRID_US, Chain
from drslamd.gossip.message_types import PoseState
from drslamd.near.peers_around import STANDS_US, UNHEARD_CLOCK_US
from drslamd.slam.graph.measurements import Keyframe


@pytest.fixture
def steered() -> Steered:
    scene = Steered()
    scene.drive(20)
    scene.solve()
    scene.look()
    return scene


def add(scene: Steered, robot: int, way_m: float, segment: int = 0) -> int:
    """One more keyframe of a peer, a second after its last, straight on."""
    data = scene.robot.back.graph.chains[robot]
    n, _, x, y, theta = data.keyframes.rows[-1]
    x, y = x + way_m * np.cos(theta), y + way_m * np.sin(theta)
    steps = (round(v * 1e4) for v in (x, y, theta))
    data.add(Keyframe(int(n) + 10, segment, *steps))
    return int(n) + 10


def test_a_peer_is_where_its_newest_keyframe_is(steered: Steered) -> None:
    before = steered.look().peers
    n = add(steered, 1, 0.3)
    steered.drive(10, 0.0, 0.0)
    after = steered.look().peers
    assert np.hypot(*(after.a_T_b - before.a_T_b)[0, :2]) == pytest.approx(0.3, abs=0.02)
    assert after.speeds[0] == pytest.approx(0.3, abs=1e-3)
    assert np.allclose(after.a_T_b[1], before.a_T_b[1])
    assert after.utimes[0] == n * GRID_US
    assert after.covariance[5, 0] > before.covariance[5, 0]


def test_news_are_looked_for_five_times_a_second(steered: Steered) -> None:
    before = steered.look().peers
    add(steered, 1, 0.3)
    steered.drive(9, 0.0, 0.0)
    assert np.allclose(steered.look().peers.a_T_b, before.a_T_b)


def test_of_who_has_a_hole_in_its_odometry_nobody_knows_where_it_is(steered: Steered) -> None:
    add(steered, 1, 0.3, segment=1)
    steered.drive(10)
    assert steered.look().peers.robots == (2,)


def test_who_is_not_heard_is_stale_and_its_clock_unsure(steered: Steered) -> None:
    peers = steered.look().peers
    assert set(peers.states) == {PoseState.STALE}
    assert set(peers.uncertainties) == {UNHEARD_CLOCK_US}


@pytest.mark.parametrize(("seconds", "is_silent"), [(2.5, False), (2.8, True)])
def test_who_says_nothing_and_lives_stood_there_until_we_would_know(
    steered: Steered, seconds: float, is_silent: bool
) -> None:
    """It may have turned since, so that its pose is not of now."""
    team = introduce(steered.robot.team, Chain(1, 1), utime=steered.utime)
    n = add(steered, 1, 0.3)
    late = n * GRID_US - steered.utime
    steered.drive(round(50 * seconds) + late // STEP_US, 0.0, 0.0)
    team.peers[1].last_heard = steered.utime
    near = steered.look()
    assert near.peers.utimes[0] == (near.utime - STANDS_US if is_silent else n * GRID_US)
    assert (near.peers.speeds[0] == 0.0) is is_silent


def test_of_robots_beyond_those_that_are_claimed_nothing_is_told(steered: Steered) -> None:
    estimate = steered.robot.back.estimate
    assert estimate is not None
    steered.robot.back.estimate = replace(estimate, joint=estimate.joint[:6, :6])
    assert steered.look().peers.robots == (1,)
