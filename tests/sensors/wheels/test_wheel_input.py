"""The wheel sensor as the robot uses it: from a section of the configuration to motions."""

from __future__ import annotations

import math
import random
import struct
import time
from typing import Any

import pytest
from frames import SECOND_US, ascii_line, kobuki_core, kobuki_packet
from machine_speed import allowed_s

from drslamd.config_wheels import (
    SOURCES,
    AgilexSection,
    AsciiSection,
    KobukiSection,
    OdriveSection,
    RoboteqSection,
)
from drslamd.events import CanFrame
from drslamd.sensors.samples import Motion
from drslamd.sensors.wheels import wheel_input
from drslamd.sensors.wheels.wheel_input import WheelInput

MS = 1000
T0 = 100 * SECOND_US


def kobuki(**keys: Any) -> WheelInput:
    return WheelInput(KobukiSection(source="kobuki", port="x", **keys))


def ascii_base(**keys: Any) -> WheelInput:
    section = {"source": "ascii", "port": "x", "track_m": 0.5, "counts_per_metre": 1000.0}
    return WheelInput(AsciiSection.model_validate({**section, **keys}))


def roboteq(**keys: Any) -> WheelInput:
    section = {"source": "roboteq", "port": "x", "track_m": 0.5, "counts_per_metre": 1000.0}
    return WheelInput(RoboteqSection.model_validate({**section, **keys}))


def agilex() -> WheelInput:
    return WheelInput(AgilexSection(source="agilex", track_m=0.5))


def odometry(utime: int, left: int, right: int) -> CanFrame:
    return CanFrame(utime, 0x311, False, struct.pack(">ii", left, right))


# every section


def test_there_is_a_driver_for_every_section_of_the_configuration() -> None:
    assert set(wheel_input.SOURCES) == set(SOURCES.values())


def test_kobuki_from_bytes_to_metres() -> None:
    wheels = kobuki()
    moved = []
    for k in range(5):
        packet = kobuki_packet(kobuki_core(65530 + 20 * k, 65500 + 117 * k, 65500 + 117 * k))
        moved += wheels.feed(packet, T0 + k * 20 * MS)
    assert moved[0] == Motion(T0, 0.0, 0.0, gap=True)
    assert [m.distance_m for m in moved[1:]] == pytest.approx([117 / 11_724.4] * 4)


def test_roboteq_from_polls_to_metres() -> None:
    wheels = roboteq(swap_channels=True, poll_hz=50.0, reverse_left=True)
    moved = []
    for k in range(3):
        assert wheels.poll(T0 + k * 20 * MS).endswith(b"?C\r")
        moved += wheels.feed(b"C=%d:%d\r" % (10 * k, -10 * k), T0 + k * 20 * MS + 3 * MS)
    assert [m.distance_m for m in moved] == pytest.approx([0.0, 0.01, 0.01])


def test_the_ascii_line_from_bytes_to_metres() -> None:
    wheels = ascii_base()
    lines = b"".join(ascii_line(1000 + 20 * k, 10 * k, 20 * k) for k in range(4))
    moved = wheels.feed(lines, T0)
    # all came at once: with one arrival there is one time, and no motion is lost
    moved += wheels.feed(ascii_line(1080, 40, 80), T0 + 20 * MS)
    assert sum(m.turn_rad for m in moved) == pytest.approx((80 - 40) / 1000 / 0.5)


def test_odrive_from_frames_to_metres_by_gear_and_radius() -> None:
    wheels = WheelInput(
        OdriveSection(
            source="odrive", track_m=0.5, left_axis=0, right_axis=1, wheel_radius_m=0.1, gear=10.0
        )
    )
    moved = []
    for k in range(4):
        for axis in (1, 0):
            data = struct.pack("<ff", 0.5 * k, 0.0)
            moved += wheels.on_frame(CanFrame(T0 + k * 10 * MS, axis << 5 | 9, False, data))
    distance = 0.5 / 10 * 2 * math.pi * 0.1
    assert [m.distance_m for m in moved] == pytest.approx([0.0, distance, distance])


def test_agilex_from_frames_to_metres() -> None:
    wheels = agilex()
    moved = wheels.on_frame(odometry(T0, 22_059, 25_650))
    moved += wheels.on_frame(odometry(T0 + 20 * MS, 22_069, 25_640))
    assert (moved[1].utime, moved[1].gap) == (T0 + 20 * MS, False)
    assert (moved[1].distance_m, moved[1].turn_rad) == pytest.approx((0.0, -0.04))


def test_a_power_cycle_of_the_base_is_a_gap() -> None:
    wheels = agilex()
    wheels.on_frame(odometry(T0, 50_000, 50_000))
    (motion,) = wheels.on_frame(odometry(T0 + 3 * SECOND_US, 0, 0))
    assert motion.gap


# the wrong kind of input is a mistake of the programmer


def test_a_serial_base_reads_no_can_frames() -> None:
    with pytest.raises(TypeError, match="KobukiDriver reads bytes"):
        kobuki().on_frame(odometry(T0, 0, 0))


def test_a_can_base_reads_no_bytes_and_asks_nothing() -> None:
    with pytest.raises(TypeError, match="AgilexDriver reads CAN frames"):
        agilex().feed(b"x", T0)
    assert agilex().poll(T0) == b""
    assert kobuki().poll(T0) == b""


# advice and counters


def driving(until_ms: int = 1000) -> WheelInput:
    wheels = ascii_base()
    for k in range(0, until_ms + 1, 20):
        wheels.feed(ascii_line(1000 + k, k, k), T0 + k * MS)
    return wheels


def test_a_base_that_drives_needs_no_advice() -> None:
    wheels = driving()
    assert wheels.advice(T0 + SECOND_US) is None
    assert wheels.last_motion_utime == T0 + SECOND_US


def test_before_anything_came_the_power_is_suspected() -> None:
    assert "nothing from the wheels yet" in str(kobuki().advice(T0))


@pytest.mark.parametrize(("after_ms", "told"), [(2000, False), (2001, True)])
def test_silence_is_told(after_ms: int, told: bool) -> None:
    advice = driving().advice(T0 + after_ms * MS)
    expected = "nothing from the wheels for 1 s: check the power of the base and the cable"
    assert advice == (expected if told else None)


@pytest.mark.parametrize(("after_s", "told"), [(4.9, False), (5.0, True)])
def test_bytes_without_samples_lead_to_the_baud_rate(after_s: float, told: bool) -> None:
    wheels = kobuki()
    for k in range(51):
        wheels.feed(b"\x00\x80" * 10, T0 + k * 100 * MS)
    advice = wheels.advice(T0 + round(after_s * SECOND_US))
    assert (advice is not None) == told
    assert not told or advice == (
        "input, but no Kobuki packets (AA 55 ...) for 5 s: are wheels.source and wheels.baud right?"
    )


def test_other_can_frames_lead_to_the_bus() -> None:
    wheels = agilex()
    for k in range(60):
        wheels.on_frame(CanFrame(T0 + k * 100 * MS, 0x7FF, False, b""))
    assert "CAN id 0x311 (or 0x221) for 5 s: is this the bus" in str(
        wheels.advice(T0 + 59 * 100 * MS)
    )


def test_odometry_that_stops_on_a_busy_bus_leads_to_the_bus() -> None:
    wheels = agilex()
    for k in range(120):
        utime = T0 + k * 100 * MS
        wheels.on_frame(odometry(utime, k, k) if k < 60 else CanFrame(utime, 0x7FF, False, b""))
    assert "no AgileX CAN id 0x311 (or 0x221) for 6 s" in str(wheels.advice(utime))


def test_counters_that_are_always_too_fast_lead_to_the_scale() -> None:
    wheels = ascii_base(counts_per_metre=1.0)
    for k in range(300):
        wheels.feed(ascii_line(1000 + 20 * k, 100 * k, 100 * k), T0 + k * 20 * MS)
    advice = str(wheels.advice(T0 + 299 * 20 * MS))
    assert "max_speed_mps" in advice
    assert "counts_per_metre" in advice


def test_speeds_that_come_too_rarely_lead_to_the_rate() -> None:
    wheels = agilex()
    for k in range(12):
        data = struct.pack(">hh", 500, 0)
        wheels.on_frame(CanFrame(T0 + k * 600 * MS, 0x221, False, data))
    assert "too rarely" in str(wheels.advice(T0 + 11 * 600 * MS))


def test_what_the_base_reports_is_passed_on() -> None:
    wheels = agilex()
    wheels.on_frame(CanFrame(T0, 0x211, False, bytes([2, 0, 1, 0, 0, 4, 0, 0])))
    assert "the base reports a fault" in str(wheels.advice(T0))


def test_counters_have_flat_names() -> None:
    wheels = driving(60)
    wheels.feed(b"hello\r\n", T0 + 60 * MS)
    assert wheels.counters() == {
        "messages.accepted": 4,
        "messages.ignored": 1,
        "messages.unpaired": 0,
        "samples.accepted": 4,
        "samples.ignored": 0,
        "gaps.START": 1,
    }


# input that is no usable odometry


def odrive_section() -> OdriveSection:
    return OdriveSection(
        source="odrive", track_m=0.5, left_axis=0, right_axis=1, wheel_radius_m=0.1
    )


def said_after_six_seconds(wheels: WheelInput, *frames: tuple[int, bytes]) -> str:
    for k in range(60):
        for can_id, data in frames:
            wheels.on_frame(CanFrame(T0 + k * 100 * MS, can_id, False, data))
    return wheels.advice(T0 + 6 * SECOND_US) or ""


@pytest.mark.parametrize(
    ("frames", "sentence"),
    [
        ([(0x001, bytes(8)), (0x021, bytes(8))], "heartbeats but no encoder estimates"),
        ([(0x009, struct.pack("<ff", math.nan, 0.0))], "are no numbers"),
        ([(0x009, bytes(4)), (0x029, bytes(4))], "the frames are too short"),
        ([(0x7FF, bytes(8))], "is this the bus of the base?"),
    ],
)
def test_what_an_odrive_sends_without_odometry_has_its_own_sentence(
    frames: list[tuple[int, bytes]], sentence: str
) -> None:
    assert sentence in said_after_six_seconds(WheelInput(odrive_section()), *frames)


def test_an_odrive_at_50_ms_with_axes_11_ms_apart_moves() -> None:
    wheels = WheelInput(odrive_section())
    motions: list[Motion] = []
    for k in range(200):  # one turn a second, for ten seconds
        for axis, apart in ((0, 0), (1, 11)):
            ms = 50 * k + apart
            data = struct.pack("<ff", ms / 1000, 1.0)
            motions += wheels.on_frame(CanFrame(T0 + ms * MS, axis << 5 | 9, False, data))
    path = sum(m.distance_m for m in motions)
    assert path == pytest.approx(9.9 * 2 * math.pi * 0.1, abs=0.04)
    assert abs(sum(m.turn_rad for m in motions)) < 1e-3
    assert wheels.advice(T0 + 10 * SECOND_US) is None


@pytest.mark.parametrize(
    ("packet", "sentence"),
    [
        (kobuki_packet(kobuki_core(1, 2, 3))[:-1] + b"\x00", "wrong checksums"),
        (kobuki_packet(b"\x01\x03abc"), "not of the form of the protocol"),
        (b"something else\r\n", "are wheels.source and wheels.baud right?"),
    ],
)
def test_what_a_kobuki_sends_without_odometry_has_its_own_sentence(
    packet: bytes, sentence: str
) -> None:
    wheels = kobuki()
    for k in range(300):
        wheels.feed(packet, T0 + k * 20 * MS)
    assert sentence in (wheels.advice(T0 + 6 * SECOND_US) or "")


def test_a_roboteq_that_refuses_has_its_own_sentence() -> None:
    wheels = roboteq()
    for k in range(300):
        wheels.feed(b"-\r", T0 + k * 20 * MS)
    assert "refuses the query ?C" in (wheels.advice(T0 + 6 * SECOND_US) or "")


@pytest.mark.row("D9")
def test_a_full_bus_costs_less_than_a_third_of_a_core_and_no_odometry() -> None:
    """8,000 frames a second, 50 of them odometry."""
    wheels, draw = WheelInput(AgilexSection(source="agilex", track_m=0.5)), random.Random(1)
    frames = []
    for k in range(8_000):
        utime, can_id, data = k * 125, draw.randrange(0x400, 0x800), draw.randbytes(8)
        if k % 160 == 0:
            can_id, data = 0x311, (k // 16).to_bytes(4, "big") * 2
        frames.append(CanFrame(utime, can_id, False, data))
    began, motions = time.process_time(), 0
    for frame in frames:
        motions += len(wheels.on_frame(frame))
    took = time.process_time() - began
    assert took < allowed_s(1 / 3)
    assert motions == 8_000 // 160
