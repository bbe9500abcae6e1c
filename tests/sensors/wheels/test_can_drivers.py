"""Bases on a CAN bus: ODrive axes, brought to a common time, and AgileX."""

from __future__ import annotations

import math
import struct

import pytest
from frames import SECOND_US
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.events import CanFrame
from drslamd.sensors.samples import Twist, WheelCounts, WheelSample, WheelTurns
from drslamd.sensors.wheels.agilex import AgilexDriver
from drslamd.sensors.wheels.odrive import OdriveDriver
from drslamd.sensors.wheels.side_pairing import (
    MAX_APART_US,
    Pair,
    Side,
    SidePairing,
    linear,
    wrapping,
)
from drslamd.sensors.wheels.wheel_driver import WheelRefusal

MS = 1000
T0 = 100 * SECOND_US

# ---- pairing -----------------------------------------------------------------------------------


def paired(*values: tuple[Side, int, float]) -> tuple[list[Pair], int]:
    pairing = SidePairing(linear)
    pairs = [pairing.add(side, utime, value) for side, utime, value in values]
    return [pair for pair in pairs if pair is not None], pairing.unpaired


FIRST, SECOND = Side.FIRST, Side.SECOND


def test_the_second_side_is_interpolated_to_the_time_of_the_first() -> None:
    pairs, unpaired = paired((SECOND, 0, 1.0), (FIRST, 2_500, 7.0), (SECOND, 10_000, 2.0))
    assert (pairs, unpaired) == ([Pair(2_500, 7.0, 1.25)], 0)


def test_equal_times_need_no_interpolation() -> None:
    assert paired((FIRST, 5, 7.0), (SECOND, 5, 1.0)) == ([Pair(5, 7.0, 1.0)], 0)


def test_each_value_of_the_first_side_is_used_once() -> None:
    values = [(SECOND, 0, 0.0)]
    for k in range(1, 20):
        values += [(FIRST, k * 10_000 - 3_000, k), (SECOND, k * 10_000, k)]
    pairs, unpaired = paired(*values)
    assert [pair.utime for pair in pairs] == [k * 10_000 - 3_000 for k in range(1, 20)]
    assert unpaired == 0


@pytest.mark.parametrize(("apart", "found"), [(MAX_APART_US, 1), (MAX_APART_US + 1, 0)])
def test_values_too_far_apart_are_no_pair(apart: int, found: int) -> None:
    pairs, unpaired = paired((SECOND, 0, 1.0), (FIRST, apart, 7.0), (SECOND, 3 * apart, 2.0))
    assert (len(pairs), unpaired) == (found, 1 - found)


def test_without_an_earlier_value_there_is_nothing_to_interpolate() -> None:
    assert paired((FIRST, 0, 7.0), (SECOND, 1, 2.0)) == ([], 1)


@pytest.mark.parametrize("utime", [9_999, 20_001])
def test_nothing_is_extrapolated(utime: int) -> None:
    for last in (10_000, 20_000):
        values = [(SECOND, 10_000, 0.0), (FIRST, utime, 7.0), (SECOND, last, 1.0)]
        assert paired(*values) == ([], 1)


def test_a_value_of_the_first_side_that_is_overtaken_counts_as_unpaired() -> None:
    pairs, unpaired = paired((SECOND, 0, 0.0), (FIRST, 1, 5.0), (FIRST, 2, 6.0), (SECOND, 4, 4.0))
    assert (pairs, unpaired) == ([Pair(2, 6.0, 2.0)], 1)


def test_counters_are_interpolated_over_their_wrap() -> None:
    between = wrapping(16)
    assert between(65_530, 10, 0.5) == 2
    assert between(10, 65_530, 0.75) == 65_534
    assert wrapping(64)((1 << 63) + 1, (1 << 63) + 3, 0.5) == (1 << 63) + 2


# ---- ODrive ------------------------------------------------------------------------------------


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


# ---- AgileX ------------------------------------------------------------------------------------


def agilex(can_id: int, data: bytes, utime: int = T0) -> CanFrame:
    return CanFrame(utime, can_id, False, data)


def odometry(utime: int, left: int, right: int) -> CanFrame:
    return agilex(0x311, struct.pack(">ii", left, right), utime)


def motion(utime: int, linear: int, angular: int) -> CanFrame:
    return agilex(0x221, struct.pack(">hhhh", linear, angular, 0, -1), utime)


def test_odometry_counts_millimetres() -> None:
    assert AgilexDriver().on_frame(odometry(T0, -63, 18)) == [WheelCounts(T0, -63, 18, 32)]
    extremes = odometry(T0, (1 << 31) - 1, -(1 << 31))
    assert AgilexDriver().on_frame(extremes) == [WheelCounts(T0, (1 << 31) - 1, -(1 << 31), 32)]


@pytest.mark.parametrize(("after", "used"), [(500 * MS, False), (501 * MS, True)])
def test_speeds_are_used_only_while_odometry_is_missing(after: int, used: bool) -> None:
    driver = AgilexDriver()
    driver.on_frame(odometry(T0, 0, 0))
    samples = driver.on_frame(motion(T0 + after, 500, -250))
    assert samples == ([Twist(T0 + after, 0.5, -0.25)] if used else [])


def test_a_base_without_odometry_is_given_half_a_second_to_send_some() -> None:
    driver = AgilexDriver()
    samples = [driver.on_frame(motion(T0 + k * 100 * MS, 500, 0)) for k in range(10)]
    assert [len(s) for s in samples] == [0] * 6 + [1] * 4


def test_when_odometry_comes_speeds_are_no_longer_used() -> None:
    driver = AgilexDriver()
    for k in range(10):
        driver.on_frame(motion(T0 + k * 100 * MS, 500, 0))
    assert driver.on_frame(odometry(T0 + SECOND_US, 1, 2))
    assert driver.on_frame(motion(T0 + SECOND_US + MS, 500, 0)) == []


def test_the_state_of_the_base_is_told_with_its_error_bits() -> None:
    driver = AgilexDriver()
    driver.on_frame(agilex(0x211, bytes([1, 0, 1, 0, 0, 0x80, 0, 0])))
    assert (driver.vehicle_state, driver.error_bits) == (1, 0x80)
    assert "an emergency stop (error bits 0x0080)" in str(driver.fault())
    driver.on_frame(agilex(0x211, bytes([2, 0, 1, 0, 1, 2, 0, 0])))
    assert "a fault (error bits 0x0102)" in str(driver.fault())
    driver.on_frame(agilex(0x211, bytes([0, 0, 1, 3, 0, 0, 0, 0xB1])))
    assert driver.fault() is None


def test_protocol_v1_is_named() -> None:
    driver = AgilexDriver()
    driver.on_frame(agilex(0x151, bytes(8)))
    assert driver.tally.refused == {WheelRefusal.OLD_PROTOCOL: 1}
    assert "protocol V1" in str(driver.fault())
    driver.on_frame(odometry(T0, 0, 0))
    assert driver.fault() is None  # it was somebody else on the bus


@pytest.mark.parametrize("can_id", [0x311, 0x211])
def test_a_short_frame_is_refused(can_id: int) -> None:
    driver = AgilexDriver()
    assert driver.on_frame(agilex(can_id, bytes(5))) == []
    assert driver.tally.refused == {WheelRefusal.SHORT: 1}


def test_a_short_speed_is_refused_when_it_is_needed() -> None:
    driver = AgilexDriver()
    driver.on_frame(motion(T0, 0, 0))
    driver.on_frame(agilex(0x221, bytes(3), T0 + SECOND_US))
    assert driver.tally.refused == {WheelRefusal.SHORT: 1}


@pytest.mark.parametrize(
    "frame",
    [
        agilex(0x212, bytes(4)),
        agilex(0x312, bytes(8)),
        agilex(0x241, bytes(8)),
        CanFrame(T0, 0x311, True, bytes(8)),
    ],
)
def test_frames_of_other_ids_are_normal(frame: CanFrame) -> None:
    driver = AgilexDriver()
    assert driver.on_frame(frame) == []
    assert (driver.tally.ignored, driver.tally.received) == (1, 1)


# ---- both --------------------------------------------------------------------------------------


@settings(derandomize=True, max_examples=300, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([0x09, 0x29, 0x21, 0x311, 0x221, 0x211, 0x151, 0x7FF]),
            st.booleans(),
            st.binary(max_size=10),
            st.integers(0, SECOND_US),
        ),
        max_size=20,
    )
)
def test_no_frames_make_a_driver_raise(frames: list[tuple[int, bool, bytes, int]]) -> None:
    odrive, base, utime = OdriveDriver(0, 1), AgilexDriver(), T0
    for can_id, extended, data, pause in frames:
        utime += pause
        frame = CanFrame(utime, can_id, extended, data)
        odrive.on_frame(frame)
        base.on_frame(frame)
    assert odrive.tally.received == base.tally.received == len(frames)
