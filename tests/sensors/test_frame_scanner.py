"""The resynchronising scanner, fed with LinkTrack frames and with formats made for the purpose."""

from __future__ import annotations

import random
import re
from itertools import pairwise

import pytest
from frames import Peer, cut, node_frame0, node_frame3, ranging_stream, summed
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.frame_scanner import (
    MAX_BUFFER_BYTES,
    NEED_MORE,
    NOT_A_FRAME,
    STALL_US,
    FrameFormat,
    FrameScanner,
)
from drslamd.sensors.linktrack.codec import LINKTRACK, LinkTrackFormat
from drslamd.sensors.wheels.kobuki import KobukiFormat


def scanned(reads: list[bytes], frame_format: FrameFormat = LINKTRACK) -> tuple[object, ...]:
    """Frames and all counters after feeding `reads` at one and the same time."""
    scanner = FrameScanner(frame_format)
    frames = [frame for read in reads for frame in scanner.feed(read, 0)]
    fed = sum(map(len, reads))
    assert fed == sum(map(len, frames)) + scanner.garbage_bytes + scanner.pending_bytes
    return frames, scanner.garbage_bytes, scanner.bad_checksums, scanner.pending_bytes


def noisy_stream(seed: int, frames: list[bytes]) -> bytes:
    """Frames with garbage between them, rich in header bytes, and some of them damaged."""
    draw = random.Random(seed)
    parts = []
    for frame in frames:
        noise = draw.choices([0x55, 0x54, 0x52, 5, 4, 0, 11, 40, 255], k=draw.randint(0, 12))
        parts += [
            bytes(noise),
            frame[: draw.randint(1, len(frame))] if draw.random() < 0.2 else frame,
        ]
    return b"".join(parts)


def test_frames_in_a_row_come_out_as_they_are() -> None:
    frames = ranging_stream(3)
    assert scanned([b"".join(frames)]) == (frames, 0, 0, 0)


def test_an_empty_read_changes_nothing() -> None:
    assert scanned([b"", ranging_stream(1)[0], b""]) == (ranging_stream(1), 0, 0, 0)


@pytest.mark.row("D4")
@pytest.mark.parametrize("seed", range(30))
def test_whole_and_byte_by_byte_and_random_reads_give_the_same(seed: int) -> None:
    stream = noisy_stream(seed, ranging_stream(40, peers=3))
    whole = scanned([stream])
    assert scanned([stream[i : i + 1] for i in range(len(stream))]) == whole
    assert scanned(list(cut(stream, seed))) == whole


@pytest.mark.row("D4")
@settings(derandomize=True, max_examples=150, deadline=None)
@given(st.binary(max_size=400), st.lists(st.integers(0, 400), max_size=8))
def test_any_bytes_cut_anywhere_give_the_same(noise: bytes, cuts: list[int]) -> None:
    stream = noise + ranging_stream(1)[0] + noise
    edges = sorted({0, len(stream), *(c for c in cuts if c < len(stream))})
    reads = [stream[a:b] for a, b in pairwise(edges)]
    assert scanned(reads) == scanned([stream])
    assert scanned(reads, KobukiFormat()) == scanned([stream], KobukiFormat())


def test_a_read_far_larger_than_the_buffer_is_taken_whole() -> None:
    frames = ranging_stream(1000, peers=4)
    stream = b"".join(frames)
    assert len(stream) > 10 * MAX_BUFFER_BYTES
    assert scanned([stream]) == (frames, 0, 0, 0)
    assert scanned([b"\x00" * 3 * MAX_BUFFER_BYTES + stream])[0] == frames


@pytest.mark.row("D1")
@settings(derandomize=True, max_examples=30, deadline=None)
@given(st.binary(min_size=1, max_size=3 * MAX_BUFFER_BYTES))
def test_never_more_than_the_buffer_is_held(data: bytes) -> None:
    scanner = FrameScanner(LINKTRACK)
    scanner.feed(b"\x55\x04" + (120 + 13 * 254).to_bytes(2, "little") + data, 0)
    assert scanner.pending_bytes < MAX_BUFFER_BYTES


class Spy(LinkTrackFormat):
    """Notes how much the scanner has in hand."""

    longest = 0

    def length_at(self, buffer: bytes, at: int) -> int:
        self.longest = max(self.longest, len(buffer))
        return super().length_at(buffer, at)


def test_a_large_read_is_worked_on_in_pieces_of_the_buffer() -> None:
    spy = Spy()
    frames = ranging_stream(1000, peers=4)
    assert FrameScanner(spy).feed(b"".join(frames), 0) == frames
    assert spy.longest == MAX_BUFFER_BYTES


@pytest.mark.row("D3")
def test_one_poisoned_byte_costs_no_intact_frame() -> None:
    for value in range(256):
        before, after = ranging_stream(1), ranging_stream(3, start_ms=1020)
        stream = b"".join([*before, bytes([value]), *after])
        frames, garbage, _, _ = scanned([stream])
        assert frames == before + after, value
        assert garbage == 1, value


def test_the_search_goes_on_one_byte_after_a_failed_header() -> None:
    torn, *good = ranging_stream(3)
    frames, garbage, bad, _ = scanned([torn[:24] + good[0] + good[1]])
    assert (frames, garbage, bad) == (good, 24, 1)


def test_a_false_header_right_before_a_good_one_costs_one_byte() -> None:
    (frame,) = ranging_stream(1)
    assert scanned([b"\x55" + frame])[:2] == ([frame], 1)


def test_a_frame_inside_a_frame_is_not_a_frame() -> None:
    inner = ranging_stream(1)[0]
    outer = node_frame0(1, [(3, inner)])
    assert scanned([outer + inner])[0] == [outer, inner]


def test_an_unfinished_frame_waits_for_its_rest() -> None:
    (frame,) = ranging_stream(1)
    scanner = FrameScanner(LINKTRACK)
    assert scanner.feed(frame[:17], 0) == []
    assert scanner.pending_bytes == 17
    assert scanner.feed(frame[17:], 0) == [frame]


@pytest.mark.row("D4")
@pytest.mark.parametrize("cut_at", range(1, 29))
@pytest.mark.parametrize("pause", [0.1, 10.0, 600.0])
def test_a_pause_inside_a_frame_does_not_lose_it(cut_at: int, pause: float) -> None:
    first, second = ranging_stream(2)
    scanner = FrameScanner(LINKTRACK)
    later = round(pause * 1e6)
    frames = scanner.feed(first[:cut_at], 0) + scanner.feed(first[cut_at:] + second, later)
    assert frames == [first, second]


LONG_FALSE_HEADER = b"\x55\x0b\x00\x04"  # 1024 bytes of an unknown kind


@pytest.mark.parametrize(("silence", "found"), [(STALL_US - 1, False), (STALL_US, True)])
def test_after_a_silence_a_frame_behind_a_false_header_is_believed(
    silence: int, found: bool
) -> None:
    first, second = ranging_stream(2)
    scanner = FrameScanner(LINKTRACK)
    assert scanner.feed(LONG_FALSE_HEADER + first, 0) == []
    assert scanner.feed(second, silence) == ([first, second] if found else [])


def test_after_a_silence_frames_behind_several_false_headers_are_believed() -> None:
    first, second, third = ranging_stream(3)
    scanner = FrameScanner(LINKTRACK)
    assert scanner.feed(LONG_FALSE_HEADER * 2 + first + LONG_FALSE_HEADER + second, 0) == []
    assert scanner.feed(third, STALL_US) == [first, second, third]
    assert scanner.garbage_bytes == 12


def test_a_silence_changes_nothing_while_no_frame_is_complete() -> None:
    first, second = ranging_stream(2)
    scanner = FrameScanner(LINKTRACK)
    damaged = bytes([first[0], *first[1:28], first[28] ^ 1])
    assert scanner.feed(LONG_FALSE_HEADER + damaged, 0) == []
    assert scanner.feed(b"", STALL_US) == []
    assert (scanner.garbage_bytes, scanner.bad_checksums) == (0, 0)
    assert scanner.feed(second, 2 * STALL_US) == []
    assert scanner.feed(b"", 3 * STALL_US) == [second]
    assert (scanner.garbage_bytes, scanner.bad_checksums) == (4 + 29, 1)


def test_without_a_silence_a_false_header_is_given_up_at_its_own_length() -> None:
    frames = ranging_stream(60)
    stream = LONG_FALSE_HEADER + b"".join(frames)
    assert len(stream) > 1024
    assert scanned([stream])[0] == frames


def test_a_bad_checksum_is_counted_once() -> None:
    (frame,) = ranging_stream(1)
    assert scanned([frame[:-1] + bytes([frame[-1] ^ 1])])[1:] == (29, 1, 0)


@pytest.mark.row("D2")
def test_no_single_bit_flip_passes_as_a_frame() -> None:
    for flip in range(29 * 8):
        frame = bytearray(node_frame3(5, [Peer(10, 1234)]))
        frame[flip // 8] ^= 1 << flip % 8
        good = ranging_stream(10, start_ms=2000)
        assert scanned([bytes(frame) + b"".join(good)])[0] == good, flip


class ShortFormat:
    """Frames of three bytes: 7E, anything, sum."""

    head = re.compile(b"\x7e")

    def length_at(self, buffer: bytes, at: int) -> int:
        if at + 2 > len(buffer):
            return NEED_MORE
        return NOT_A_FRAME if buffer[at + 1] == 0 else 3

    def is_intact(self, frame: bytes) -> bool:
        return frame == summed(frame[:-1])


def test_the_scanner_knows_nothing_about_any_format() -> None:
    stream = b"\x7e\x00\x7e" + summed(b"\x7e\x01") + b"\x7e\x7e"
    frames, garbage, _, pending = scanned([stream], ShortFormat())
    assert (frames, garbage, pending) == ([summed(b"\x7e\x01")], 3, 2)
