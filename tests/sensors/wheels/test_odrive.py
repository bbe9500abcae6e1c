"""ODrive axes on a CAN bus: which frames are used, and what becomes of the others."""

from __future__ import annotations

import math
import struct

import pytest
from frames import SECOND_US
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.events import CanFrame
from drslamd.sensors.samples import WheelSample, WheelTurns
from drslamd.sensors.wheels.odrive import OdriveDriver
from drslamd.sensors.wheels.wheel_driver import WheelRefusal

MS = 1000
T0 = 100 * SECOND_US


def estimates(axis: int, utime: int, turns: float, speed: float = 0.0) -> CanFrame:
    return CanFrame(utime, axis << 5 | 0x09, False, struct.pack("<ff", turns, speed))


def heartbeat(axis: int, error: int) -> CanFrame:
    return CanFrame(T0, axis << 5 | 0x01, False, struct.pack("<IB3x", error, 8))


def test_two_axes_make_one_sample() -> None:
    driver = OdriveDriver(3, 63)
    samples: list[WheelSample] = []
    for frame in (
        estimates(63, T0, -1.0),
        estimates(3, T0 + 4 * MS, 1024.125),
        estimates(63, T0 + 8 * MS, -1.5),
        estimates(3, T0 + 14 * MS, 1024.25),
        estimates(63, T0 + 18 * MS, -2.5),
    ):
        samples += driver.on_frame(frame)
    assert samples == [
        WheelTurns(T0 + 4 * MS, 1024.125, -1.25),
        WheelTurns(T0 + 14 * MS, 1024.25, -2.1),
    ]
    assert driver.tally.accepted == 5


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (CanFrame(T0, 0x29, False, bytes(7)), WheelRefusal.SHORT),
        (CanFrame(T0, 0x29, False, b""), WheelRefusal.SHORT),
        (CanFrame(T0, 0x21, False, bytes(3)), WheelRefusal.SHORT),
        (estimates(1, T0, math.nan), WheelRefusal.NOT_FINITE),
        (estimates(1, T0, math.inf), WheelRefusal.NOT_FINITE),
        (estimates(1, T0, 0.0, math.nan), WheelRefusal.NOT_FINITE),
    ],
)
def test_a_frame_of_an_axis_that_cannot_be_read_is_refused(
    frame: CanFrame, reason: WheelRefusal
) -> None:
    driver = OdriveDriver(0, 1)
    assert driver.on_frame(frame) == []
    assert driver.tally.refused == {reason: 1}


@pytest.mark.parametrize(
    "frame",
    [
        estimates(2, T0, 1.0),  # another axis
        CanFrame(T0, 0x2A, False, bytes(8)),  # another command
        CanFrame(T0, 0x29, True, bytes(8)),  # an extended id
        heartbeat(1, 0),
    ],
)
def test_other_frames_are_ignored(frame: CanFrame) -> None:
    driver = OdriveDriver(0, 1)
    assert driver.on_frame(frame) == []
    assert (driver.tally.ignored, driver.tally.received) == (1, 1)


def test_an_axis_error_is_told_until_it_is_cleared() -> None:
    driver = OdriveDriver(0, 1)
    assert driver.fault() is None
    driver.on_frame(heartbeat(1, 0x40))
    driver.on_frame(heartbeat(2, 0x80))
    assert "axis 1 reports error 0x40" in str(driver.fault())
    driver.on_frame(heartbeat(1, 0))
    assert driver.fault() is None


def test_a_value_that_finds_no_partner_is_counted() -> None:
    driver = OdriveDriver(3, 63)
    for k in range(4):
        driver.on_frame(estimates(3, T0 + k * 10 * MS, 0.0))
    assert driver.unpaired() == 3


@settings(derandomize=True, max_examples=200, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([0x09, 0x29, 0x21, 0x311, 0x7FF]),
            st.booleans(),
            st.binary(max_size=10),
            st.integers(0, SECOND_US),
        ),
        max_size=20,
    )
)
def test_no_frames_make_an_odrive_raise(frames: list[tuple[int, bool, bytes, int]]) -> None:
    driver, utime = OdriveDriver(0, 1), T0
    for can_id, extended, data, pause in frames:
        utime += pause
        driver.on_frame(CanFrame(utime, can_id, extended, data))
    assert driver.tally.received == len(frames)
