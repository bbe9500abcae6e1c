"""The shared wire-format vectors, captured from devices or made elsewhere: a second opinion.

They are not part of the project; where they are absent these tests are skipped.
"""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any

import pytest
from frames import SECOND_US, cut

from drslamd.config_wheels import DbcSection
from drslamd.events import CanFrame
from drslamd.sensors.frame_scanner import FrameScanner
from drslamd.sensors.linktrack.codec import LINKTRACK, Frame, Refusal, decode
from drslamd.sensors.linktrack.linktrack_frames import ModuleFault
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput
from drslamd.sensors.samples import GyroAngle, GyroRate, Twist, WheelCounts, WheelSpeeds, WheelTurns
from drslamd.sensors.wheels.agilex import AgilexDriver
from drslamd.sensors.wheels.ascii_odometry import AsciiDriver
from drslamd.sensors.wheels.dbc import DbcDriver
from drslamd.sensors.wheels.kobuki import KobukiDriver
from drslamd.sensors.wheels.odrive import OdriveDriver
from drslamd.sensors.wheels.roboteq import RoboteqDriver
from drslamd.sensors.wheels.wheeltec import GYRO_RADPS, WheeltecDriver

MS = 1000
T0 = 100 * SECOND_US

about: Any = pytest.approx  # it stands for a number, whatever its type says

NOT_FROM_A_MODULE = {"linktrack/user_frame1", "linktrack/iot_frame0"}
"""What a host sends to a MASTER, and another product."""

OUR_NAMES = {
    "pos_m": "position_m",
    "vel_mps": "velocity_mps",
    "dis_m": "distance_m",
    "acc_mps2": "acceleration_mps2",
    "angle_deg": "euler_deg",
    "quat_wxyz": "quaternion_wxyz",
    "voltage_V": "voltage_v",
    "fp_rssi_dB": "fp_rssi_db",
    "rx_rssi_dB": "rx_rssi_db",
    "node_system_time_ms": "system_time_ms",
    "uart_baudrate": "baud",
    "tx_gain_dB": "tx_gain_db",
}


def load(vectors: Path, name: str) -> list[dict[str, Any]]:
    entries: list[dict[str, Any]] = json.loads((vectors / name).read_text())
    assert entries
    return entries


def matches(ours: Any, theirs: Any, name: str = "") -> bool:
    """Are both values the same, up to the six digits that the vectors give?"""
    if name == "error_bits":
        return ModuleFault(ours) == ModuleFault.DUPLICATE_ID and theirs == ["node_repeat"]
    if isinstance(theirs, dict):
        return all(
            matches(ours[our_name(key, theirs)], value, key)
            for key, value in theirs.items()
            if key not in ("frame", "count")
        )
    if isinstance(theirs, list):
        if theirs and isinstance(theirs[0], list):  # positions of anchors, flat in ours
            theirs = [coordinate for position in theirs for coordinate in position]
        return len(ours) == len(theirs) and all(map(matches, ours, theirs))
    if isinstance(ours, bytes):
        return ours == bytes.fromhex(theirs)
    if isinstance(theirs, str) and name in ("", "id"):
        return bool(ours == int(theirs, 16))
    if isinstance(theirs, float):
        return math.isclose(ours, theirs, abs_tol=2e-6)
    return bool(ours == theirs)


def our_name(key: str, entry: dict[str, Any]) -> str:
    is_bearing = key == "angle_deg" and not isinstance(entry[key], list)
    return key if is_bearing else OUR_NAMES.get(key, key)


@pytest.mark.parametrize("name", ["linktrack.json", "linktrack_synthetic.json"])
def test_every_linktrack_vector_is_decoded_to_its_values(vectors: Path, name: str) -> None:
    for vector in load(vectors, name):
        frame = decode(bytes.fromhex(vector["hex"]))
        if vector["decoded"] is None or vector["protocol"] in NOT_FROM_A_MODULE:
            assert isinstance(frame, Refusal), vector["id"]
        else:
            assert isinstance(frame, Frame), vector["id"]
            assert frame.kind.name.lower() == vector["decoded"]["frame"]
            assert matches(frame.values, vector["decoded"]), vector["id"]


def test_every_linktrack_stream_is_cut_as_expected(vectors: Path) -> None:
    for vector in load(vectors, "linktrack_streams.json"):
        stream = bytes.fromhex(vector["hex"])
        expected = [
            stream[found["offset"] : found["offset"] + found["length"]]
            for found in vector["expected"]
        ]
        ways = [[stream], [stream[i : i + 1] for i in range(len(stream))]]
        ways += [list(cut(stream, seed)) for seed in range(20)]
        for reads in ways:
            scanner = FrameScanner(LINKTRACK)
            frames = [frame for read in reads for frame in scanner.feed(read, 0)]
            assert frames == expected, vector["id"]
            assert scanner.pending_bytes == vector["pending_tail"], vector["id"]


def test_three_captured_frames_give_two_ranges(vectors: Path) -> None:
    captured = {v["id"]: bytes.fromhex(v["hex"]) for v in load(vectors, "linktrack.json")}
    uwb, samples = LinkTrackInput(1, 120.0), []
    for k, letter in enumerate("abc"):
        samples += uwb.feed(captured[f"lt_dr_frame3_field_{letter}"], T0 + k * 20 * MS)
    assert [(s.utime - T0, s.peer_uwb_id, s.range_m) for s in samples] == [
        (20 * MS, 0, 0.641),
        (40 * MS, 0, 0.647),
    ]
    assert [s.power_gap_db for s in samples] == [4.0, 4.0]


def test_captured_kobuki_packets_give_their_counters_and_their_heading(vectors: Path) -> None:
    packets = {v["id"]: v for v in load(vectors, "kobuki.json")}
    driver, samples = KobukiDriver(), []
    for k, letter in enumerate("abc"):
        packet = packets[f"kobuki_{letter}"]
        data = bytes.fromhex(packet["hex"] + packet["trailing_hex"])
        samples += driver.feed(data, T0 + k * 20 * MS)
    # (the base holds its heading in hundredths of a degree)
    first = bytes.fromhex(packets["kobuki_a"]["hex"])
    left, right = (int.from_bytes(first[at : at + 2], "little") for at in (10, 12))
    assert [type(sample) for sample in samples[:2]] == [GyroAngle, WheelCounts]
    assert samples[1] == WheelCounts(T0, left, right, 16)
    assert samples[2:] == [
        GyroAngle(T0 + 20 * MS, about(math.radians(74.85))),
        WheelCounts(T0 + 20 * MS, 11252, 18272, 16),
        GyroAngle(T0 + 40 * MS, about(math.radians(74.86))),
        WheelCounts(T0 + 40 * MS, 11260, 18279, 16),
    ]
    wrap = KobukiDriver()
    assert wrap.feed(bytes.fromhex(packets["kobuki_wrap_1"]["hex"]), T0) == []
    after = wrap.feed(bytes.fromhex(packets["kobuki_wrap_2"]["hex"]), T0 + 20 * MS)
    assert after[-1] == WheelCounts(T0 + 20 * MS, 5, 65535, 16)


def test_frames_of_a_wheeltec_give_their_speeds_and_their_gyro(vectors: Path) -> None:
    for vector in load(vectors, "wheeltec.json"):
        driver, said = WheeltecDriver(), vector["decoded"]
        samples = driver.feed(bytes.fromhex(vector["hex"]), T0)
        if vector["protocol"] != "wheeltec-rx":
            assert samples == []  # what a host says to a base
            continue
        turn = GYRO_RADPS * said["gyro_raw"][2]
        assert samples == [
            GyroRate(T0, about(turn)),
            Twist(T0, about(said["vx_mps"]), about(said["wz_radps"])),
        ]
        assert driver.is_stopped == said["stop"]


def can_frame(vector: dict[str, Any], utime: int = T0) -> CanFrame:
    data = bytes.fromhex(vector["hex"])
    return CanFrame(utime, vector["can_id"], vector["extended"], data)


def test_agilex_frames_give_their_paths_and_speeds(vectors: Path) -> None:
    for vector in load(vectors, "can_frames.json"):
        if vector["protocol"] != "agilex-v2":
            continue
        driver, decoded = AgilexDriver(), vector["decoded"]
        driver.on_frame(CanFrame(T0 - SECOND_US, 0, False, b""))  # odometry had its time to come
        samples = driver.on_frame(can_frame(vector))
        if vector["can_id"] == 0x311:
            left, right = (round(decoded[side] * 1000) for side in ("left_m", "right_m"))
            assert samples == [WheelCounts(T0, left, right, 32)]
        elif vector["can_id"] == 0x221:
            assert samples == [Twist(T0, decoded["linear_mps"], decoded["angular_radps"])]
        else:
            assert samples == []
        if vector["can_id"] == 0x211:
            state = (decoded["vehicle_state"], decoded["error_bits"])
            assert (driver.vehicle_state, driver.error_bits) == state
        assert driver.tally.refused.total() == 0


def test_odrive_estimates_give_their_turns(vectors: Path) -> None:
    for vector in load(vectors, "can_frames.json"):
        if vector["id"].startswith("odrive_est"):
            axis = vector["can_id"] >> 5
            driver = OdriveDriver(40, axis)
            left = struct.pack("<ff", 1.0, 0.0)
            driver.on_frame(CanFrame(T0, 40 << 5 | 9, False, left))
            (sample,) = driver.on_frame(can_frame(vector))
            assert sample == WheelTurns(T0, 1.0, vector["decoded"]["pos_rev"])


def test_lines_are_read_as_stated(vectors: Path) -> None:
    for vector in load(vectors, "ascii_lines.json"):
        data = bytes.fromhex(vector["hex"])
        roboteq = RoboteqDriver(25.0, False).feed(data, T0)
        expected = vector["decoded"].get("values") if vector["decoded"].get("key") == "C" else None
        assert roboteq == ([WheelCounts(T0, expected[0], expected[1], 32)] if expected else [])
        driver, uwb = AsciiDriver(), LinkTrackInput(1, 120.0)
        driver.feed(data, T0)
        is_odo = vector["id"] == "odo_nmea_style"
        assert driver.tally.accepted == is_odo
        uwb.feed(data, T0)
        assert (uwb.wrong_mode == "NMEA sentences") == vector["id"].startswith("nmea")


def dbc_driver(text: str, **keys: Any) -> DbcDriver:
    section = {"source": "dbc", "track_m": 0.5, "dbc_file": "x", "measures": "counts"}
    return DbcDriver(DbcSection.model_validate({**section, **keys}), text)


def dbc_drivers(vectors: Path) -> dict[str, DbcDriver]:
    """A driver for the DBC file of each protocol, both sides in one frame where there is one."""
    pytest.importorskip("cantools")
    agilex, odrive, vesc = (
        (vectors / f"{name}.dbc").read_text()
        for name in ("agilex_v2_min", "odrive_min", "vesc_min")
    )
    rate = "EncoderEstimates.Vel_Estimate"
    erpm = "Status1.Erpm"
    return {
        "agilex": dbc_driver(
            agilex, left="Odometry.Left", right="Odometry.Right", counts_per_metre=1000.0
        ),
        "odrive": dbc_driver(
            odrive,
            measures="wheel_speeds",
            left=rate,
            right=rate,
            id_mask=0x1F,
            left_node=40,
            right_node=1,
            unit=1.0,
        ),
        "vesc": dbc_driver(
            vesc,
            measures="wheel_speeds",
            left=erpm,
            right=erpm,
            id_mask=0x1FFFFF00,
            left_node=40,
            right_node=5,
            unit=0.001,
        ),
    }


def test_the_shared_dbc_files_are_usable(vectors: Path) -> None:
    drivers = dbc_drivers(vectors)
    frames = {v["id"]: can_frame(v) for v in load(vectors, "can_frames.json")}
    assert drivers["agilex"].on_frame(frames["agx_synth_neg"]) == [
        WheelCounts(T0, -12345, 67890, 32)
    ]
    left = CanFrame(T0, 40 << 5 | 9, False, struct.pack("<ff", 0.0, 3.0))
    assert drivers["odrive"].on_frame(left) == []
    assert drivers["odrive"].on_frame(frames["odrive_est_n1"]) == [WheelSpeeds(T0, 3.0, -0.25)]
    left = CanFrame(T0, 0x928, True, struct.pack(">i4x", 2000))
    assert drivers["vesc"].on_frame(left) == []
    assert drivers["vesc"].on_frame(frames["vesc_status1_5_neg"]) == [WheelSpeeds(T0, 2.0, -3.0)]
