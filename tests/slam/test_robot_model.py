"""What the team must know of one robot's sensors."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from slam_scenes import NOISE

from drslamd.config import OdometrySection
from drslamd.conventions import GRID_US
from drslamd.sensors.samples import GyroSigmas, Motion
from drslamd.slam.odometry.gyro_noise import OPEN, GyroNoise
from drslamd.slam.robot_model import UNTOLD, RobotModel, with_gyro
from drslamd.slam.settings import odometry_noise

MODEL = RobotModel(NOISE, 0.1, -0.2, 0.3, 0.4)


def test_of_a_robot_that_has_not_spoken_the_defaults_of_the_configuration_are_assumed() -> None:
    assert RobotModel(odometry_noise(OdometrySection())) == UNTOLD


def test_it_travels_as_eight_numbers_and_comes_back() -> None:
    numbers = MODEL.numbers()
    assert numbers == (
        NOISE.scale,
        NOISE.yaw_rad_per_m,
        NOISE.translation_per_sqrt_m,
        NOISE.yaw_rad_per_sqrt_m,
        0.1,
        -0.2,
        0.3,
        0.4,
    )
    assert RobotModel.of_numbers(numbers) == MODEL


def test_the_antenna_is_seen_from_above() -> None:
    assert MODEL.antenna.tolist() == [0.1, -0.2]


@pytest.mark.parametrize("name", ["antenna_x_m", "antenna_y_m", "antenna_z_m"])
@pytest.mark.parametrize(
    ("metres", "is_plausible"),
    [(5.0, True), (-5.0, True), (5.0012, False), (-5.0012, False), (math.nan, False)],
)
def test_an_antenna_stands_as_far_off_as_a_configuration_may_say(
    name: str, metres: float, is_plausible: bool
) -> None:
    changed = RobotModel(**{**vars(MODEL), name: metres})
    assert changed.is_plausible() is is_plausible


@pytest.mark.parametrize(
    ("metres", "is_plausible"),
    [(0.0, True), (5.0, True), (-0.001, False), (5.0012, False), (math.nan, False)],
)
def test_wheels_stand_as_far_apart_as_a_configuration_may_say(
    metres: float, is_plausible: bool
) -> None:
    assert replace(MODEL, half_track_m=metres).is_plausible() is is_plausible


def test_noise_that_no_configuration_allows_is_not_plausible() -> None:
    assert MODEL.is_plausible()
    assert not replace(MODEL, noise=replace(NOISE, scale=0.6)).is_plausible()


GYRO = GyroNoise(0.002, 0.0001, 70_000, OPEN)
SIGMAS = GyroSigmas(0.002, 0.0001)


def motion(n: float, gyro: GyroSigmas | None = SIGMAS, **keys: Any) -> Motion:
    """One that ended a little after sample n of the grid."""
    return Motion(round(n * GRID_US), 0.1, 0.2, gyro=gyro, **keys)


def test_of_a_robot_with_a_gyro_fourteen_numbers_travel() -> None:
    model = replace(MODEL, noise=replace(NOISE, gyro=GYRO))
    numbers = model.numbers()
    assert numbers[:8] == MODEL.numbers()
    assert numbers[8:] == (0.002, 0.0001, 1, 4464, 32_767, 65_535)
    assert RobotModel.of_numbers(numbers) == model


def test_a_gyro_counts_from_the_first_sample_after_its_first_turn() -> None:
    model = with_gyro(MODEL, motion(70.4))
    assert model.noise.gyro == GyroNoise(0.002, 0.0001, 71, OPEN)
    assert with_gyro(model, motion(70.9)) is model
    assert with_gyro(MODEL, motion(70.4, None)) is MODEL


def test_a_gyro_that_is_better_known_says_so() -> None:
    model = with_gyro(with_gyro(MODEL, motion(70)), motion(80, GyroSigmas(0.002, 0.00005)))
    assert model.noise.gyro == GyroNoise(0.002, 0.00005, 71, OPEN)


def test_a_gyro_is_in_use_until_the_last_sample_that_it_turned_whole() -> None:
    model = with_gyro(with_gyro(MODEL, motion(70)), motion(90.5, None))
    assert model.noise.gyro == GyroNoise(0.002, 0.0001, 71, 89)
    assert with_gyro(model, motion(95, None)) is model
    again = with_gyro(model, motion(120.5))
    assert again.noise.gyro == GyroNoise(0.002, 0.0001, 121, OPEN)


def test_of_one_that_was_wrong_counts_what_it_turned_before() -> None:
    wrong = motion(90.5, None, gyro_wrong_since=round(80.5 * GRID_US))
    model = with_gyro(with_gyro(MODEL, motion(70)), wrong)
    assert model.noise.gyro == GyroNoise(0.002, 0.0001, 71, 80)
    early = motion(90.5, None, gyro_wrong_since=60 * GRID_US)
    assert with_gyro(with_gyro(MODEL, motion(70)), early).noise.gyro == GyroNoise(
        0.002, 0.0001, 71, 71
    )


def test_a_gap_says_nothing_of_the_gyro() -> None:
    model = with_gyro(MODEL, motion(70))
    assert with_gyro(model, motion(90, None, gap=True)) is model
