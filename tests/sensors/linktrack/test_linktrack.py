"""Every kind of LinkTrack frame, decoded from bytes that were packed from the protocol sheet."""

from __future__ import annotations

import struct
from typing import Any

import pytest
from frames import (
    Peer,
    anchor_frame0,
    aoa_node_frame0,
    error_frame0,
    i24,
    node_frame0,
    node_frame1,
    node_frame2,
    node_frame3,
    node_frame4,
    node_frame5,
    node_frame6,
    setting_frame0,
    summed,
    system_common_frame0,
    tag_frame0,
    with_length,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.binary_layout import U8, Block, Field, Tail, read_block
from drslamd.sensors.frame_scanner import MAX_BUFFER_BYTES, NEED_MORE, NOT_A_FRAME, FrameScanner
from drslamd.sensors.linktrack.codec import (
    LINKTRACK,
    UNKNOWN_MAX_BYTES,
    UNKNOWN_MIN_BYTES,
    Frame,
    Refusal,
    decode,
)
from drslamd.sensors.linktrack.linktrack_frames import LAYOUTS, Kind, ModuleFault

PEERS = (Peer(0, 2850, 181, 159, role=1), Peer(3, -1, 163, 155, role=200, system_ms=77))

ONE_OF_EACH = {
    Kind.ANCHOR_FRAME0: anchor_frame0([(0, (2895, 2419, -263), 364)]),
    Kind.TAG_FRAME0: tag_frame0(),
    Kind.NODE_FRAME0: node_frame0(1, [(0, b""), (2, b"hi")]),
    Kind.NODE_FRAME1: node_frame1([(0, (2911, 2438, -101))]),
    Kind.NODE_FRAME2: node_frame2(5, PEERS),
    Kind.NODE_FRAME3: node_frame3(5, PEERS),
    Kind.NODE_FRAME4: node_frame4([(2, [(0, 2445), (1, 1748)]), (5, [])]),
    Kind.AOA_NODE_FRAME0: aoa_node_frame0([(3, 1416, -4967)]),
    Kind.NODE_FRAME5: node_frame5(0xBE23BE6B, [Peer(0xBEF2BE32, 300, 180, 176, role=7)]),
    Kind.NODE_FRAME6: node_frame6(0xBE23BE6B, [(0xBEF8BE1E, b"\x11\x22")]),
    Kind.SETTING_FRAME0: setting_frame0(),
    Kind.ERROR_FRAME0: error_frame0(0b1001),
    Kind.SYSTEM_COMMON_FRAME0: system_common_frame0(),
}


def values(frame: bytes) -> dict[str, Any]:
    decoded = decode(frame)
    assert isinstance(decoded, Frame)
    return dict(decoded.values)


def test_there_is_a_frame_and_a_table_for_every_kind() -> None:
    assert set(ONE_OF_EACH) == set(LAYOUTS) == set(Kind)


@pytest.mark.parametrize("kind", Kind, ids=lambda kind: kind.name)
def test_each_kind_is_found_in_a_stream_and_decoded(kind: Kind) -> None:
    frame = ONE_OF_EACH[kind]
    assert FrameScanner(LINKTRACK).feed(b"\x00" + frame, 0) == [frame]
    decoded = decode(frame)
    assert isinstance(decoded, Frame)
    assert decoded.kind is kind


@pytest.mark.parametrize("kind", Kind, ids=lambda kind: kind.name)
def test_each_kind_is_refused_when_cut_or_lengthened(kind: Kind) -> None:
    frame = ONE_OF_EACH[kind]
    for end in range(2, len(frame)):
        assert decode(frame[:end]) is Refusal.LENGTH
    assert decode(frame + b"\x00") is Refusal.LENGTH


@pytest.mark.parametrize("kind", Kind, ids=lambda kind: kind.name)
def test_the_length_of_each_kind_is_found_as_early_as_possible_and_then_stays(kind: Kind) -> None:
    frame = ONE_OF_EACH[kind]
    lengths = [LINKTRACK.length_at(frame[:end], 0) for end in range(len(frame) + 1)]
    known_at = lengths.index(len(frame))
    assert lengths == [NEED_MORE] * known_at + [len(frame)] * (len(frame) + 1 - known_at)


def test_node_frame3() -> None:
    assert values(ONE_OF_EACH[Kind.NODE_FRAME3]) == {
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
    read = values(ONE_OF_EACH[Kind.NODE_FRAME2])
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
    read = values(ONE_OF_EACH[Kind.NODE_FRAME5])
    assert (read["id"], read["local_time_ms"], read["system_time_ms"]) == (0xBE23BE6B, 1000, 0)
    assert read["voltage_v"] == 3.965
    assert read["nodes"] == (
        {"role": 7, "id": 0xBEF2BE32, "distance_m": 0.3, "fp_rssi_db": -90.0, "rx_rssi_db": -88.0},
    )


def test_user_data_keeps_its_senders_apart_even_when_one_is_empty() -> None:
    assert values(ONE_OF_EACH[Kind.NODE_FRAME0])["nodes"] == (
        {"role": 0, "id": 0, "data": b""},
        {"role": 0, "id": 2, "data": b"hi"},
    )
    read = values(ONE_OF_EACH[Kind.NODE_FRAME6])
    assert read == {
        "role": 0,
        "id": 0xBE23BE6B,
        "nodes": ({"role": 0, "id": 0xBEF8BE1E, "data": b"\x11\x22"},),
    }


def test_node_frame1() -> None:
    assert values(ONE_OF_EACH[Kind.NODE_FRAME1]) == {
        "role": 3,
        "id": 0,
        "system_time_ms": 33000,
        "local_time_ms": 34304,
        "voltage_v": 4.936,
        "nodes": ({"role": 2, "id": 0, "position_m": (2.911, 2.438, -0.101)},),
    }


def test_node_frame4_has_entries_inside_entries() -> None:
    read = values(ONE_OF_EACH[Kind.NODE_FRAME4])
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
    (node,) = values(ONE_OF_EACH[Kind.AOA_NODE_FRAME0])["nodes"]
    assert (node["id"], node["distance_m"], node["angle_deg"]) == (3, 1.416, -49.67)
    assert (node["fp_rssi_db"], node["rx_rssi_db"]) == (-81.5, -79.5)


def test_tag_frame0() -> None:
    read = values(ONE_OF_EACH[Kind.TAG_FRAME0])
    assert read["distance_m"] == (3.125, 5.539, 6.861, 4.684, 0.0, 0.0, 0.0, 0.0)
    assert read["velocity_mps"] == (-0.0038, -0.0006, 0.0)
    assert (read["local_time_ms"], read["system_time_ms"]) == (44556, 71627)
    assert (read["eop_m"], read["voltage_v"]) == ((0.11, 0.16, 2.55), 4.948)
    assert (read["gyro_radps"], read["euler_deg"][0]) == ((0.25, 0.5, -0.5), 144.49)


def test_anchor_frame0_leaves_empty_slots_out() -> None:
    read = values(ONE_OF_EACH[Kind.ANCHOR_FRAME0])
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


def test_anchor_frame0_ends_in_a_constant_not_in_a_sum() -> None:
    frame = ONE_OF_EACH[Kind.ANCHOR_FRAME0]
    assert decode(frame[:-1] + b"\xef") is Refusal.CHECKSUM
    assert decode(summed(frame[:-1])) is Refusal.CHECKSUM


def test_error_frame0() -> None:
    read = values(ONE_OF_EACH[Kind.ERROR_FRAME0])
    assert ModuleFault(read["error_bits"]) == ModuleFault.DUPLICATE_ID | ModuleFault.RESTART
    assert (read["id"], read["local_time_ms"], read["marks"]) == (5, 2000, (7, 8, 9))


def test_system_common_frame0() -> None:
    assert values(ONE_OF_EACH[Kind.SYSTEM_COMMON_FRAME0]) == {
        "mix": 0,
        "product_version": "0.17",
        "hardware_version": "1.19",
        "firmware_version": "4.0.2.162",
        "baud": 921_600,
        "role": 3,
        "id": 9,
    }


def test_setting_frame0() -> None:
    read = values(ONE_OF_EACH[Kind.SETTING_FRAME0])
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


@pytest.mark.parametrize("count", [0, 2, 9, 255])
def test_a_count_that_the_length_does_not_hold_is_refused(count: int) -> None:
    frame = bytearray(node_frame3(5, [Peer(1, 1000)])[:-1])
    frame[20] = count
    assert decode(summed(bytes(frame))) is Refusal.LENGTH


def test_user_data_that_would_pass_the_end_is_refused() -> None:
    body = struct.pack("<BB4xB", 0, 1, 1) + struct.pack("<BBH", 0, 2, 3) + b"hi"
    assert decode(with_length(b"\x55\x02", body)) is Refusal.ENTRIES


@pytest.mark.parametrize(("end", "fits"), [(12, False), (13, True)])
def test_no_block_is_read_beyond_its_end(end: int, fits: bool) -> None:
    text = Tail("text", Field("size", 1, U8), None)
    entry = Block(3, (Field("number", 0, U8),), text)
    block = Block(2, (), Tail("entries", Field("count", 0, U8), entry))
    data = bytes([2, 0]) + bytes([7, 1, 0]) + b"x" + bytes([8, 4, 0]) + b"text"
    expected = {"entries": ({"number": 7, "text": b"x"}, {"number": 8, "text": b"text"})}
    assert read_block(data + b"more", 0, end, block) == ((expected, 13) if fits else None)


def test_bytes_left_over_behind_user_data_are_refused() -> None:
    body = struct.pack("<BB4xB", 0, 1, 1) + struct.pack("<BBH", 0, 2, 2) + b"hi!"
    assert decode(with_length(b"\x55\x02", body)) is Refusal.ENTRIES


def test_an_anchor_entry_that_would_pass_the_end_is_refused() -> None:
    frame = bytearray(ONE_OF_EACH[Kind.NODE_FRAME4][:-1])
    frame[25] = 3  # entries of the first tag, which has two
    assert decode(summed(bytes(frame))) is Refusal.ENTRIES


@pytest.mark.parametrize(
    ("length", "outcome"),
    [
        (UNKNOWN_MIN_BYTES - 1, NOT_A_FRAME),
        (UNKNOWN_MIN_BYTES, UNKNOWN_MIN_BYTES),
        (UNKNOWN_MAX_BYTES, UNKNOWN_MAX_BYTES),
        (UNKNOWN_MAX_BYTES + 1, NOT_A_FRAME),
    ],
)
def test_an_unknown_mark_is_trusted_within_bounds(length: int, outcome: int) -> None:
    assert LINKTRACK.length_at(b"\x55\x0b" + struct.pack("<H", length), 0) == outcome


def test_a_frame_of_an_unknown_kind_is_jumped_over_and_not_decoded() -> None:
    unknown = with_length(b"\x55\x0b", bytes(range(15)))
    known = node_frame3(5, PEERS)
    assert FrameScanner(LINKTRACK).feed(unknown + known, 0) == [unknown, known]
    assert decode(unknown) is Refusal.UNKNOWN_KIND


@pytest.mark.parametrize("header", [b"\x54\x01", b"\x54\xf1", b"\x52\x01", b"\x6a\x00"])
def test_other_headers_start_no_frame(header: bytes) -> None:
    frame = header + b"\x14\x00" + bytes(16)
    assert LINKTRACK.length_at(frame, 0) == NOT_A_FRAME
    assert decode(frame) is Refusal.UNKNOWN_KIND


@pytest.mark.parametrize(
    ("mark", "minimum"), [(2, 12), (3, 28), (4, 120), (5, 22), (6, 22), (7, 22), (8, 25), (9, 15)]
)
def test_a_length_below_the_minimum_of_its_kind_is_refused(mark: int, minimum: int) -> None:
    def start(length: int) -> bytes:
        return bytes([0x55, mark]) + struct.pack("<H", length) + bytes(200)

    assert LINKTRACK.length_at(start(minimum), 0) == minimum
    assert LINKTRACK.length_at(start(minimum - 1), 0) == NOT_A_FRAME


@pytest.mark.parametrize(("length", "fits"), [(MAX_BUFFER_BYTES, True), (4097, False)])
def test_no_frame_is_longer_than_the_buffer(length: int, fits: bool) -> None:
    start = b"\x55\x02" + struct.pack("<H", length) + bytes(20)
    assert LINKTRACK.length_at(start, 0) == (length if fits else NOT_A_FRAME)


def test_an_error_frame_of_another_length_is_refused() -> None:
    assert LINKTRACK.length_at(b"\x54\xfa\x21\x00" + bytes(40), 0) == NOT_A_FRAME


@settings(derandomize=True, max_examples=300, deadline=None)
@given(
    st.sampled_from([kind.value for kind in Kind] + [b"\x55\x0b", b""]),
    st.binary(max_size=160),
    st.booleans(),
)
def test_no_bytes_make_the_decoder_raise(header: bytes, rest: bytes, plausible: bool) -> None:
    frame = with_length(header, rest) if plausible else header + rest
    assert isinstance(decode(frame), (Frame, Refusal))


@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.sampled_from(list(Kind)), st.integers(0, 1 << 20), st.integers(0, 255))
def test_no_damage_makes_the_decoder_raise(kind: Kind, position: int, value: int) -> None:
    frame = bytearray(ONE_OF_EACH[kind][:-1])
    frame[position % len(frame)] = value
    assert isinstance(decode(summed(bytes(frame))), (Frame, Refusal))


@settings(derandomize=True, max_examples=100)
@given(st.integers(-(1 << 23), (1 << 23) - 1))
def test_the_builder_packs_24_bits_as_the_reader_reads_them(value: int) -> None:
    read = values(node_frame3(5, [Peer(1, value)]))["nodes"][0]["distance_m"]
    assert read == value / 1000
    assert len(i24(value)) == 3
