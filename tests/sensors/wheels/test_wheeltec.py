"""Wheeltec frames: what the body does, and what its gyro says."""

from __future__ import annotations

import random

import pytest
from frames import SECOND_US, cut, wheeltec_frame
from hypothesis import given, settings
from hypothesis import strategies as st
from wheel_sections import wheels

from drslamd.sensors.frame_scanner import FrameScanner
from drslamd.sensors.samples import GyroRate, Twist
from drslamd.sensors.wheels.wheel_driver import WheelRefusal
from drslamd.sensors.wheels.wheel_input import WheelInput
from drslamd.sensors.wheels.wheeltec import WheeltecDriver, WheeltecFormat

MS = 1000
T0 = 100 * SECOND_US
FORWARD = bytes.fromhex("7b0000fa0000ffce0000000040000000000001775dc01b7d")
"""0.25 m/s, 0.05 rad/s to the right, 375 digits of the gyro to the left, written down by hand."""


def test_a_frame_gives_the_gyro_and_then_the_speeds() -> None:
    driver = WheeltecDriver()
    gyro, twist = driver.feed(FORWARD, T0)
    assert isinstance(gyro, GyroRate)
    assert gyro.radps == pytest.approx(0.0999, abs=1e-4)
    assert (gyro.utime, twist) == (T0, Twist(T0, 0.25, -0.05))
    assert driver.tally.accepted == 1
    assert driver.fault() is None


def test_five_seconds_at_a_quarter_of_a_metre_a_second() -> None:
    base = WheelInput(wheels("wheeltec"))
    motions = [
        motion
        for k in range(101)
        for motion in base.feed(wheeltec_frame(250, 100), T0 + 50 * k * MS)
    ]
    assert motions[0].gap
    assert sum(m.distance_m for m in motions) == pytest.approx(1.25)
    assert sum(m.turn_rad for m in motions) == pytest.approx(0.5)
    assert base.gyro.is_there


@pytest.mark.parametrize("at", range(24))
def test_a_frame_with_one_wrong_byte_is_none(at: int) -> None:
    wrong = bytearray(FORWARD)
    wrong[at] ^= 0x10
    driver = WheeltecDriver()
    assert driver.feed(bytes(wrong), T0) == []
    assert len(driver.feed(FORWARD, T0 + SECOND_US)) == 2


def test_the_end_of_a_frame_counts_too() -> None:
    frame = bytearray(FORWARD)
    frame[-1] = 0x7C
    driver = WheeltecDriver()
    assert driver.feed(bytes(frame), T0) == []
    assert driver.tally.refused[WheelRefusal.CHECKSUM] == 1


@pytest.mark.parametrize(("mmps", "is_odometry"), [(50, True), (51, False), (-51, False)])
def test_a_base_that_moves_sideways_is_refused_while_it_does(mmps: int, is_odometry: bool) -> None:
    driver = WheeltecDriver()
    assert bool(driver.feed(wheeltec_frame(0, 0, 0, mmps), T0)) is is_odometry
    assert ("sideways" in str(driver.fault())) is not is_odometry
    assert bool(driver.feed(wheeltec_frame(0, 0), T0 + 500 * MS)) is is_odometry
    assert driver.feed(wheeltec_frame(0, 0), T0 + 501 * MS)
    assert driver.fault() is None


def test_motors_that_are_switched_off_are_named_until_they_are_on() -> None:
    driver = WheeltecDriver()
    assert driver.feed(wheeltec_frame(0, 0, stop=1), T0)
    assert "stop switch" in str(driver.fault())
    driver.feed(wheeltec_frame(0, 0), T0 + 50 * MS)
    assert driver.fault() is None


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 60))
def test_frames_are_found_between_noise_however_they_are_cut(seed: int, longest: int) -> None:
    draw = random.Random(seed)
    frames = [wheeltec_frame(draw.randrange(-3000, 3000), k, 7 * k) for k in range(8)]
    noise = bytes(b for b in draw.randbytes(9) if b != 0x7B)
    scanner = FrameScanner(WheeltecFormat())
    stream = noise + b"".join(frame + noise for frame in frames)
    found = [each for read in cut(stream, seed, longest) for each in scanner.feed(read, T0)]
    assert found == frames
