"""Builds what modules and bases send, from the tables of the protocol sheets, with struct alone.

Nothing here uses the code under test, so both sides of a test stand on their own feet.
"""

from __future__ import annotations

import random
import struct
from collections.abc import Iterable, Iterator, Sequence
from functools import reduce
from operator import xor
from typing import NamedTuple

SECOND_US = 1_000_000


class Peer(NamedTuple):
    """One entry of a ranging frame, in the units of the wire."""

    id: int
    distance_mm: int
    fp: int = 163  # -81.5 dB
    rx: int = 155  # -77.5 dB
    role: int = 0
    system_ms: int = 0


# LinkTrack


def summed(frame: bytes) -> bytes:
    """`frame` with the low byte of its sum behind it."""
    return frame + bytes([sum(frame) & 0xFF])


def i24(value: int) -> bytes:
    return (value % (1 << 24)).to_bytes(3, "little")


def with_length(header: bytes, rest: bytes) -> bytes:
    """Header and mark, the total length as u16, the rest and the sum."""
    return summed(header + struct.pack("<H", len(header) + 2 + len(rest) + 1) + rest)


def node_frame3(
    own_id: int = 5,
    peers: Sequence[Peer] = (),
    *,
    local_ms: int = 1000,
    system_ms: int = 1017,
    millivolts: int = 4939,
    role: int = 0,
    mark: int = 5,
) -> bytes:
    head = struct.pack("<BBII4xHB", role, own_id, local_ms, system_ms, millivolts, len(peers))
    entries = b"".join(
        struct.pack("<BB3sBB", p.role, p.id, i24(p.distance_mm), p.fp, p.rx) for p in peers
    )
    return with_length(bytes([0x55, mark]), head + entries)


def node_frame2(
    own_id: int = 5,
    peers: Sequence[Peer] = (),
    *,
    local_ms: int = 1000,
    system_ms: int = 1017,
    millivolts: int = 4939,
    role: int = 0,
) -> bytes:
    head = struct.pack("<BBI", role, own_id, system_ms)
    head += bytes([11, 22, 255])
    head += b"".join(map(i24, (2000, -91, 1000, 15, -6, 0)))
    head += bytes(9) + struct.pack("<6f", 0.25, -0.5, 1.5, 9.75, 0.125, -2.0) + bytes(12)
    head += struct.pack("<3h4f", 14449, -1468, 1, 0.5, -0.5, 0.5, 0.5) + bytes(4)
    head += struct.pack("<I10xHB", local_ms, millivolts, len(peers))
    entries = b"".join(
        struct.pack("<BB3sBBI2x", p.role, p.id, i24(p.distance_mm), p.fp, p.rx, p.system_ms)
        for p in peers
    )
    return with_length(b"\x55\x04", head + entries)


def node_frame5(
    own_id: int = 0xBE23BE6B,
    peers: Sequence[Peer] = (),
    *,
    local_ms: int = 1000,
    millivolts: int = 3965,
    role: int = 0,
) -> bytes:
    head = struct.pack("<BIII4xHB", role, own_id, local_ms, 0, millivolts, len(peers))
    entries = b"".join(
        struct.pack("<BI3sBB", p.role, p.id, i24(p.distance_mm), p.fp, p.rx) for p in peers
    )
    return with_length(b"\x55\x08", head + entries)


def node_frame0(own_id: int = 5, messages: Iterable[tuple[int, bytes]] = ()) -> bytes:
    messages = list(messages)
    entries = b"".join(
        struct.pack("<BBH", 0, sender, len(data)) + data for sender, data in messages
    )
    return with_length(b"\x55\x02", struct.pack("<BB4xB", 0, own_id, len(messages)) + entries)


def node_frame6(own_id: int, messages: Sequence[tuple[int, bytes]]) -> bytes:
    entries = b"".join(
        struct.pack("<BIH", 0, sender, len(data)) + data for sender, data in messages
    )
    return with_length(b"\x55\x09", struct.pack("<BI4xB", 0, own_id, len(messages)) + entries)


def node_frame1(tags: Sequence[tuple[int, tuple[int, int, int]]]) -> bytes:
    head = struct.pack("<BBII10xHB", 3, 0, 33000, 34304, 4936, len(tags))
    entries = b"".join(
        struct.pack("<BB", 2, tag) + b"".join(map(i24, position)) + bytes(9)
        for tag, position in tags
    )
    return with_length(b"\x55\x03", head + entries)


def node_frame4(tags: Sequence[tuple[int, Sequence[tuple[int, int]]]]) -> bytes:
    head = struct.pack("<BBII4xHB", 1, 3, 105870, 105871, 4456, len(tags))
    for tag, anchors in tags:
        head += struct.pack("<B2xBB", tag, 88, len(anchors))
        head += b"".join(bytes([anchor]) + i24(distance) for anchor, distance in anchors)
    return with_length(b"\x55\x06", head)


def aoa_node_frame0(bearings: Sequence[tuple[int, int, int]]) -> bytes:
    """Entries of id, distance in mm and bearing in hundredths of a degree."""
    head = struct.pack("<BBII4xHB", 2, 0, 160702, 0, 4847, len(bearings))
    for peer, distance, angle in bearings:
        head += struct.pack("<BB3sh", 1, peer, i24(distance), angle) + bytes([163, 159, 0, 0])
    return with_length(b"\x55\x07", head)


def tag_frame0() -> bytes:
    body = b"\x55\x01\x01\x02" + b"".join(map(i24, (2702, -91, 1000, -38, -6, 0)))
    body += b"".join(map(i24, (3125, 5539, 6861, 4684, 0, 0, 0, 0)))
    body += struct.pack("<6f", 0.25, 0.5, -0.5, 0.25, 9.75, -0.125) + bytes(12)
    body += struct.pack("<3h4f", 14449, 9717, -1468, 1.0, 0.0, 0.0, 0.0) + bytes(4)
    body += struct.pack("<II", 44556, 71627) + bytes([0, 11, 16, 255])
    return summed(body + struct.pack("<H5x", 4948))


def anchor_frame0(tags: Sequence[tuple[int, tuple[int, int, int], int]]) -> bytes:
    """Slots of id, position in mm and distance to A0 in cm; the others hold stale bytes."""
    body = b"\x55\x00"
    for tag, position, distance_cm in tags:
        body += bytes([tag, 2]) + b"".join(map(i24, position))
        body += struct.pack("<8H", distance_cm, *range(1, 8))
    body += (b"\xff\x02" + b"\x55\x05\x1d\x00" * 6 + b"\x07") * (30 - len(tags))
    body += bytes(67) + struct.pack("<I4xHIBB", 33313, 4995, 32000, 0, 3)
    return body + b"\xee"


def error_frame0(bits: int, own_id: int = 5) -> bytes:
    return with_length(b"\x54\xfa", struct.pack("<BBI4xB2x3B11x", 2, own_id, 2000, bits, 7, 8, 9))


def system_common_frame0() -> bytes:
    body = b"\x52\x00\x00" + bytes([17, 0, 19, 1, 162, 2, 0, 4]) + bytes(8)
    return summed(body + (921_600).to_bytes(3, "little") + bytes([3, 9]) + bytes(7))


def setting_frame0() -> bytes:
    body = b"\x54\x00" + bytes([0, 3, 2]) + (921_600).to_bytes(3, "little") + bytes([9, 7])
    body += struct.pack("<HB", 50, 1) + bytes([255, 17, 255, 10, 10, 255, 5, 67, 0, 0, 0, 20])
    body += bytes(2) + struct.pack("<I5x", 26478) + bytes([0])
    anchors = (0, 8000, 1000) + (-8388000,) * 27
    return summed(body + b"".join(map(i24, anchors)))


def ranging_stream(
    count: int, *, own_id: int = 5, start_ms: int = 1000, period_ms: int = 20, peers: int = 1
) -> list[bytes]:
    """Consecutive NODE_FRAME3 of one module; frame k measures 1.000 m + k mm to every peer."""
    return [
        node_frame3(
            own_id,
            [Peer(10 + p, 1000 + k) for p in range(peers)],
            local_ms=(start_ms + k * period_ms) % (1 << 32),
            system_ms=(start_ms + 17 + k * period_ms) % (1 << 32),
        )
        for k in range(count)
    ]


# wheels


def kobuki_packet(payload: bytes) -> bytes:
    checked = bytes([len(payload)]) + payload
    return b"\xaa\x55" + checked + bytes([reduce(xor, checked)])


def kobuki_core(time_ms: int, left: int, right: int) -> bytes:
    data = struct.pack("<H3xHH6x", time_ms % (1 << 16), left % (1 << 16), right % (1 << 16))
    return bytes([1, len(data)]) + data


KOBUKI_REST = (
    bytes([3, 3, 0, 0, 0])
    + bytes([4, 7, 0x3C, 0x1D, 0xFC, 0xFF, 0, 0, 0])
    + bytes([13, 14, *range(14)])
)
"""Sub-payloads that stand behind the core data."""


def ascii_line(time_ms: int, left: int, right: int) -> bytes:
    text = f"ODO,{time_ms},{left},{right}".encode()
    return b"$%s*%02X\r\n" % (text, reduce(xor, text))


def wheeltec_frame(
    ahead_mmps: int, turn_mradps: int, gyro: int = 0, sideways_mmps: int = 0, stop: int = 0
) -> bytes:
    """At rest but for that, level, with a battery of 24 V."""
    speeds = struct.pack(">BB3h", 0x7B, stop, ahead_mmps, sideways_mmps, turn_mradps)
    frame = speeds + struct.pack(">6hH", 0, 0, 16384, 0, 0, gyro, 24_000)
    return frame + bytes([reduce(xor, frame), 0x7D])


# how bytes arrive


def cut(data: bytes, seed: int, longest: int = 40) -> Iterator[bytes]:
    """`data` in reads of random length."""
    draw = random.Random(seed)
    at = 0
    while at < len(data):
        step = draw.randint(1, longest)
        yield data[at : at + step]
        at += step


PEERS = (Peer(0, 2850, 181, 159, role=1), Peer(3, -1, 163, 155, role=200, system_ms=77))

ONE_OF_EACH = {
    "ANCHOR_FRAME0": anchor_frame0([(0, (2895, 2419, -263), 364)]),
    "TAG_FRAME0": tag_frame0(),
    "NODE_FRAME0": node_frame0(1, [(0, b""), (2, b"hi")]),
    "NODE_FRAME1": node_frame1([(0, (2911, 2438, -101))]),
    "NODE_FRAME2": node_frame2(5, PEERS),
    "NODE_FRAME3": node_frame3(5, PEERS),
    "NODE_FRAME4": node_frame4([(2, [(0, 2445), (1, 1748)]), (5, [])]),
    "AOA_NODE_FRAME0": aoa_node_frame0([(3, 1416, -4967)]),
    "NODE_FRAME5": node_frame5(0xBE23BE6B, [Peer(0xBEF2BE32, 300, 180, 176, role=7)]),
    "NODE_FRAME6": node_frame6(0xBE23BE6B, [(0xBEF8BE1E, b"\x11\x22")]),
    "SETTING_FRAME0": setting_frame0(),
    "ERROR_FRAME0": error_frame0(0b1001),
    "SYSTEM_COMMON_FRAME0": system_common_frame0(),
}

"""A LinkTrack frame of every kind."""
