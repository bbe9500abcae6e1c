"""Columns of measurements by their names, and where in them something is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from slam_scenes import closure, range_item

from drslamd.conventions import Chain
from drslamd.slam import se2
from drslamd.slam.graph.tables import (
    CLOSURE_COLUMNS,
    RANGE_COLUMNS,
    ClosureTable,
    KeyframeTable,
    RangeTable,
    positions,
)

PEER = Chain(1, 6)


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


def test_the_samples_between_two_are_a_block_of_rows() -> None:
    places = [FRAMES.between(*ends) for ends in ((0, 100), (10, 30), (11, 30), (31, 40))]
    assert [FRAMES.n[place].tolist() for place in places] == [[10, 20, 30], [10, 20], [20], []]


def test_a_range_is_read_as_it_was_written() -> None:
    one = range_item(10, PEER, 11, 6.0, (0.1, 0.2), (0.3, 0.4), 0.07)
    other = range_item(20, PEER, 21, 7.0, (0.5, 0.6), (0.7, 0.8), 0.08)
    other = replace(other, turn_a=0.9, turn_b=-1.1)
    table = RangeTable(np.array([RangeTable.row(5, one), RangeTable.row(6, other)]))
    assert table.rows.shape == (2, RANGE_COLUMNS)
    assert table.turn_a.tolist() == [0, 0.9]
    assert table.turn_b.tolist() == [0, -1.1]
    assert len(table) == 2
    assert table.place.tolist() == [5, 6]
    assert table.a_n.tolist() == [10, 20]
    assert table.b_n.tolist() == [11, 21] == table.rows[:, RangeTable.B_N].tolist()
    assert table.q_a.tolist() == [[0.1, 0.2], [0.5, 0.6]]
    assert table.q_b.tolist() == [[0.3, 0.4], [0.7, 0.8]]
    assert table.range_m.tolist() == [6.0, 7.0]
    assert table.sigma_m.tolist() == [0.07, 0.08]
    assert table.chosen(np.array([1])).range_m.tolist() == [7.0]


def test_a_copy_may_be_written_to() -> None:
    table = RangeTable(np.array([RangeTable.row(5, range_item(10, PEER, 11, 6.0, sigma=0.07))]))
    table.copy().sigma_m[0] = 9.0
    assert table.sigma_m.tolist() == [0.07]


def test_closures_come_out_one_by_one_as_they_were_written() -> None:
    upper = (0.4, 0.01, -0.02, 0.5, 0.03, 0.6)
    said = [
        replace(closure(number, 10 * number, PEER, 9, (1.0, -2.0, 3.0)), covariance=upper)
        for number in (4, 7)
    ]
    said.append(replace(said[1], number=8, kept=False, corrected=(0.1, 0.2, -0.3, 0.4)))
    table = ClosureTable(np.array([ClosureTable.row(k, c) for k, c in enumerate(said)]))
    assert table.measurements(PEER) == said
    assert table.kept().measurements(PEER) == said[:2]
    assert table.a_n.tolist() == [40, 70, 70]
    assert table.number.tolist() == [4, 7, 8]
    assert table.b_n.tolist() == [9, 9, 9] == table.rows[:, ClosureTable.B_N].tolist()
    assert table.a_T_b.tolist() == [[1.0, -2.0, 3.0]] * 3
    assert np.array_equal(table.covariance[0], se2.unpacked(upper))
    assert table.rows.shape == (3, CLOSURE_COLUMNS)
    assert table.corrected.tolist() == [[0, 0, 0, 0], [0, 0, 0, 0], [0.1, 0.2, -0.3, 0.4]]


def test_of_two_words_on_one_closure_the_row_of_the_later_is_the_smaller() -> None:
    said = closure(4, 40, PEER, 9, (1.0, -2.0, 3.0))
    withdrawn = replace(said, kept=False)
    assert ClosureTable.row(8, withdrawn) < ClosureTable.row(7, said)
    assert ClosureTable.row(9, said) < ClosureTable.row(8, withdrawn)
