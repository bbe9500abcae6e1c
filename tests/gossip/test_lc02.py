"""LCM's framing of small messages, byte by byte; how liblcm sees it is in tests/io/test_liblcm."""

from __future__ import annotations

import random

import pytest

from drslamd.gossip import lc02
from drslamd.gossip.lc02 import FramingFault

DATAGRAM = b"LC02\x00\x00\x00\x07DRSLAM_POSE_003\x00payload"
"""Written out after LCM's protocol page: magic, sequence number, channel, NUL, payload."""


def framed(name: bytes, payload: bytes = b"", magic: bytes = b"LC02") -> bytes:
    return magic + b"\0\0\0\0" + name + b"\0" + payload


def test_a_datagram_has_the_bytes_of_the_protocol_page() -> None:
    assert lc02.encode(7, "DRSLAM_POSE_003", b"payload") == DATAGRAM
    assert lc02.decode(DATAGRAM) == ("DRSLAM_POSE_003", b"payload")


def test_the_sequence_number_is_big_endian_and_wraps_at_32_bits() -> None:
    assert lc02.encode(0x01020304, "A", b"")[4:8] == b"\x01\x02\x03\x04"
    assert lc02.encode(2**32 - 1, "A", b"")[4:8] == b"\xff\xff\xff\xff"
    assert lc02.encode(2**32, "A", b"")[4:8] == b"\0\0\0\0"


def test_an_empty_payload_and_a_payload_of_zeros_come_through() -> None:
    assert lc02.decode(framed(b"A")) == ("A", b"")
    assert lc02.decode(framed(b"A", b"\0\0\0")) == ("A", b"\0\0\0")


def test_a_payload_of_1400_bytes_goes_out_and_one_of_1401_does_not() -> None:
    assert lc02.decode(lc02.encode(0, "A", bytes(1400))) == ("A", bytes(1400))
    with pytest.raises(ValueError, match="1401"):
        lc02.encode(0, "A", bytes(1401))


def test_a_channel_of_63_bytes_goes_out_and_one_of_64_does_not() -> None:
    assert lc02.decode(lc02.encode(0, "C" * 63, b"x")) == ("C" * 63, b"x")
    with pytest.raises(ValueError, match="64"):
        lc02.encode(0, "C" * 64, b"x")


@pytest.mark.parametrize("channel", ["", "A\0B", "KÜCHE"])
def test_a_channel_that_lcm_cannot_carry_is_a_bug_of_the_caller(channel: str) -> None:
    with pytest.raises(ValueError):
        lc02.encode(0, channel, b"x")


@pytest.mark.parametrize(
    ("datagram", "fault"),
    [
        (b"", FramingFault.TOO_SHORT),
        (b"LC02\0\0\0", FramingFault.TOO_SHORT),
        (b"LC02\0\0\0\0", FramingFault.NO_CHANNEL_END),
        (b"LC02\0\0\0\0CHANNEL", FramingFault.NO_CHANNEL_END),
        (framed(b"C" * 64), FramingFault.NO_CHANNEL_END),
        (framed(b"A", magic=b"LC01"), FramingFault.NOT_LCM),
        (framed(b"A", magic=b"20CL"), FramingFault.NOT_LCM),
        (framed(b"A", magic=b"LC03"), FramingFault.FRAGMENT),
        (framed(b""), FramingFault.BAD_CHANNEL),
        (framed(b"\xff"), FramingFault.BAD_CHANNEL),
        (framed(b"K\xc3\x9cCHE"), FramingFault.BAD_CHANNEL),
        (framed(b"A", bytes(1401)), FramingFault.TOO_LONG),
        (framed(b"C" * 63, bytes(1401)), FramingFault.TOO_LONG),
        (bytes(65_507), FramingFault.TOO_LONG),
    ],
)
def test_what_is_no_small_message_is_refused_by_its_name(
    datagram: bytes, fault: FramingFault
) -> None:
    assert lc02.decode(datagram) is fault


def test_a_channel_of_63_bytes_is_read_with_the_longest_payload() -> None:
    assert lc02.decode(framed(b"C" * 63, bytes(1400))) == ("C" * 63, bytes(1400))


def is_judged(datagram: bytes) -> bool:
    """Either a fault, or a message that `encode` frames the same way."""
    verdict = lc02.decode(datagram)
    if isinstance(verdict, FramingFault):
        return True
    channel, payload = verdict
    return lc02.encode(int.from_bytes(datagram[4:8], "big"), channel, payload) == datagram


def test_a_message_cut_at_any_byte_is_judged() -> None:
    channel_end = DATAGRAM.index(b"\0", 8)
    for length in range(len(DATAGRAM)):
        assert is_judged(DATAGRAM[:length])
        assert isinstance(lc02.decode(DATAGRAM[:length]), FramingFault) == (length <= channel_end)


def test_a_message_with_any_bit_flipped_is_judged() -> None:
    for bit in range(8 * len(DATAGRAM)):
        flipped = bytearray(DATAGRAM)
        flipped[bit // 8] ^= 1 << bit % 8
        assert is_judged(bytes(flipped))


def test_random_bytes_are_judged() -> None:
    draw = random.Random(2024)
    for _ in range(20_000):
        tail = draw.randbytes(draw.randrange(100))
        assert is_judged(draw.choice([b"", b"LC02", b"LC02\0\0\0\0", b"LC03\0\0\0\0"]) + tail)
