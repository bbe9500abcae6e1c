"""What the team must know of one robot's sensors."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from slam_scenes import NOISE

from drslamd.config import OdometrySection
from drslamd.slam.robot_model import UNTOLD, RobotModel
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
