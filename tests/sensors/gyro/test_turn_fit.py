"""How wheels and gyro go together, against drives of which it is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drslamd.sensors.gyro.turn_fit import Second, turn_fit

PER_SQRT_M, PER_M = math.radians(0.5), math.radians(0.15)
UNKNOWN = math.radians(0.5)


def driven(
    speeds: list[float], ratio: float = 1.0, per_m: float = 0.0, bias: float = 0.0, seed: int = 1
) -> list[Second]:
    rng = np.random.default_rng(seed)
    out = []
    for k, speed in enumerate(speeds):
        turn = 0.6 * math.sin(k)
        noise = float(rng.normal()) * PER_SQRT_M * math.sqrt(speed)
        wheels = ratio * turn + per_m * speed + noise
        out.append(Second(k * 1_000_000, 1.0, speed, wheels, turn + bias))
    return out


MIXED = [0.1, 0.5, 0.9, 0.3, 0.7] * 12
STEADY = [0.4] * 60


def test_a_wrong_track_a_worn_wheel_and_a_bias_are_told_apart_by_a_drive_at_all_speeds() -> None:
    ratio, per_m, bias = 1.3, math.radians(1.0), math.radians(1.0)
    found = turn_fit(driven(MIXED, ratio, per_m, bias), PER_SQRT_M, PER_M, UNKNOWN)
    assert found.ratio == pytest.approx(ratio, abs=0.01)
    assert found.per_m == pytest.approx(per_m, abs=math.radians(0.5))
    # (1.3 times as large, for what the wheels say of the gyro's bias is)
    assert found.bias_radps == pytest.approx(1.3 * bias, abs=4 * found.bias_sigma)
    assert found.bias_sigma < math.radians(0.2)


def test_at_one_speed_what_is_more_likely_counts() -> None:
    """1 deg/s at 0.4 m/s are 2.5 deg/m: 5 sigmas of a worn wheel, 2 of a gyro not seen at rest."""
    seconds = driven(STEADY, per_m=math.radians(-2.5))
    unseen = turn_fit(seconds, PER_SQRT_M, PER_M, UNKNOWN)
    assert unseen.bias_radps > math.radians(0.7)
    rested = turn_fit(seconds, PER_SQRT_M, PER_M, math.radians(0.01))
    assert abs(rested.bias_radps) < math.radians(0.03)
    assert rested.per_m < math.radians(-2.0)


def test_what_is_known_is_no_difference_of_both() -> None:
    found = turn_fit(driven(MIXED, 1.3, math.radians(1.0)), PER_SQRT_M, PER_M, UNKNOWN)
    second = Second(0, 1.0, 0.5, 1.3 * 0.4 + math.radians(0.5), 0.4)
    assert found.apart(second) == pytest.approx(0.0, abs=math.radians(0.4))
