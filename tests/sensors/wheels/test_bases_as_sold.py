"""What bases and their files were found to send, byte by byte, with the way that they drove."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable

import pytest

from drslamd.config_wheels import AgilexSection, DbcSection, OdriveSection, RoboteqSection
from drslamd.events import CanFrame
from drslamd.sensors.wheels.dbc_file import decoded
from drslamd.sensors.wheels.wheel_input import WheelInput

MS = 1_000
HEAD = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: BASE PC\n\n'
WHEELS = (
    "BO_ 528 WHEELS: 8 BASE\n"
    ' SG_ LEFT : 0|32@1- (1,0) [0|0] "tick" PC\n SG_ RIGHT : 32|32@1- (1,0) [0|0] "tick" PC\n\n'
)
DEGREES = 'BO_ 529 TEMPS: 8 BASE\n SG_ T : 0|16@1- (0.1,0) [-40|150] "\u00b0C" PC\n'
OVERLAP = (
    "BO_ 530 STATUS: 8 BASE\n"
    ' SG_ FLAGS : 0|8@1+ (1,0) [0|255] "" PC\n SG_ FAULT : 0|4@1+ (1,0) [0|15] "" PC\n'
)
PAGES = (
    'BO_ 640 FEEDBACK: 8 BASE\n SG_ INDEX M : 0|8@1+ (1,0) [0|3] "" PC\n'
    ' SG_ LEFT m0 : 8|32@1- (1,0) [0|0] "" PC\n SG_ RIGHT m1 : 8|32@1- (1,0) [0|0] "" PC\n'
)
NODES = (
    'BO_ 1 NODE_L: 8 BASE\n SG_ COUNT : 0|32@1- (1,0) [0|0] "" PC\n'
    'BO_ 2 NODE_R: 8 BASE\n SG_ COUNT : 0|32@1- (1,0) [0|0] "" PC\n'
)


def driven(wheels: WheelInput, frames: Iterable[tuple[int, int, bytes]]) -> tuple[float, float]:
    """Way and turn, m and rad, by frames: time in ms, id, data."""
    way = turn = 0.0
    for ms, can_id, data in frames:
        for motion in wheels.on_frame(CanFrame(ms * MS, can_id, False, data)):
            way, turn = way + motion.distance_m, turn + motion.turn_rad
    return way, turn


def by_file(text: bytes, left: str, right: str) -> WheelInput:
    """1,000 counts a metre."""
    section = DbcSection(
        source="dbc", track_m=0.5, dbc_file="x.dbc", measures="counts", counts_per_metre=1000.0,
        left=left, right=right,
    )  # fmt: skip
    return WheelInput(section, decoded(text))


@pytest.mark.parametrize("rest", [DEGREES, OVERLAP], ids=["cp1252", "overlap"])
def test_a_file_as_tools_write_them(rest: str) -> None:
    wheels = by_file((HEAD + WHEELS + rest).encode("cp1252"), "WHEELS.LEFT", "WHEELS.RIGHT")
    frames = [(50 * k, 528, struct.pack("<ii", 50 * k, 60 * k)) for k in range(201)]
    assert driven(wheels, frames) == pytest.approx((11.0, 4.0))


def test_two_sides_on_two_pages_of_one_id() -> None:
    wheels = by_file((HEAD + PAGES).encode(), "FEEDBACK.LEFT", "FEEDBACK.RIGHT")
    frames = [(25 * k, 640, struct.pack("<Bi3x", k % 2, 25 * k)) for k in range(401)]
    way, turn = driven(wheels, frames)
    assert way == pytest.approx(10.0, abs=0.11)
    assert turn == 0.0


def test_two_nodes_with_counters_every_100_ms_50_ms_apart() -> None:
    wheels = by_file((HEAD + NODES).encode(), "NODE_L.COUNT", "NODE_R.COUNT")
    frames = [(50 * k, 1 + k % 2, struct.pack("<i4x", 50 * k)) for k in range(201)]
    way, turn = driven(wheels, frames)
    assert way == pytest.approx(10.0, abs=0.21)
    assert turn == 0.0
    assert wheels.advice(10_000 * MS) is None


HUNTER = [(20 * k, 0x221, bytes.fromhex("03E800000000012C")) for k in range(501)]
"""Ten seconds at 1 m/s, its inner wheel at 0.3 rad."""


def test_a_hunter_2_steers() -> None:
    wheels = WheelInput(AgilexSection(source="agilex", track_m=0.6, wheelbase_m=0.65))
    way, turn = driven(wheels, HUNTER)
    radius = 0.65 / math.tan(0.3) + 0.3
    assert way == pytest.approx(9.5, abs=0.05)
    assert turn == pytest.approx(way / radius)
    unknown = WheelInput(AgilexSection(source="agilex", track_m=0.6))
    assert driven(unknown, HUNTER) == (0.0, 0.0)
    assert "set wheels.wheelbase_m" in str(unknown.advice(10_000 * MS))


def odrive() -> WheelInput:
    return WheelInput(
        OdriveSection(source="odrive", left_axis=0, right_axis=1, track_m=0.5, wheel_radius_m=0.1)
    )


def test_an_odrive_with_estimates_every_50_ms_11_ms_apart() -> None:
    frames = [
        (50 * k + 11 * axis, axis << 5 | 9, struct.pack("<ff", 0.05 * k, 1.0))
        for k in range(201)
        for axis in (0, 1)
    ]
    wheels = odrive()
    way, turn = driven(wheels, frames)
    assert way == pytest.approx(10 * 0.2 * math.pi, abs=0.05)
    # the right axis was read 11 ms later, as if it had been ahead by so much all the time
    assert abs(turn) < 0.011 * 0.2 * math.pi / 0.5
    assert wheels.advice(10_011 * MS) is None


def test_an_odrive_that_sends_heartbeats_only() -> None:
    wheels = odrive()
    frames = [(100 * k, axis << 5 | 1, bytes(8)) for k in range(100) for axis in (0, 1)]
    assert driven(wheels, frames) == (0.0, 0.0)
    said = str(wheels.advice(9_900 * MS))
    assert said.startswith("ODrive axes 0 and 1: heartbeats but no encoder estimates")


def test_a_roboteq_with_hall_sensors_only() -> None:
    section = RoboteqSection(source="roboteq", port="/p", track_m=0.5, counts_per_metre=1000.0)
    wheels, asked = WheelInput(section), b""
    for k in range(300):
        asked += wheels.poll(40 * k * MS)
        wheels.feed(b"C=0:0\r", 40 * k * MS)
    assert 'with hall counters alone set wheels.counter = "hall"' in str(wheels.advice(11_960 * MS))
    assert b"?CB\r" in asked
    wheels.feed(b"CB=120:118\r", 12_000 * MS)
    assert "while its hall counters count" in str(wheels.advice(12_000 * MS))
