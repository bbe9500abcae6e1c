"""LinkTrack frames in a stream: where they begin and end, and which are believed."""

from __future__ import annotations

import struct

import pytest
from frames import ONE_OF_EACH, PEERS, Peer, node_frame3, summed, with_length
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.frame_scanner import MAX_BUFFER_BYTES, NEED_MORE, NOT_A_FRAME, FrameScanner
from drslamd.sensors.linktrack.codec import (
    LINKTRACK,
    UNKNOWN_MAX_BYTES,
    UNKNOWN_MIN_BYTES,
    Frame,
    Refusal,
    decode,
)
from drslamd.sensors.linktrack.linktrack_frames import Kind


@pytest.mark.parametrize("kind", Kind, ids=lambda kind: kind.name)
def test_each_kind_is_found_in_a_stream_and_decoded(kind: Kind) -> None:
    frame = ONE_OF_EACH[kind.name]
    assert FrameScanner(LINKTRACK).feed(b"\x00" + frame, 0) == [frame]
    decoded = decode(frame)
    assert isinstance(decoded, Frame)
    assert decoded.kind is kind


@pytest.mark.parametrize("kind", Kind, ids=lambda kind: kind.name)
def test_each_kind_is_refused_when_cut_or_lengthened(kind: Kind) -> None:
    frame = ONE_OF_EACH[kind.name]
    for end in range(2, len(frame)):
        assert decode(frame[:end]) is Refusal.LENGTH
    assert decode(frame + b"\x00") is Refusal.LENGTH


@pytest.mark.parametrize("kind", Kind, ids=lambda kind: kind.name)
def test_the_length_of_each_kind_is_found_as_early_as_possible_and_then_stays(kind: Kind) -> None:
    frame = ONE_OF_EACH[kind.name]
    lengths = [LINKTRACK.length_at(frame[:end], 0) for end in range(len(frame) + 1)]
    known_at = lengths.index(len(frame))
    assert lengths == [NEED_MORE] * known_at + [len(frame)] * (len(frame) + 1 - known_at)


def test_anchor_frame0_ends_in_a_constant_not_in_a_sum() -> None:
    frame = ONE_OF_EACH["ANCHOR_FRAME0"]
    assert decode(frame[:-1] + b"\xef") is Refusal.CHECKSUM
    assert decode(summed(frame[:-1])) is Refusal.CHECKSUM


@pytest.mark.parametrize("count", [0, 2, 9, 255])
def test_a_count_that_the_length_does_not_hold_is_refused(count: int) -> None:
    frame = bytearray(node_frame3(5, [Peer(1, 1000)])[:-1])
    frame[20] = count
    assert decode(summed(bytes(frame))) is Refusal.LENGTH


def test_user_data_that_would_pass_the_end_is_refused() -> None:
    body = struct.pack("<BB4xB", 0, 1, 1) + struct.pack("<BBH", 0, 2, 3) + b"hi"
    assert decode(with_length(b"\x55\x02", body)) is Refusal.ENTRIES


def test_bytes_left_over_behind_user_data_are_refused() -> None:
    body = struct.pack("<BB4xB", 0, 1, 1) + struct.pack("<BBH", 0, 2, 2) + b"hi!"
    assert decode(with_length(b"\x55\x02", body)) is Refusal.ENTRIES


def test_an_anchor_entry_that_would_pass_the_end_is_refused() -> None:
    frame = bytearray(ONE_OF_EACH["NODE_FRAME4"][:-1])
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
    frame = bytearray(ONE_OF_EACH[kind.name][:-1])
    frame[position % len(frame)] = value
    assert isinstance(decode(summed(bytes(frame))), (Frame, Refusal))
