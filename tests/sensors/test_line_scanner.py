"""Lines out of a stream in which anything may happen."""

from __future__ import annotations

import pytest
from frames import cut
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.line_scanner import MAX_LINE_BYTES, LineScanner


def lines_of(*reads: bytes) -> tuple[list[bytes], int]:
    scanner = LineScanner()
    return [line for read in reads for line in scanner.feed(read)], scanner.overlong


def test_cr_lf_and_both_end_a_line() -> None:
    assert lines_of(b"one\rtwo\nthree\r\nfour") == ([b"one", b"two", b"three"], 0)


def test_empty_lines_do_not_count() -> None:
    assert lines_of(b"\r\n\r\n\n\none\n") == ([b"one"], 0)


def test_a_line_may_come_in_pieces() -> None:
    assert lines_of(b"C=1", b"2:", b"", b"3\r") == ([b"C=12:3"], 0)


@settings(derandomize=True, max_examples=100, deadline=None)
@given(st.binary(max_size=600), st.integers(0, 1 << 20))
def test_any_bytes_cut_anywhere_give_the_same(data: bytes, seed: int) -> None:
    data = data.replace(b"\x07", b"\n").replace(b"\x08", b"x" * 100)
    assert lines_of(*cut(data, seed, 20)) == lines_of(data)
    assert lines_of(*(data[i : i + 1] for i in range(len(data)))) == lines_of(data)


@pytest.mark.parametrize(("length", "kept"), [(MAX_LINE_BYTES, 1), (MAX_LINE_BYTES + 1, 0)])
def test_a_line_longer_than_the_bound_is_dropped_whole(length: int, kept: int) -> None:
    assert lines_of(b"x" * length + b"\nnext\n") == ([b"x" * length] * kept + [b"next"], 1 - kept)


def test_noise_without_line_ends_is_one_overlong_line() -> None:
    lines, overlong = lines_of(*[b"x" * 1000] * 100, b"\nnext\n")
    assert (lines, overlong) == ([b"next"], 1)


def test_a_poisoned_byte_never_spoils_the_next_line() -> None:
    for value in range(256):
        lines, _ = lines_of(b"ab" + bytes([value]) + b"cd\rnext\r")
        assert lines[-1] == b"next", value
