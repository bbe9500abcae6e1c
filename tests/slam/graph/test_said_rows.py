"""Rows that go when chapters stand for all entries that said them."""

from __future__ import annotations

import random

import pytest

from drslamd.slam.graph.said_rows import SaidRows


def a_table() -> SaidRows:
    return SaidRows(3, identity=1, most=10_000)


def say(table: SaidRows, n: int, entry: int, value: float = 1.0) -> None:
    table.say([10.0 * n, 0.0, value], entry)


def left(table: SaidRows) -> list[int]:
    return [int(row[0]) // 10 for row in table.rows]


def test_a_row_goes_with_the_last_entry_that_said_it() -> None:
    table = a_table()
    for n, entry in ((0, 0), (1, 1), (2, 2), (0, 7), (5, 9)):
        say(table, n, entry)
    assert table.replace(((0, 2), (3, 8)))
    assert left(table) == [2, 5]
    assert not table.replace(((20, 30),))
    assert table.rows.shape == table.between(0, 1_000).shape == (2, 3)
    assert table.of_block(0).shape == (2, 3)


def test_the_word_of_the_latest_entry_counts_whatever_it_says() -> None:
    for order in ((3, 8), (8, 3)):
        table = a_table()
        for entry in order:
            say(table, 0, entry, value=float(entry))
        assert table.rows[0, 2] == 8.0


def test_where_columns_choose_first_the_entry_does_not() -> None:
    table = SaidRows(3, identity=1, most=10, before=2)
    table.say([0.0, -5.0, 1.0], 5)
    table.say([0.0, -4.0, 2.0], 9)
    assert table.rows.tolist() == [[0.0, -5.0, 1.0]]


@pytest.mark.parametrize("seed", range(10))
def test_what_is_left_follows_from_what_nothing_stands_for_in_any_order(seed: int) -> None:
    """Whoever heard entries and chapters holds what somebody holds who heard the chapters only."""
    chance = random.Random(seed)
    stay = [n for n in range(2_000) if chance.random() < 0.3]
    words = [(n, n) for n in range(2_000)] + [(n, 2_000 + n // 256) for n in stay]
    one, other = a_table(), a_table()
    chance.shuffle(words)
    for n, entry in words:
        say(one, n, entry)
    for k in range(8):
        one.replace(((256 * k, min(256 * (k + 1), 2_000)),))
    for n in stay:
        say(other, n, 2_000 + n // 256)
    assert left(one) == left(other) == stay
    assert one.rows.tobytes() == other.rows.tobytes()
