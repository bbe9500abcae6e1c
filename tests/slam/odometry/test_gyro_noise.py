"""Which part of a way had its heading from a gyro, and for how long."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drslamd.slam.odometry.gyro_noise import OPEN, GyroNoise, turned_seconds

GYRO = GyroNoise(0.01, 0.001, 100, 200)


def ahead(count: int) -> np.ndarray:
    return np.stack([np.arange(count) * 0.1, np.zeros(count), np.zeros(count)], axis=-1)


def test_steps_that_lie_whole_within_the_span_count() -> None:
    n = np.array([80, 95, 100, 110, 195, 200, 205])
    assert GYRO.seconds(n, ahead(7)).tolist() == [0, 0, 1.0, 5.0, 0.5, 0]


def test_a_robot_that_stands_has_no_error() -> None:
    poses = ahead(4)
    poses[2] = poses[1]
    assert GYRO.seconds(np.array([100, 110, 120, 130]), poses).tolist() == [1.0, 0.0, 1.0]
    poses[2, 2] = 0.001  # it turns on the spot
    assert GYRO.seconds(np.array([100, 110, 120, 130]), poses).tolist() == [1.0, 1.0, 1.0]


def test_of_several_ways_at_once_each_has_its_own() -> None:
    n = np.array([[0, 10, 20], [90, 100, 110]])
    both = turned_seconds(n, np.stack([ahead(3)] * 2), (100, 200))
    assert both.tolist() == [[0, 0], [0, 1.0]]


def test_while_it_is_in_use_a_span_has_no_end() -> None:
    assert replace(GYRO, until=OPEN).is_in_use
    assert not GYRO.is_in_use
    assert replace(GYRO, until=OPEN).span == (100, OPEN)


@pytest.mark.parametrize(
    ("keys", "is_plausible"),
    [
        ({}, True),
        ({"yaw_rad_per_sqrt_s": math.radians(5)}, True),
        ({"yaw_rad_per_sqrt_s": math.radians(5.01)}, False),
        ({"yaw_rad_per_sqrt_s": 0.0}, False),
        ({"yaw_rad_per_s": math.radians(5)}, True),
        ({"yaw_rad_per_s": math.radians(5.01)}, False),
        ({"yaw_rad_per_s": math.nan}, False),
        ({"until": 100}, True),
        ({"until": 99}, False),
        ({"since": -1}, False),
        ({"until": OPEN + 1}, False),
    ],
)
def test_what_no_source_may_say_is_not_plausible(
    keys: dict[str, float], is_plausible: bool
) -> None:
    assert GyroNoise(**{**vars(GYRO), **keys}).is_plausible() is is_plausible
