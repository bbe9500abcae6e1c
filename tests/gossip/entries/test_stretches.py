"""What is held beyond gaps, in few bytes."""

from __future__ import annotations

import random
from itertools import pairwise

import pytest

from drslamd.gossip.entries import stretches
from drslamd.gossip.message_types import LogState

LAST = 2**31 - 1


def rows(robot: int, complete: int, newest: int, *beyond: tuple[int, int]) -> list[LogState]:
    states = [(0, complete), *beyond]
    return [LogState(robot, 7, first, end, newest) for first, end in states]


SAID = [
    *rows(3, 5, 5),
    *rows(4, 5, 900, (6, 7), (200, 900)),
    *rows(5, 0, 10),
    *rows(6, 0, LAST, (LAST - 1, LAST)),
]


def test_what_is_packed_comes_back() -> None:
    first, data = stretches.packed(SAID)
    assert [state.id for state in first] == [3, 4, 5, 6]
    # none; two of which 1 and 1, 193 and 700; none; one of which 2^31 - 2 and 1
    assert data == bytes([0, 2, 1, 1, 0xC1, 1, 0xBC, 5, 0, 1, 0xFE, 255, 255, 255, 7, 1])
    assert stretches.unpacked(first, data) == tuple(SAID)
    assert stretches.size(SAID[1:4]) == 7


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x01",
        b"\x01\x01",
        b"\x00\x00",
        b"\x01\x00\x01",
        b"\x01\x01\x00",
        b"\x01\x01\x05",
        b"\x02\x01\x02\x01\x02",
        b"\x80\x00",
        b"\x01\x01\x81",
        b"\x01\xff\xff\xff\xff\xff\xff\x01\x01",
    ],
)
def test_what_nobody_says_is_refused(data: bytes) -> None:
    """Of a log of ten entries, of which five are there and at most four can lie beyond a gap."""
    with pytest.raises(ValueError):
        stretches.unpacked(rows(3, 5, 10), data)


def test_rows_that_do_not_follow_each_other_are_not_said() -> None:
    for beyond in ((4, 6), (8, 7)):
        with pytest.raises(ValueError, match="out of order"):
            stretches.packed(rows(3, 5, 10, beyond))


def test_a_log_is_named_once() -> None:
    with pytest.raises(ValueError, match="twice"):
        stretches.unpacked([*rows(3, 5, 10), *rows(3, 6, 10)], b"\x00\x00")


def test_a_stretch_may_end_where_the_log_does() -> None:
    found = stretches.unpacked(rows(3, 5, 10), b"\x01\x01\x04")
    assert found[1] == LogState(3, 7, 6, 10, 10)


def test_any_bytes_give_rows_in_order_or_a_value_error() -> None:
    chance, read = random.Random(1), 0
    for _ in range(3_000):
        data = bytes(chance.choice((0, 1, 2, 3, 128, 255)) for _ in range(chance.randrange(8)))
        first = [*rows(3, 5, 300), *rows(4, 9, 9)]
        try:
            found = stretches.unpacked(first, data)
        except ValueError:
            continue
        read += 1
        assert stretches.packed(found) == (first, data)
        assert all(a.complete < b.first for a, b in pairwise(found[:-1]))
    assert read >= 5
