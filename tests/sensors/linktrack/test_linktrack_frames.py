"""The tables of the protocol sheet: what each kind of LinkTrack frame says."""

from __future__ import annotations

from typing import Any

import pytest
from frames import ONE_OF_EACH, Peer, i24, node_frame3
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.linktrack.codec import Frame, decode
from drslamd.sensors.linktrack.linktrack_frames import LAYOUTS, Kind, ModuleFault


def values(frame: bytes) -> dict[str, Any]:
    decoded = decode(frame)
    assert isinstance(decoded, Frame)
    return dict(decoded.values)


def test_there_is_a_frame_and_a_table_for_every_kind() -> None:
    assert set(LAYOUTS) == set(Kind)
    assert set(ONE_OF_EACH) == {kind.name for kind in Kind}


def test_node_frame3() -> None:
    assert values(ONE_OF_EACH["NODE_FRAME3"]) == {
        "role": 0,
        "id": 5,
        "local_time_ms": 1000,
        "system_time_ms": 1017,
        "voltage_v": 4.939,
        "nodes": (
            {"role": 1, "id": 0, "distance_m": 2.85, "fp_rssi_db": -90.5, "rx_rssi_db": -79.5},
            {"role": 200, "id": 3, "distance_m": -0.001, "fp_rssi_db": -81.5, "rx_rssi_db": -77.5},
        ),
    }


def test_a_node_frame3_without_an_entry_is_a_heartbeat() -> None:
    frame = node_frame3(5, [])
    assert len(frame) == 22
    assert values(frame)["nodes"] == ()


def test_node_frame2_keeps_its_two_clocks_apart() -> None:
    read = values(ONE_OF_EACH["NODE_FRAME2"])
    assert (read["system_time_ms"], read["local_time_ms"]) == (1017, 1000)
    assert (read["role"], read["id"], read["voltage_v"]) == (0, 5, 4.939)
    assert read["eop_m"] == (0.11, 0.22, 2.55)
    assert read["position_m"] == (2.0, -0.091, 1.0)
    assert read["velocity_mps"] == (0.0015, -0.0006, 0.0)
    assert read["gyro_radps"] == (0.25, -0.5, 1.5)
    assert read["acceleration_mps2"] == (9.75, 0.125, -2.0)
    assert read["euler_deg"] == (144.49, -14.68, 0.01)
    assert read["quaternion_wxyz"] == (0.5, -0.5, 0.5, 0.5)
    assert read["nodes"][1] == {
        "role": 200,
        "id": 3,
        "distance_m": -0.001,
        "fp_rssi_db": -81.5,
        "rx_rssi_db": -77.5,
        "system_time_ms": 77,
    }


def test_node_frame5_has_long_ids() -> None:
    read = values(ONE_OF_EACH["NODE_FRAME5"])
    assert (read["id"], read["local_time_ms"], read["system_time_ms"]) == (0xBE23BE6B, 1000, 0)
    assert read["voltage_v"] == 3.965
    assert read["nodes"] == (
        {"role": 7, "id": 0xBEF2BE32, "distance_m": 0.3, "fp_rssi_db": -90.0, "rx_rssi_db": -88.0},
    )


def test_user_data_keeps_its_senders_apart_even_when_one_is_empty() -> None:
    assert values(ONE_OF_EACH["NODE_FRAME0"])["nodes"] == (
        {"role": 0, "id": 0, "data": b""},
        {"role": 0, "id": 2, "data": b"hi"},
    )
    read = values(ONE_OF_EACH["NODE_FRAME6"])
    assert read == {
        "role": 0,
        "id": 0xBE23BE6B,
        "nodes": ({"role": 0, "id": 0xBEF8BE1E, "data": b"\x11\x22"},),
    }


def test_node_frame1() -> None:
    assert values(ONE_OF_EACH["NODE_FRAME1"]) == {
        "role": 3,
        "id": 0,
        "system_time_ms": 33000,
        "local_time_ms": 34304,
        "voltage_v": 4.936,
        "nodes": ({"role": 2, "id": 0, "position_m": (2.911, 2.438, -0.101)},),
    }


def test_node_frame4_has_entries_inside_entries() -> None:
    read = values(ONE_OF_EACH["NODE_FRAME4"])
    assert (read["local_time_ms"], read["system_time_ms"]) == (105870, 105871)
    assert read["tags"] == (
        {
            "id": 2,
            "voltage_v": 4.4,
            "anchors": ({"id": 0, "distance_m": 2.445}, {"id": 1, "distance_m": 1.748}),
        },
        {"id": 5, "voltage_v": 4.4, "anchors": ()},
    )


def test_aoa_node_frame0() -> None:
    (node,) = values(ONE_OF_EACH["AOA_NODE_FRAME0"])["nodes"]
    assert (node["id"], node["distance_m"], node["angle_deg"]) == (3, 1.416, -49.67)
    assert (node["fp_rssi_db"], node["rx_rssi_db"]) == (-81.5, -79.5)


def test_tag_frame0() -> None:
    read = values(ONE_OF_EACH["TAG_FRAME0"])
    assert read["distance_m"] == (3.125, 5.539, 6.861, 4.684, 0.0, 0.0, 0.0, 0.0)
    assert read["velocity_mps"] == (-0.0038, -0.0006, 0.0)
    assert (read["local_time_ms"], read["system_time_ms"]) == (44556, 71627)
    assert (read["eop_m"], read["voltage_v"]) == ((0.11, 0.16, 2.55), 4.948)
    assert (read["gyro_radps"], read["euler_deg"][0]) == ((0.25, 0.5, -0.5), 144.49)


def test_anchor_frame0_leaves_empty_slots_out() -> None:
    read = values(ONE_OF_EACH["ANCHOR_FRAME0"])
    assert (read["role"], read["id"], read["voltage_v"]) == (3, 0, 4.995)
    assert (read["local_time_ms"], read["system_time_ms"]) == (33313, 32000)
    assert read["tags"] == (
        {
            "id": 0,
            "role": 2,
            "position_m": (2.895, 2.419, -0.263),
            "distance_m": (3.64, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07),
        },
    )


def test_error_frame0() -> None:
    read = values(ONE_OF_EACH["ERROR_FRAME0"])
    assert ModuleFault(read["error_bits"]) == ModuleFault.DUPLICATE_ID | ModuleFault.RESTART
    assert (read["id"], read["local_time_ms"], read["marks"]) == (5, 2000, (7, 8, 9))


def test_system_common_frame0() -> None:
    assert values(ONE_OF_EACH["SYSTEM_COMMON_FRAME0"]) == {
        "mix": 0,
        "product_version": "0.17",
        "hardware_version": "1.19",
        "firmware_version": "4.0.2.162",
        "baud": 921_600,
        "role": 3,
        "id": 9,
    }


def test_setting_frame0() -> None:
    read = values(ONE_OF_EACH["SETTING_FRAME0"])
    assert read.pop("anchors_m") == (0.0, 8.0, 1.0, *(-8388.0,) * 27)
    assert read == {
        "mix": 0,
        "role": 3,
        "math_model": 2,
        "baud": 921_600,
        "system_ch": 9,
        "id": 7,
        "update_rate_hz": 50,
        "system_id": 1,
        "on_off": 17,
        "filter": 10,
        "mode": 10,
        "protocol": 5,
        "tx_gain_db": 33.5,
        "node_capacity": 20,
        "local_time_ms": 26478,
        "anchor_group": 0,
    }


@pytest.mark.parametrize(
    ("millimetres", "metres"),
    [(0x7FFFFF, 8388.607), (-1, -0.001), (-0x800000, -8388.608), (0x400000, 4194.304)],
)
def test_distances_use_all_24_bits_with_their_sign(millimetres: int, metres: float) -> None:
    assert values(node_frame3(5, [Peer(1, millimetres)]))["nodes"][0]["distance_m"] == metres


@settings(derandomize=True, max_examples=100)
@given(st.integers(-(1 << 23), (1 << 23) - 1))
def test_the_builder_packs_24_bits_as_the_reader_reads_them(value: int) -> None:
    read = values(node_frame3(5, [Peer(1, value)]))["nodes"][0]["distance_m"]
    assert read == value / 1000
    assert len(i24(value)) == 3
