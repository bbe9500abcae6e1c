"""Messages as bytes: header, channels, and bytes that are no message."""

from __future__ import annotations

import random

import pytest
from message_builders import HEADER, a_status, kinds

from drslamd.gossip import messages
from drslamd.gossip.codecs import CODECS
from drslamd.gossip.message_types import LogState, Message
from drslamd.gossip.seal import Header
from drslamd.slam.graph.measurements import Chapter, GraphEntry, Keyframe


def test_the_header_stands_where_every_lcm_program_finds_it() -> None:
    for kind, message in kinds().items():
        raw = CODECS[kind].struct.decode(messages.encode(HEADER, message))
        head = raw.header
        fields = (head.version, head.origin, head.epoch, head.counter, head.utime, head.tag)
        assert fields == (3, 3, 11, 12, 13, bytes(8))


def test_each_kind_has_a_channel_for_each_robot() -> None:
    assert messages.channel("GRAPH", 7) == "DRSLAM_GRAPH_007"
    for kind, message in kinds().items():
        assert messages.kind_of(message) == kind
        for robot in (0, 9, 254):
            assert messages.kind_of_channel(messages.channel(kind, robot)) == kind


@pytest.mark.parametrize(
    "channel",
    [
        "",
        "DRSLAM_GRAPH",
        "DRSLAM_GRAPH_",
        "DRSLAM_GRAPH_7",
        "DRSLAM_GRAPH_0007",
        "DRSLAM_GRAPH_255",
        "DRSLAM_GRAPH_-01",
        "DRSLAM_GRAPH_٠٠٧",
        "DRSLAM_TEAPOT_007",
        "drslam_GRAPH_007",
        "MBOT_ODOMETRY",
    ],
)
def test_another_channel_is_none_of_ours(channel: str) -> None:
    assert messages.kind_of_channel(channel) is None


@pytest.mark.parametrize("kind", CODECS)
def test_bytes_left_over_are_refused(kind: str) -> None:
    payload = messages.encode(HEADER, kinds()[kind])
    assert messages.decode(kind, payload + b"\0") == "bytes left over"


@pytest.mark.parametrize("kind", CODECS)
def test_a_message_cut_at_any_byte_is_refused(kind: str) -> None:
    payload = messages.encode(HEADER, kinds()[kind])
    for length in range(len(payload)):
        assert isinstance(messages.decode(kind, payload[:length]), str)


BYTES_AT_THE_END = [
    GraphEntry(7, chapter=Chapter(0, keyframes=(Keyframe(40, 1, -100, 200, -30),))),
    a_status(logs=(LogState(3, 11, 0, 5, 9), LogState(3, 11, 6, 9, 9))),
]
"""What LCM's decoders read without counting."""


@pytest.mark.parametrize("message", BYTES_AT_THE_END)
def test_bytes_at_the_end_of_a_message_are_as_many_as_it_says(message: Message) -> None:
    kind, payload = messages.kind_of(message), messages.encode(HEADER, message)
    assert messages.decode(kind, payload) == message
    for length in range(len(payload)):
        assert isinstance(messages.decode(kind, payload[:length]), str)
    raw = CODECS[kind].struct.decode(payload)
    count = len(raw.packed if kind == "GRAPH" else raw.beyond)
    at = len(payload) - count - 2
    assert payload[at : at + 2] == count.to_bytes(2, "big")
    for more in (1, 200, -count - 1):
        said = (count + more).to_bytes(2, "big", signed=True)
        forged = payload[:at] + said + payload[at + 2 :]
        assert isinstance(messages.decode(kind, forged), str)


@pytest.mark.parametrize("kind", CODECS)
def test_a_message_under_the_name_of_another_kind_is_refused(kind: str) -> None:
    for other in set(CODECS) - {kind}:
        assert isinstance(messages.decode(other, messages.encode(HEADER, kinds()[kind])), str)


def is_judged(kind: str, payload: bytes) -> bool:
    """Refused, or a message that `encode` makes again from what was read."""
    message = messages.decode(kind, payload)
    if isinstance(message, str):
        return bool(message)
    head = CODECS[kind].struct.decode(payload).header
    header = Header(head.version, head.origin, head.epoch, head.counter, head.utime)
    again = messages.encode(header, message)
    return bool(again[:31] + head.tag + again[39:] == payload)


@pytest.mark.parametrize("kind", CODECS)
def test_a_message_with_any_bit_flipped_is_refused_or_says_what_it_says(kind: str) -> None:
    payload = messages.encode(HEADER, kinds()[kind])
    for bit in range(8 * len(payload)):
        flipped = bytearray(payload)
        flipped[bit // 8] ^= 1 << bit % 8
        assert is_judged(kind, bytes(flipped)), bit


@pytest.mark.parametrize("kind", CODECS)
def test_random_bytes_behind_a_fingerprint_are_judged(kind: str) -> None:
    draw = random.Random(kind)
    head = messages.encode(HEADER, kinds()[kind])[:39]
    for _ in range(3_000):
        kept = draw.choice([0, 8, 39])
        assert is_judged(kind, head[:kept] + draw.randbytes(draw.randrange(200)))
