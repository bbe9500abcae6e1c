"""Which few poses take part in many edges."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.slam.optimizer.vertex_cover import vertex_cover


def test_the_busiest_come_first_and_no_more_than_asked_for() -> None:
    i, j = np.array([1, 1, 1, 2, 2, 3]), np.array([4, 5, 6, 4, 5, 9])
    assert vertex_cover(i, j, 1).tolist() == [1]
    assert vertex_cover(i, j, 2).tolist() == [1, 2]
    assert len(vertex_cover(i, j, 10)) == 3
    assert vertex_cover(i[:0], j[:0], 5).tolist() == []


@pytest.mark.parametrize("seed", range(5))
def test_every_edge_has_one_of_them_when_there_may_be_enough(seed: int) -> None:
    i, j = np.random.default_rng(seed).integers(0, 30, (2, 60))
    chosen = vertex_cover(i, j, 30)
    assert (np.isin(i, chosen) | np.isin(j, chosen)).all()
    assert (np.diff(chosen) > 0).all()


def test_a_star_is_covered_by_its_middle() -> None:
    assert vertex_cover(np.full(9, 20), np.arange(9), 5).tolist() == [20]


def test_of_poses_that_are_equally_busy_the_lowest_is_taken() -> None:
    i, j = np.array([8, 3]), np.array([5, 9])
    assert vertex_cover(i, j, 1).tolist() == [3]
