"""ODrive axes on a CAN bus: which frames are used, and what becomes of the others."""

from __future__ import annotations

import math
import struct
from typing import Any

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


# what is no odometry


def drive(driver: OdriveDriver, *axes: int, period_ms: int = 50, apart_ms: int = 11) -> list[Any]:
    """Axes that speak in turn for two seconds, one turn a second; what the driver makes of it."""
    frames = [
        estimates(
            axis,
            T0 + (k * period_ms + n * apart_ms) * MS,
            (k * period_ms + n * apart_ms) / 1e3,
            1.0,
        )
        for k in range(2000 // period_ms)
        for n, axis in enumerate(axes)
    ]
    return [sample for frame in frames for sample in driver.on_frame(frame)]


@pytest.mark.parametrize(
    ("period_ms", "apart_ms"), [(50, 11), (100, 50), (10, 5), (200, 10), (500, 250)]
)
def test_axes_that_speak_in_turn_make_a_sample_each_period(period_ms: int, apart_ms: int) -> None:
    samples = drive(OdriveDriver(0, 1), 0, 1, period_ms=period_ms, apart_ms=apart_ms)
    assert len(samples) == 2000 // period_ms - 1
    assert all(s.right == pytest.approx(s.left) for s in samples)


def said_of(*frames: CanFrame, left: int = 0, right: int = 1) -> str | None:
    driver = OdriveDriver(left, right)
    for frame in frames:
        driver.on_frame(frame)
    return driver.why_no_sample(T0 + SECOND_US)


@pytest.mark.parametrize(
    ("frames", "sentence"),
    [
        ([heartbeat(0, 0), heartbeat(1, 0)], "axes 0 and 1: heartbeats but no encoder estimates"),
        ([heartbeat(1, 0), estimates(0, T0, 1.0)], "axis 1: heartbeats but no encoder estimates"),
        ([estimates(0, T0, 1.0)], "nothing from ODrive axis 1, only from axis 0"),
        (
            [estimates(3, T0, 1.0), heartbeat(5, 0)],
            "nothing from ODrive axes 0 and 1, but axes 3 and 5",
        ),
        ([estimates(0, T0, math.nan), estimates(1, T0, 1.0)], "of ODrive axis 0 are no numbers"),
    ],
)
def test_what_an_odrive_lacks_has_its_own_sentence(frames: list[CanFrame], sentence: str) -> None:
    said = said_of(*frames)
    assert said is not None
    assert sentence in said


def test_of_a_bus_without_an_odrive_nothing_is_known() -> None:
    assert said_of() is None
    assert said_of(estimates(0, T0, 1.0), estimates(1, T0, 1.0)) is None


@pytest.mark.parametrize(("after_ms", "stands"), [(990, False), (1000, True)])
def test_a_position_that_stands_while_its_axis_turns_is_no_odometry(
    after_ms: int, stands: bool
) -> None:
    driver = OdriveDriver(0, 1)
    for ms in range(0, after_ms + 1, 10):
        driver.on_frame(estimates(0, T0 + ms * MS, 7.0, 0.1))
    assert (driver.fault() is not None) == stands
    assert driver.tally.refused[WheelRefusal.STANDING] == stands
    driver.on_frame(estimates(0, T0 + 1010 * MS, 7.1, 0.1))
    assert driver.fault() is None


def test_an_axis_at_rest_does_not_stand_still_for_too_long() -> None:
    driver = OdriveDriver(0, 1)
    for ms in range(0, 5000, 10):
        driver.on_frame(estimates(0, T0 + ms * MS, 7.0, 0.09))
    assert driver.fault() is None
