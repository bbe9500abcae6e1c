"""AgileX bases on a CAN bus: odometry in millimetres, speeds while there is none, their state."""

from __future__ import annotations

import math
import struct

import pytest
from frames import SECOND_US
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.config_wheels import AgilexSection
from drslamd.events import CanFrame
from drslamd.sensors.samples import GyroAngle, GyroRate, Twist, WheelCounts
from drslamd.sensors.wheels.agilex import AgilexDriver, Steering
from drslamd.sensors.wheels.wheel_driver import WheelRefusal
from drslamd.sensors.wheels.wheel_input import WheelInput

MS = 1000
T0 = 100 * SECOND_US


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


@settings(derandomize=True, max_examples=200, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([0x311, 0x221, 0x211, 0x151, 0x29, 0x7FF]),
            st.booleans(),
            st.binary(max_size=10),
            st.integers(0, SECOND_US),
        ),
        max_size=20,
    )
)
def test_no_frames_make_an_agilex_base_raise(frames: list[tuple[int, bool, bytes, int]]) -> None:
    driver, utime = AgilexDriver(), T0
    for can_id, extended, data, pause in frames:
        utime += pause
        driver.on_frame(CanFrame(utime, can_id, extended, data))
    assert driver.tally.received == len(frames)


# models that say otherwise how they move


def full(utime: int, linear: int, angular: int, sideways: int, steering: int) -> CanFrame:
    return agilex(0x221, struct.pack(">hhhh", linear, angular, sideways, steering), utime)


def hunter(steering: Steering | None) -> tuple[AgilexDriver, list[Twist]]:
    """A Hunter 2.0 at 1 m/s with its inner wheel at 0.3 rad to the left, for ten seconds."""
    driver = AgilexDriver(steering)
    samples = [
        s for k in range(500) for s in driver.on_frame(full(T0 + k * 20 * MS, 1000, 0, 0, 300))
    ]
    assert all(isinstance(sample, Twist) for sample in samples)
    return driver, samples  # type: ignore[return-value]


def test_a_hunter_2_turns_by_the_angle_of_its_inner_wheel() -> None:
    driver, samples = hunter(Steering(0.65, 0.605))
    # the inner front wheel stands 0.65 m before an axle on which it turns about the same point
    radius = 0.65 / math.tan(0.3) + 0.605 / 2
    assert [s.angular_radps for s in samples] == pytest.approx([1 / radius] * 474)
    assert driver.fault() is None


def test_to_the_right_it_turns_as_much() -> None:
    steering = Steering(0.65, 0.605)
    assert steering.yaw_rate(1.0, -0.3) == -steering.yaw_rate(1.0, 0.3)
    assert steering.yaw_rate(-1.0, 0.3) == -steering.yaw_rate(1.0, 0.3)


def test_a_hunter_2_without_a_wheelbase_is_refused_in_a_sentence() -> None:
    driver, samples = hunter(None)
    assert samples == []
    assert driver.tally.refused[WheelRefusal.NO_ODOMETRY] == 474
    said = driver.fault()
    assert said is not None
    assert "wheels.wheelbase_m" in said


@pytest.mark.parametrize(("steering", "refused"), [(3, False), (4, True)])
def test_an_angle_too_small_to_show_as_a_turn_is_no_reason(steering: int, refused: bool) -> None:
    driver = AgilexDriver()
    driver.on_frame(full(T0, 1000, 0, 0, steering))
    samples = driver.on_frame(full(T0 + SECOND_US, 1000, 0, 0, steering))
    assert len(samples) == (not refused)


def test_a_base_that_says_how_it_turns_may_steer_too() -> None:
    driver = AgilexDriver()
    driver.on_frame(full(T0, 1000, 300, 0, 300))
    assert driver.on_frame(full(T0 + SECOND_US, 1000, 300, 0, 300)) == [
        Twist(T0 + SECOND_US, 1.0, 0.3)
    ]


@pytest.mark.parametrize("mode", [1, 2, 3, 4])
def test_a_ranger_in_another_mode_is_refused_and_begins_anew_after_it(mode: int) -> None:
    wheels = WheelInput(AgilexSection(source="agilex", track_m=0.4))
    frames = [odometry(T0 + k * 20 * MS, 10 * k, 10 * k) for k in range(10)]
    frames.append(agilex(0x291, bytes([mode, 0]), T0 + 200 * MS))
    frames += [odometry(T0 + k * 20 * MS, 10 * k, 10 * k) for k in range(11, 20)]
    motions = [m for frame in frames for m in wheels.on_frame(frame)]
    said = wheels.advice(T0 + 400 * MS)
    assert said is not None
    assert f"motion mode {mode}" in said
    frames = [agilex(0x291, bytes([0, 0]), T0 + 400 * MS)]
    frames += [odometry(T0 + k * 20 * MS, 10 * k, 10 * k) for k in range(21, 30)]
    motions += [m for frame in frames for m in wheels.on_frame(frame)]
    assert sum(m.distance_m for m in motions) == pytest.approx(0.09 + 0.08)
    assert [m.gap for m in motions].count(True) == 3


def test_a_change_of_the_mode_is_no_odometry() -> None:
    driver = AgilexDriver()
    driver.on_frame(agilex(0x291, bytes([0, 1])))
    assert driver.on_frame(odometry(T0 + MS, 1, 1)) == []
    driver.on_frame(agilex(0x291, bytes([0, 0]), T0 + 2 * MS))
    assert driver.on_frame(odometry(T0 + 3 * MS, 1, 1)) != []


@pytest.mark.parametrize(("sideways", "refused"), [(49, False), (50, True), (-50, True)])
def test_a_base_that_moves_sideways_is_refused_meanwhile(sideways: int, refused: bool) -> None:
    driver = AgilexDriver()
    driver.on_frame(odometry(T0, 0, 0))
    driver.on_frame(full(T0 + MS, 0, 0, sideways, 0))
    assert (driver.on_frame(odometry(T0 + 2 * MS, 1, 1)) == []) == refused
    assert (driver.fault() is not None) == refused
    driver.on_frame(full(T0 + 502 * MS, 0, 0, 0, 0))
    assert driver.on_frame(odometry(T0 + 503 * MS, 1, 1)) != []


def test_a_state_without_odometry_has_its_own_sentence() -> None:
    driver = AgilexDriver()
    assert driver.why_no_sample(T0) is None
    driver.on_frame(agilex(0x211, bytes(8)))
    said = driver.why_no_sample(T0 + MS)
    assert said is not None
    assert "neither 0x311 nor 0x221" in said


def axes(can_id: int, *values: int, utime: int = T0) -> CanFrame:
    return agilex(can_id, struct.pack(">3h", *values), utime)


def test_the_yaw_of_a_limo_is_the_first_of_its_angles() -> None:
    assert AgilexDriver().on_frame(axes(0x323, -17_999, 12, 34)) == [
        GyroAngle(T0, math.radians(-179.99))
    ]


@pytest.mark.parametrize(("after", "used"), [(SECOND_US, False), (SECOND_US + MS, True)])
def test_its_turning_rate_is_the_last_and_counts_while_angles_are_missing(
    after: int, used: bool
) -> None:
    driver = AgilexDriver()
    assert driver.on_frame(axes(0x322, 1, 2, 1234)) == [GyroRate(T0, math.radians(12.34))]
    driver.on_frame(axes(0x323, 0, 0, 0))
    rate = GyroRate(T0 + after, math.radians(-12.34))
    assert driver.on_frame(axes(0x322, 0, 0, -1234, utime=T0 + after)) == ([rate] if used else [])


@pytest.mark.parametrize("can_id", [0x322, 0x323])
def test_a_frame_of_the_gyro_that_is_short_is_counted(can_id: int) -> None:
    driver = AgilexDriver()
    assert driver.on_frame(agilex(can_id, bytes(5))) == []
    assert driver.tally.refused[WheelRefusal.SHORT] == 1
