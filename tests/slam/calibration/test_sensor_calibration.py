"""What one start learned of its sensors: as it is kept, and what is made of it."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import pytest
from slam_scenes import NOISE

from drslamd.sensors.samples import GyroSigmas, Motion
from drslamd.slam.calibration.sensor_calibration import (
    CHANGED_BIAS_M,
    CHANGED_SCALE,
    CHANGED_YAW,
    MOST_BIAS_M,
    MOST_SCALE_ERROR,
    MOST_YAW_RATE,
    NOTHING,
    UNLEARNED,
    SensorCalibration,
    is_sound,
    is_value,
)
from drslamd.slam.graph.estimate import Learned

KEPT = SensorCalibration(Learned(0.15, 0.005), Learned(-0.002, 0.0004), {2: Learned(-0.4, 0.03)})


def test_what_is_written_is_read_back() -> None:
    for constants in (KEPT, SensorCalibration()):
        state = json.loads(json.dumps(constants.state()))
        assert is_sound(state)
        assert SensorCalibration.of_state(state) == constants


@pytest.mark.parametrize(
    "damage",
    [
        [],
        {"scale": 0.1},
        {"scale": [0.1]},
        {"scale": [0.1, 0.01, 0.0]},
        {"scale": [0.1, "0.01"]},
        {"scale": [True, 0.01]},
        {"scale": [float("nan"), 0.01]},
        {"scale": [0.1, float("nan")]},
        {"scale": [0.1, float("inf")]},
        {"scale": [0.1, 0.0]},
        {"scale": [10**400, 0.01]},
        {"scale": [1.01 * MOST_SCALE_ERROR, 0.01]},
        {"yaw_rad_per_m": [1.0, 0.01]},
        {"bias_m": [[0.1, 0.01]]},
        {"bias_m": {"two": [0.1, 0.01]}},
        {"bias_m": {"-2": [0.1, 0.01]}},
        {"bias_m": {"255": [0.1, 0.01]}},
        {"bias_m": {"2": [-1.01 * MOST_BIAS_M, 0.01]}},
        {"bias_m": {str(n).zfill(k): [0.1, 0.01] for n in range(200) for k in (1, 4)}},
    ],
)
def test_what_nobody_can_have_learned_is_refused(damage: Any) -> None:
    assert not is_sound(damage)


def test_values_at_their_bounds_are_believed() -> None:
    assert is_sound({"scale": [-MOST_SCALE_ERROR, 0.01], "bias_m": {"254": [MOST_BIAS_M, 0.01]}})
    assert is_sound({"bias_m": {str(n): [0, 1] for n in range(254)}})


def test_known_errors_of_the_wheels_are_taken_out() -> None:
    back = KEPT.corrected(Motion(7, -2.0, 0.1))
    assert back.distance_m == pytest.approx(-2.0 * 0.85)
    assert back.turn_rad == pytest.approx(0.1 + 0.002 * 2.0)
    assert (back.utime, back.gap) == (7, False)


def test_sigmas_come_back_wider_than_they_were_kept_and_no_wider_than_configured() -> None:
    # 3 % is what wheels change by; a configuration that says less is believed
    assert KEPT.narrowed(NOISE).scale == NOISE.scale == CHANGED_SCALE
    wide = replace(NOISE, scale=0.5)
    assert KEPT.narrowed(wide).scale == pytest.approx(math.hypot(0.005, CHANGED_SCALE))
    assert KEPT.bias_sigma(2, 5.0) == pytest.approx(math.hypot(0.03, CHANGED_BIAS_M))
    assert KEPT.bias_sigma(3, 0.3) == pytest.approx(0.3)
    assert SensorCalibration().narrowed(NOISE) == NOISE


def test_a_peer_of_whom_nothing_was_learned_has_no_bias() -> None:
    assert KEPT.bias_to(2) == Learned(-0.4, 0.03)
    assert KEPT.bias_to(3) == NOTHING
    assert math.isinf(NOTHING.sigma)


def test_what_was_never_measured_is_not_written() -> None:
    assert UNLEARNED.state() == {"bias_m": {}}
    assert set(KEPT.state()) == {"scale", "yaw_rad_per_m", "bias_m"}


def test_nothing_is_taken_out_while_nothing_is_known() -> None:
    motion = Motion(7, -2.0, 0.1, gap=True)
    assert UNLEARNED.corrected(motion) == motion


def test_a_yaw_rate_comes_back_wider_and_the_random_part_as_it_was() -> None:
    wide = replace(NOISE, yaw_rad_per_m=math.radians(5))
    left = KEPT.narrowed(wide)
    assert left.yaw_rad_per_m == pytest.approx(math.hypot(0.0004, CHANGED_YAW))
    assert left.translation_per_sqrt_m == NOISE.translation_per_sqrt_m
    assert left.yaw_rad_per_sqrt_m == NOISE.yaw_rad_per_sqrt_m


@pytest.mark.parametrize(
    ("pair", "is_one"),
    [
        ([0.2, 0.2], True),
        ((-0.2, 0.01), True),
        ([0.201, 0.1], False),
        ([0.1, 0.201], False),
        ([0.1, 0.0], False),
        ([0.1, -0.1], False),
        ([math.nan, 0.1], False),
        ([0.1, True], False),
        ([0.1], False),
        ({0.1: 1, 0.2: 2}, False),
    ],
)
def test_a_value_and_its_sigma_lie_within_what_is_possible(pair: object, is_one: bool) -> None:
    assert is_value(pair, 0.2) is is_one


@pytest.mark.parametrize(
    ("times", "is_believed"), [(0.999, True), (1.001, False), (-0.999, True), (-1.001, False)]
)
def test_every_constant_has_a_bound(times: float, is_believed: bool) -> None:
    assert is_sound({"scale": [times * MOST_SCALE_ERROR, 0.01]}) is is_believed
    assert is_sound({"yaw_rad_per_m": [times * MOST_YAW_RATE, 0.01]}) is is_believed
    assert is_sound({"bias_m": {"2": [times * MOST_BIAS_M, 0.01]}}) is is_believed


def test_turns_of_a_gyro_are_not_corrected_by_what_is_known_of_the_wheels() -> None:
    known = SensorCalibration(Learned(0.2, 0.01), Learned(0.1, 0.01), {}, turn=Learned(0.5, 0.1))
    motion = Motion(1, 1.0, 0.4, gyro=GyroSigmas(0.01, 0.001))
    assert known.corrected(motion) == replace(motion, distance_m=0.8)
    by_wheels = known.corrected(replace(motion, gyro=None))
    assert by_wheels.turn_rad == pytest.approx(1.5 * 0.4 - 0.1)
