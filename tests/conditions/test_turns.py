"""What is said where wheels and gyro tell of different turns."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from drslamd.conditions import turns
from drslamd.sensors.gyro.comparison import GyroFault
from drslamd.sensors.gyro.gyro_heading import SHOWN_US, GyroHeading
from drslamd.sensors.samples import GyroAngle, GyroSigmas, Motion

T0 = 1_000_000_000
HZ = 10


def driven(seconds: float, *, gyro: float = 1.0, breaks_at_s: float = math.inf) -> GyroHeading:
    """Curves at 0.3 m/s; the gyro says `gyro` times the turn, and nothing after it broke."""
    heading = GyroHeading(GyroSigmas(math.radians(0.01), math.radians(0.003)), (0.003, 0.009), 0.2)
    angle = 0.0
    for k in range(round(seconds * HZ)):
        t = k / HZ
        turn = math.radians(20) * math.sin(t / 2) / HZ
        angle += gyro * turn
        utime = T0 + round(t * 1e6)
        if t < breaks_at_s:
            heading.add(GyroAngle(utime, angle))
        heading.turned(Motion(utime, 0.3 / HZ, turn, gap=not k))
    return heading


def said(gyro: GyroHeading, s: float) -> dict[str, str | None]:
    return dict(turns.conditions(gyro, T0 + round(s * 1e6)))


def test_of_a_gyro_that_is_right_nothing_is_said() -> None:
    assert said(driven(30), 30) == {"gyro": None, "wheels.slip": None, "wheels.track": None}


def test_without_a_gyro_nothing_is_said() -> None:
    assert not any(said(driven(30, breaks_at_s=0), 30).values())


@pytest.mark.parametrize("fault", GyroFault)
def test_every_fault_has_a_remedy(fault: GyroFault) -> None:
    assert len(turns.REMEDIES[fault]) > 10


def test_a_fault_is_named_with_what_counts_meanwhile_and_what_to_do() -> None:
    assert said(driven(30, breaks_at_s=20), 30)["gyro"] == (
        "the gyro says nothing any more; the heading comes from the wheels meanwhile; check its "
        "cable and its power"
    )
    assert "wheels.reverse_gyro" in (said(driven(12, gyro=-1), 12)["gyro"] or "")


def test_a_slip_is_spoken_of_for_ten_seconds() -> None:
    gyro = driven(30)
    gyro.comparison.last_slip = T0
    assert "slip" in (said(gyro, SHOWN_US / 1e6 - 0.001)["wheels.slip"] or "")
    assert said(gyro, SHOWN_US / 1e6)["wheels.slip"] is None


@pytest.mark.parametrize(("ratio", "is_named"), [(1.11, True), (1.09, False), (0.89, True)])
def test_a_track_that_is_a_tenth_off_is_named_with_what_it_should_be(
    ratio: float, is_named: bool
) -> None:
    gyro = driven(30)
    assert gyro.is_in_use
    gyro.comparison.known = replace(gyro.comparison.known, ratio=ratio)
    sentence = said(gyro, 30)["wheels.track"]
    assert (sentence is not None) is is_named
    assert not is_named or f"about {ratio:.1f} times" in (sentence or "")


def test_a_bias_that_is_taken_out_is_said_to_be() -> None:
    gyro = driven(30)
    gyro.rest.bias_radps = math.radians(0.6)
    assert "that is taken out" in (said(gyro, 30)["gyro"] or "")
    gyro.rest.bias_radps = math.radians(0.4)
    assert said(gyro, 30)["gyro"] is None
