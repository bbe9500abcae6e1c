"""The budget of bytes: who goes first, what is said, what is counted."""

from __future__ import annotations

import pytest

from drslamd.conventions import SECOND_US
from drslamd.events import Send
from drslamd.gossip import lc02, messages
from drslamd.gossip.outbox import Outbox

RATE = 10_000
"""So the bucket holds 20,000 bytes."""


def a_send(kind: str, size: int, robot: int = 1) -> Send:
    """A message that takes `size` bytes in all."""
    channel = messages.channel(kind, robot)
    return Send(channel, bytes(size - 9 - len(channel)))


def test_messages_are_counted_as_they_go_out() -> None:
    outbox = Outbox(1, RATE)
    send = a_send("STATUS", 217)
    assert outbox.passes(send, 0)
    assert outbox.bytes_sent == len(lc02.encode(0, send.channel, send.payload)) == 217
    assert outbox.messages_sent == 1
    assert outbox.condition(0) is None


@pytest.mark.parametrize(
    ("kind", "robot", "may_use"),
    [("STATUS", 1, 20), ("GRAPH", 1, 16), ("ODOMETRY", 1, 12), ("POSE", 1, 8), ("GRAPH", 2, 4)],
)
def test_the_less_useful_a_kind_the_more_it_leaves(kind: str, robot: int, may_use: int) -> None:
    outbox = Outbox(1, RATE)
    passed = sum(outbox.passes(a_send(kind, 1_000, robot), 0) for _ in range(30))
    assert passed == may_use
    assert outbox.held_back[kind.lower()] == 30 - may_use
    assert outbox.bytes_sent == 1_000 * may_use


def test_the_bucket_fills_with_time_and_no_further_than_two_seconds() -> None:
    outbox = Outbox(1, RATE)
    for _ in range(20):
        outbox.passes(a_send("STATUS", 1_000), 0)
    assert not outbox.passes(a_send("STATUS", 1_000), SECOND_US // 10 - 1)
    assert outbox.passes(a_send("STATUS", 1_000), SECOND_US // 10)
    assert sum(outbox.passes(a_send("STATUS", 1_000), 60 * SECOND_US) for _ in range(30)) == 20


def test_a_clock_that_steps_back_fills_nothing() -> None:
    outbox = Outbox(1, RATE)
    for _ in range(20):
        outbox.passes(a_send("STATUS", 1_000), SECOND_US)
    assert not outbox.passes(a_send("STATUS", 1_000), 0)


def test_what_is_held_back_is_said_for_ten_seconds() -> None:
    outbox = Outbox(1, RATE)
    for _ in range(10):
        outbox.passes(a_send("POSE", 1_000), 0)
    assert "max_bytes_per_s = 10000" in str(outbox.condition(10 * SECOND_US))
    assert "2 pose" in str(outbox.condition(10 * SECOND_US))
    assert outbox.condition(10 * SECOND_US + 1) is None
