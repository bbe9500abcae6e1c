"""What a robot learned of its sensors serves it after a restart."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from lab.play.playback import equip
from lab.score.metrics import at_times
from teams import EASY, VirtualTeam

from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration, is_sound
from drslamd.slam.graph.estimate import Learned
from drslamd.slam.se2 import Array

WRONG = replace(
    EASY, robots=2, seconds=120.0, odometry=replace(EASY.odometry, scale=0.0, yaw_deg_per_m=0.0)
)
SCALE, BIAS_M = 0.08, -0.4


def wronged_team(kept: SensorCalibration = UNLEARNED) -> VirtualTeam:
    """Robot 0's wheels count 8 % too much, all ranges are 0.4 m short."""
    team = VirtualTeam(WRONG, on=())
    recording = team.recording
    trail = recording.trails[0]
    trail.odometry[:, :2] /= 1 - SCALE
    recording.ranges[:, 3] = np.maximum(recording.ranges[:, 3] + BIAS_M, 0.1)
    team.hardware = equip(recording)
    team.start(0, kept=kept)
    team.start(1)
    return team


def path_length(poses: Array) -> float:
    """Of poses (n, 3) that are a second apart: on finer steps it would be mostly noise."""
    return float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum())


@pytest.fixture(scope="module")
def first() -> VirtualTeam:
    team = wronged_team()
    team.run(123.0)
    return team


@pytest.mark.slow
def test_what_was_learned_is_in_the_state_that_an_orderly_stop_keeps(first: VirtualTeam) -> None:
    state = json.loads(json.dumps(first.member(0).robot.memory.state()["calibration"]))
    assert is_sound(state)
    kept = SensorCalibration.of_state(state)
    assert kept.scale.value == pytest.approx(SCALE, abs=0.03)
    assert kept.bias[1].value == pytest.approx(BIAS_M, abs=0.15)
    assert first.member(0).traces.saved
    # the other one does not own the pair
    assert not first.member(1).robot.calibration.latest.bias


@pytest.mark.slow
def test_a_restarted_robot_begins_with_what_it_knew(first: VirtualTeam) -> None:
    kept = first.member(0).robot.calibration.latest
    team = wronged_team(kept)
    team.run(10.0)
    robot = team.member(0).robot
    trail = team.recording.trails[0]
    driven = path_length(at_times(trail.t, trail.truth, np.arange(10.0)))
    assert path_length(robot.front.reckoning.track.poses[::10]) == pytest.approx(driven, rel=0.04)
    assert robot.front.model.noise.scale < 0.05
    assert robot.front.ranges[1].bias_m == kept.bias[1].value
    # so early nothing better is known, and nothing is forgotten
    assert SensorCalibration.of_state(robot.memory.state()["calibration"]).scale == kept.scale


@pytest.mark.slow
def test_with_what_it_knew_it_is_better_from_the_first_half_minute(first: VirtualTeam) -> None:
    def after_half_a_minute(kept: SensorCalibration) -> float:
        team = wronged_team(kept)
        team.run(30.0)
        return team.errors()["ate_rmse_m"]

    known = after_half_a_minute(first.member(0).robot.calibration.latest)
    assert known < 0.5 * after_half_a_minute(UNLEARNED)


@pytest.mark.slow
def test_a_changed_antenna_is_learned_anew(first: VirtualTeam) -> None:
    kept = replace(first.member(0).robot.calibration.latest, bias={1: Learned(0.0, 0.02)})
    team = wronged_team(kept)
    team.run(123.0)
    assert team.member(0).robot.calibration.latest.bias[1].value == pytest.approx(BIAS_M, abs=0.2)
