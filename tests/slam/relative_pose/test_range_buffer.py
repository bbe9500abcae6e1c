"""Ranges in tenths of a second, and what the strength of the first path says of them."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.conventions import GRID_US
from drslamd.slam.relative_pose.range_buffer import (
    BLOCKED_SIGMA_M,
    RangeBuffer,
    blocked_sigma,
    in_sight,
)

NLOS_DB = 10.0


def filled(*samples: tuple[float, float], nlos_db: float = NLOS_DB) -> RangeBuffer:
    """Samples (range, gap in dB) within one tenth of a second, and one after it."""
    ranges = RangeBuffer(nlos_db)
    for k, (metres, gap_db) in enumerate(samples):
        ranges.add(10 * GRID_US + 1000 * k, metres, gap_db)
    ranges.add(20 * GRID_US, 1.0)
    return ranges


@pytest.mark.parametrize(
    ("gap_db", "sigma"),
    [(-3.0, 0.0), (0.0, 0.0), (6.0, 0.0), (6.5, 0.0625), (8.0, 0.25), (9.5, 0.4375), (10.0, 0.5),
     (40.0, 0.5)],
)  # fmt: skip
def test_sigma_grows_from_likely_line_of_sight_to_likely_none(gap_db: float, sigma: float) -> None:
    assert blocked_sigma(gap_db, NLOS_DB) == pytest.approx(sigma)
    assert blocked_sigma(gap_db, 0.0) == 0.0


def test_a_threshold_of_ones_own_moves_both_ends() -> None:
    assert blocked_sigma(10.0, 14.0) == 0.0
    assert blocked_sigma(12.0, 14.0) == pytest.approx(BLOCKED_SIGMA_M / 2)


def test_in_a_tenth_of_a_second_blocked_ranges_give_way_to_any_other() -> None:
    buffer = filled((5.0, 3.0), (6.0, 11.0), (6.2, 12.0))
    assert buffer.between(0, 15 * GRID_US)[:, 1:].tolist() == [[5.0, 0.0]]


def test_where_all_are_blocked_their_median_counts_less() -> None:
    buffer = filled((6.1, 10.0), (6.0, 11.0), (6.2, 12.0))
    assert buffer.between(0, 15 * GRID_US)[:, 1:].tolist() == [[6.1, BLOCKED_SIGMA_M]]


def test_doubtful_ranges_keep_their_place_and_count_a_little_less() -> None:
    buffer = filled((5.0, 8.0), (5.2, 8.0))
    ((_, metres, sigma),) = buffer.between(0, 15 * GRID_US)
    assert metres == pytest.approx(5.1)
    assert sigma == pytest.approx(0.25)


def test_turned_off_nothing_is_blocked() -> None:
    buffer = filled((5.0, 3.0), (6.0, 30.0), (6.2, 30.0), nlos_db=0.0)
    assert buffer.between(0, 15 * GRID_US)[:, 1:].tolist() == [[6.0, 0.0]]


def test_a_known_bias_is_taken_out_of_the_ranges_alone() -> None:
    buffer = filled((5.0, 8.0))
    before = buffer.between(0, 30 * GRID_US)
    buffer.bias_m = -0.4
    assert np.allclose(buffer.between(0, 30 * GRID_US) - before, [0.0, 0.4, 0.0])


@pytest.mark.parametrize(("blocked", "left"), [(0, 10), (4, 6), (5, 5), (6, 10), (10, 10)])
def test_blocked_rows_are_left_out_while_half_remain(blocked: int, left: int) -> None:
    table = np.zeros((10, 3))
    table[:blocked, 2] = BLOCKED_SIGMA_M
    table[blocked:, 2] = 0.9 * BLOCKED_SIGMA_M
    assert len(in_sight(table)) == left
