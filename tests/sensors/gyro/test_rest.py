"""The bias of a gyro, learned while the robot stands."""

from __future__ import annotations

import math

import pytest

from drslamd.conventions import SECOND_US
from drslamd.sensors.gyro.rest import GyroAtRest
from drslamd.sensors.samples import GyroSigmas

DEG_PER_H = math.radians(1 / 3600)
SIGMAS = GyroSigmas(math.radians(0.01), 10 * DEG_PER_H)


def rested(
    rest: GyroAtRest, seconds: float, radps: float, *, start_s: float = 0.0, is_in_use: bool = False
) -> list[bool]:
    """Ten readings a second; was another bias found?"""
    out = []
    for k in range(round(10 * seconds) + 1):
        t = start_s + k / 10
        out.append(rest.add(round(t * SECOND_US), 1, radps * t, is_in_use=is_in_use))
    return out


@pytest.mark.parametrize(("seconds", "is_learned"), [(51, False), (53, True)])
def test_it_is_learned_when_that_halves_its_sigma(seconds: int, is_learned: bool) -> None:
    """0.01 deg/sqrt(s) over T seconds are 36 / sqrt(T) deg/h: 5 at 51.8 s."""
    rest = GyroAtRest(SIGMAS)
    rested(rest, seconds, 8 * DEG_PER_H)
    assert rest.bias_radps == pytest.approx(8 * DEG_PER_H if is_learned else 0.0)
    told = 36 / math.sqrt(52) if is_learned else 10.0
    assert rest.told.yaw_rad_per_s == pytest.approx(told * DEG_PER_H, rel=0.001)
    assert rest.told.yaw_rad_per_sqrt_s == SIGMAS.yaw_rad_per_sqrt_s


def test_several_rests_add_up() -> None:
    rest = GyroAtRest(SIGMAS)
    for k in range(3):
        rested(rest, 20, 8 * DEG_PER_H, start_s=100.0 * k)
        rest.end()
    assert rest.bias_radps == pytest.approx(8 * DEG_PER_H)


def test_while_a_gyro_is_in_use_its_bias_stays_what_it_is() -> None:
    rest = GyroAtRest(SIGMAS)
    rested(rest, 200, 8 * DEG_PER_H, is_in_use=True)
    assert (rest.bias_radps, rest.told) == (0.0, SIGMAS)
    assert rest.is_known


@pytest.mark.parametrize("is_in_use", [False, True])
def test_a_bias_that_is_another_one_is_known_after_two_seconds(is_in_use: bool) -> None:
    rest = GyroAtRest(SIGMAS)
    found = rested(rest, 1.9, math.radians(1), is_in_use=is_in_use)
    assert not any(found)
    assert rest.add(2 * SECOND_US, 1, 2 * math.radians(1), is_in_use=is_in_use)
    assert rest.bias_radps == pytest.approx(math.radians(1))
    assert rest.told.yaw_rad_per_s == pytest.approx(math.radians(0.01))


def test_a_robot_that_is_turned_by_hand_teaches_nothing() -> None:
    """Never the same in two seconds, or more than any bias."""
    rest = GyroAtRest(SIGMAS)
    t, angle = 0.0, 0.0
    for rate in (5, -9, 3, 8, -2, 12, 12, 12):
        for _ in range(10):
            assert not rest.add(round(t * SECOND_US), 1, angle, is_in_use=False)
            t, angle = t + 0.1, angle + math.radians(rate) / 10
    assert rest.bias_radps == 0.0


def test_a_pause_of_the_gyro_is_no_turn() -> None:
    rest = GyroAtRest(SIGMAS)
    rest.add(0, 1, 0.0, is_in_use=False)
    assert not rest.add(SECOND_US, 2, 1.0, is_in_use=False)
    assert not rest.add(2 * SECOND_US, 2, 1.0, is_in_use=False)
    assert (rest.bias_radps, rest.is_known) == (0.0, True)


def test_what_is_doubted_is_not_known_until_it_is_seen_again() -> None:
    rest = GyroAtRest(SIGMAS)
    rested(rest, 2, 8 * DEG_PER_H)
    rest.doubt()
    assert not rest.is_known
    rested(rest, 2, 8 * DEG_PER_H, start_s=10.0)
    assert rest.is_known
