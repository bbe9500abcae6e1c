"""Rows by their time: the same in any order, bounded in blocks, and honest about changes."""

from __future__ import annotations

import random

import numpy as np
import pytest

from drslamd.slam.graph import timed_rows
from drslamd.slam.graph.timed_rows import BLOCK, HELD_BLOCKS, LATELY, NEVER, WAITING, TimedRows

Rows = list[list[float]]


def filled(rows: Rows, most: int = 1_000, looked: float = 0.0, seed: int = 0) -> TimedRows:
    """A table into which rows came one by one, while somebody looked now and then."""
    table, chance = TimedRows(3, identity=2, most=most), random.Random(seed)
    for row in rows:
        table.add(row)
        if chance.random() < looked:
            assert len(table.rows) <= most
    return table


def some_rows(seed: int, count: int, last: int) -> Rows:
    """Rows all over the samples 0 .. last, some of them with one identity and other values."""
    rng = np.random.default_rng(seed)
    columns = rng.integers(0, last + 1, count), rng.integers(0, 3, count), rng.normal(size=count)
    rows: Rows = np.stack(columns, axis=-1).tolist()
    return rows


def expected(rows: Rows, most: int) -> Rows:
    """Worked out anew: smallest of each identity, then the newest blocks that fit."""
    best: dict[tuple[float, float], float] = {}
    for n, name, value in rows:
        best[n, name] = min(value, best.get((n, name), np.inf))
    newest = max(int(row[0]) for row in rows) // BLOCK
    first = max(newest - HELD_BLOCKS + 1, 0)
    while sum(key[0] >= first * BLOCK for key in best) > most:
        first += 1
    return [[*key, best[key]] for key in sorted(best) if key[0] >= first * BLOCK]


@pytest.mark.parametrize(
    ("last", "most"),
    [
        (3 * BLOCK, 1_000),
        (3 * BLOCK, 150),
        (2 * HELD_BLOCKS * BLOCK, 1_000),
        (2 * HELD_BLOCKS * BLOCK, 40),
    ],
)
def test_what_is_held_does_not_depend_on_the_order_in_which_it_came(last: int, most: int) -> None:
    rows = some_rows(1, 300, last)
    wanted = expected(rows, most)
    assert 5 < len(wanted) < 300
    shuffle = random.Random(2)
    for turn in range(10):
        shuffle.shuffle(rows)
        table = filled([*rows, *rows[:50]], most, looked=0.2, seed=turn)
        assert table.rows.tolist() == wanted
        assert table.between(0, NEVER).tolist() == wanted


def test_a_table_that_is_full_gives_up_whole_blocks() -> None:
    """Three rows in the first block, then one more than fits."""
    rows: Rows = [
        [0, 0, 0],
        [1, 0, 0],
        [BLOCK - 1, 0, 0],
        *([BLOCK, float(k), 0] for k in range(7)),
    ]
    assert len(filled(rows, most=10).rows) == 10
    assert filled([*rows, [BLOCK, 7, 0]], most=10).rows[:, 0].tolist() == [BLOCK] * 8
    late = filled([*rows, [BLOCK, 7, 0], [2, 0, 0]], most=10)
    assert late.rows[:, 0].tolist() == [BLOCK] * 8


@pytest.mark.parametrize(("blocks", "held"), [(HELD_BLOCKS - 1, 2), (HELD_BLOCKS, 1)])
def test_what_is_older_than_nine_hours_is_given_up(blocks: int, held: int) -> None:
    assert len(filled([[BLOCK - 1, 0, 0], [blocks * BLOCK, 0, 0]]).rows) == held


def test_rows_that_nobody_looks_at_are_bounded_too() -> None:
    table = TimedRows(2, identity=1, most=1_000)
    for n in range(5_000):
        table.add([float(n), 0.0])
        assert table._waiting < WAITING
    first = (4_999 - 1_000) // BLOCK + 1
    assert table.rows[:, 0].tolist() == list(range(first * BLOCK, 5_000))


@pytest.mark.parametrize(
    ("first", "end"), [(0, NEVER), (5, 6), (BLOCK - 1, BLOCK + 1), (7, 7), (BLOCK, 9 * BLOCK)]
)
def test_a_part_is_what_lies_between_its_ends(first: int, end: int) -> None:
    table = filled(some_rows(3, 400, 4 * BLOCK))
    rows = table.rows
    inside = (rows[:, 0] >= first) & (rows[:, 0] < end)
    assert np.array_equal(table.between(first, end), rows[inside])


def test_a_part_belongs_to_whoever_asked_for_it() -> None:
    table = filled(some_rows(4, 50, BLOCK))
    table.between(0, NEVER)[:] = -1.0
    assert (table.rows[:, 0] >= 0).all()


def test_parts_are_the_same_until_something_is_added_to_them() -> None:
    table = filled([[n, 0.0, 0.0] for n in range(0, 5 * BLOCK, BLOCK // 2)])
    before = table.changes
    assert table.is_same(before, 0, NEVER)
    assert table.unchanged_before(before) == NEVER
    table.add([2.0 * BLOCK + 1, 0.0, 0.0])
    assert table.changed_since(before) == [2]
    assert table.unchanged_before(before) == 2 * BLOCK + 1
    assert table.is_same(before, 0, 2 * BLOCK + 1)
    assert not table.is_same(before, 0, 2 * BLOCK + 2)
    assert not table.is_same(before, 3 * BLOCK - 1, NEVER)
    assert table.is_same(before, 3 * BLOCK, NEVER)
    assert table.is_same(table.changes, 0, NEVER)


def test_of_many_changes_their_blocks_are_known() -> None:
    """What is asked for now and then is not told to the sample."""
    table = filled([[n, 0.0, 0.0] for n in range(0, 5 * BLOCK, BLOCK // 2)])
    before = table.changes
    for k in range(LATELY):
        table.add([4.0 * BLOCK + 9 - (k == 3), k, 0.0])
    assert table.unchanged_before(before) == 4 * BLOCK + 8
    for k in range(LATELY):
        table.add([4.0 * BLOCK + 9, LATELY + k, 0.0])
    assert table.unchanged_before(before) == 4 * BLOCK
    assert not table.is_same(before, 4 * BLOCK, 4 * BLOCK + 1)
    assert table.is_same(before, 0, 4 * BLOCK)


def test_what_is_dropped_has_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timed_rows, "HELD_BLOCKS", 3)
    table = filled([[n, 0.0, 0.0] for n in range(0, 3 * BLOCK, BLOCK)])
    before = table.changes
    table.add([3.0 * BLOCK, 0.0, 0.0])
    assert not table.is_same(before, 0, 1)
    assert table.is_same(before, BLOCK, 3 * BLOCK)
    assert table.unchanged_before(before) == 0
    assert table.floor == 1
