"""Ranges in tenths of a second, and what the strength of the first path says of them."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.conventions import GRID_US
from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.relative_pose.range_buffer import (
    MOST_BINS,
    SPARE_BINS,
    RangeBuffer,
    TimedRanges,
)

NLOS_DB = 10.0


def filled(*samples: tuple[float, float], nlos_db: float = NLOS_DB) -> RangeBuffer:
    """Samples (range, gap in dB) within one tenth of a second, and one after it."""
    ranges = RangeBuffer(nlos_db)
    for k, (metres, gap_db) in enumerate(samples):
        ranges.add(10 * GRID_US + 1000 * k, metres, gap_db)
    ranges.add(20 * GRID_US, 1.0)
    return ranges


def values(buffer: RangeBuffer) -> list[list[float]]:
    """Range and doubt of what came in the first one and a half tenths of a second."""
    found = buffer.between(0, 15 * GRID_US)
    return [list(row) for row in zip(found.range_m, found.doubt_m, strict=True)]


def test_in_a_tenth_of_a_second_blocked_ranges_give_way_to_any_other() -> None:
    buffer = filled((5.0, 3.0), (6.0, 11.0), (6.2, 12.0))
    assert values(buffer) == [[5.0, 0.0]]


def test_where_all_are_blocked_their_median_counts_less() -> None:
    buffer = filled((6.1, 10.0), (6.0, 11.0), (6.2, 12.0))
    assert values(buffer) == [[6.1, LINKTRACK.blocked_sigma_m]]


def test_doubtful_ranges_keep_their_place_and_count_a_little_less() -> None:
    buffer = filled((5.0, 8.0), (5.2, 8.0))
    ((metres, sigma),) = values(buffer)
    assert metres == pytest.approx(5.1)
    assert sigma == pytest.approx(0.25)


def test_turned_off_nothing_is_blocked() -> None:
    buffer = filled((5.0, 3.0), (6.0, 30.0), (6.2, 30.0), nlos_db=0.0)
    assert values(buffer) == [[6.0, 0.0]]


def test_a_known_bias_is_taken_out_of_the_ranges_alone() -> None:
    buffer = filled((5.0, 8.0))
    before = buffer.between(0, 30 * GRID_US)
    buffer.bias_m = -0.4
    after = buffer.between(0, 30 * GRID_US)
    assert np.allclose(after.range_m - before.range_m, 0.4)
    assert np.array_equal(after.utime, before.utime)
    assert np.array_equal(after.doubt_m, before.doubt_m)


@pytest.mark.parametrize(("blocked", "left"), [(0, 10), (4, 6), (5, 5), (6, 10), (10, 10)])
def test_blocked_rows_are_left_out_while_half_remain(blocked: int, left: int) -> None:
    doubt = np.full(10, 0.9 * LINKTRACK.blocked_sigma_m)
    doubt[:blocked] = LINKTRACK.blocked_sigma_m
    table = TimedRanges(np.arange(10.0), np.ones(10), doubt)
    assert len(table.in_sight(LINKTRACK).utime) == left


@pytest.mark.parametrize(
    "bins", [1, MOST_BINS, MOST_BINS + 1, MOST_BINS + SPARE_BINS, 3 * MOST_BINS + 7]
)
def test_the_latest_tenths_of_a_second_are_kept_and_no_older_ones(bins: int) -> None:
    ranges = RangeBuffer()
    for k in range(bins + 1):
        ranges.add(k * GRID_US, float(k))
    found = ranges.between(-1, bins * GRID_US)
    first = max(0, bins - MOST_BINS)
    assert found.range_m.tolist() == [float(k) for k in range(first, bins + 1)]
    assert found.utime.tolist() == [float(k * GRID_US) for k in range(first, bins + 1)]
