"""Rows in the order of time, never more than their bound."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.view.scene.rows import Rows


def times(rows: Rows) -> list[float]:
    return [float(v) for v in rows.values[:, 0]]


def test_rows_come_out_as_they_went_in() -> None:
    rows = Rows(1_000, 2)
    for k in range(300):
        rows.append(np.array([k, 2 * k]))
    assert np.array_equal(rows.values, [[k, 2 * k] for k in range(300)])


def test_a_full_table_drops_its_oldest_eighth() -> None:
    rows = Rows(80, 1)
    for k in range(80):
        rows.append(np.array([k]))
    assert times(rows) == list(range(80))
    rows.append(np.array([80]))
    assert times(rows) == list(range(10, 81))


@pytest.mark.parametrize(("apart", "kept"), [(1.0, [0, 1, 2, 3]), (1.01, [0, 2, 3])])
def test_the_last_row_gives_way_when_it_is_too_near_the_one_before(
    apart: float, kept: list[float]
) -> None:
    rows = Rows(100, 1)
    for k in range(4):
        rows.append(np.array([k]), apart)
    assert times(rows) == kept


def test_a_late_row_finds_its_place_and_one_of_the_same_time_is_held_already() -> None:
    rows = Rows(100, 2)
    for k in (5, 1, 3, 4, 2, 3):
        rows.insert(np.array([k, len(times(rows))]))
    assert times(rows) == [1, 2, 3, 4, 5]
    assert rows.values[2, 1] == 2


def test_inserted_rows_are_bounded_too_and_what_is_older_than_all_is_left_out() -> None:
    rows = Rows(80, 1)
    for k in range(80):
        rows.insert(np.array([k]))
    rows.insert(np.array([5.5]))
    assert times(rows) == list(range(10, 80))
    rows.insert(np.array([50.5]))
    assert times(rows) == [*range(10, 51), 50.5, *range(51, 80)]


def test_extending_beyond_the_bound_keeps_the_latest() -> None:
    rows = Rows(80, 1)
    rows.extend(np.arange(200.0)[:, None])
    assert times(rows) == list(range(120, 200))
    rows.clear()
    assert times(rows) == []
