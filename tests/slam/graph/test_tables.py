"""Rows in the order of their keys, and columns by their names."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.slam.graph import tables
from drslamd.slam.graph.tables import KeyedRows, KeyframeTable, RangeTable, positions


@pytest.mark.parametrize("count", [29, 30, 31, 75])
def test_rows_keep_the_last_ones_in_the_order_of_their_keys(count: int) -> None:
    shuffled = np.random.default_rng(2).permutation(count)
    for looked in (False, True):
        rows = KeyedRows(2, 30)
        for key in shuffled:
            rows.add([float(key), -float(key)])
            if looked:
                assert len(rows.data) <= 30
        assert rows.data[:, 0].tolist() == list(range(max(0, count - 30), count))
        assert np.array_equal(rows.data[:, 0], -rows.data[:, 1])


def test_rows_that_nobody_looks_at_are_bounded_too() -> None:
    rows = KeyedRows(2, 100)
    for key in range(5_000):
        rows.add([float(key), 0.0])
        assert len(rows._new) < tables.WAITING
    assert len(rows.data) == 100


def test_of_rows_with_one_key_the_smallest_counts_whichever_came_first() -> None:
    for values in ((5.0, 3.0, 4.0), (3.0, 4.0, 5.0)):
        rows = KeyedRows(2, 10)
        for value in values:
            rows.add([7.0, value])
            assert len(rows.data) == 1
        assert rows.data.tolist() == [[7.0, 3.0]]


def test_rows_are_the_same_array_until_something_was_added() -> None:
    rows = KeyedRows(2, 10)
    rows.add([1.0, 0.0])
    before = rows.data
    assert rows.data is before
    rows.add([2.0, 0.0])
    assert rows.data is not before


def test_rows_that_replace_others_are_all_there_is() -> None:
    rows = KeyedRows(2, 10)
    rows.add([1.0, 0.0])
    rows.replace(np.array([[3.0, 1.0], [4.0, 2.0]]))
    rows.add([2.0, 9.0])
    assert rows.data.tolist() == [[2.0, 9.0], [3.0, 1.0], [4.0, 2.0]]


def test_positions_are_those_of_values_that_are_there() -> None:
    at, there = positions(np.array([10.0, 20.0, 30.0]), np.array([30.0, 9.0, 20.0, 31.0, 25.0]))
    assert there.tolist() == [True, False, True, False, False]
    assert at[there].tolist() == [2, 1]


def test_in_an_empty_table_nothing_is_found() -> None:
    _, there = positions(np.zeros(0), np.array([1.0, 2.0]))
    assert there.tolist() == [False, False]


FRAMES = KeyframeTable(
    np.array([[10, 0, 1, 2, 3], [20, 0, 4, 5, 6], [30, 2, 7, 8, 9]], dtype=float)
)


def test_a_keyframe_has_its_number_its_segment_and_its_pose() -> None:
    assert len(FRAMES) == 3
    assert FRAMES.n.tolist() == [10, 20, 30]
    assert FRAMES.segment.tolist() == [0, 0, 2]
    assert FRAMES.poses.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    assert FRAMES.chosen(np.array([False, True, True])).n.tolist() == [20, 30]


def test_a_segment_is_a_block_of_rows_and_one_that_is_not_there_is_empty() -> None:
    assert [len(FRAMES.chosen(FRAMES.of_segment(s))) for s in (0, 1, 2, 3)] == [2, 0, 1, 0]


def test_a_range_is_read_as_it_was_written() -> None:
    rows = [
        RangeTable.row(5, 10, 11, (0.1, 0.2), (0.3, 0.4), 6.0, 0.07),
        RangeTable.row(6, 20, 21, (0.5, 0.6), (0.7, 0.8), 7.0, 0.08),
    ]
    table = RangeTable(np.array(rows))
    assert table.a_n.tolist() == [10, 20]
    assert table.b_n.tolist() == [11, 21]
    assert table.q_a.tolist() == [[0.1, 0.2], [0.5, 0.6]]
    assert table.q_b.tolist() == [[0.3, 0.4], [0.7, 0.8]]
    assert table.range_m.tolist() == [6.0, 7.0]
    assert table.sigma_m.tolist() == [0.07, 0.08]
    assert table.chosen(np.array([1])).range_m.tolist() == [7.0]


def test_a_copy_may_be_written_to() -> None:
    table = RangeTable(np.array([RangeTable.row(5, 10, 11, (0, 0), (0, 0), 6.0, 0.07)]))
    table.copy().sigma_m[0] = 9.0
    assert table.sigma_m.tolist() == [0.07]
