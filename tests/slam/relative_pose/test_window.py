"""Bins of ranges, and antennas that sit off the middle of their robots."""

from __future__ import annotations

import math
import statistics

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from slam_scenes import matrix, wander, window_of

from drslamd.slam.relative_pose.window import binned

samples = st.lists(st.tuples(st.floats(-30, 0), st.floats(0, 50)), min_size=1, max_size=60)


@given(samples, st.sampled_from([0.1, 0.5, 2.0]))
def test_each_bin_gives_the_medians_of_its_times_and_of_its_ranges(
    rows: list[tuple[float, float]], width: float
) -> None:
    t, ranges = np.array(rows).T
    bins: dict[int, list[tuple[float, float]]] = {}
    for time, metres in rows:
        bins.setdefault(math.floor(time / width), []).append((time, metres))
    expected = [
        (statistics.median(r[0] for r in b), statistics.median(r[1] for r in b), len(b))
        for _, b in sorted(bins.items())
    ]
    times, medians, counts = binned(t, ranges, width)
    assert np.allclose(np.column_stack([times, medians, counts]), expected)


@pytest.mark.parametrize("count", [4, 5])
def test_a_steady_range_has_its_median_at_the_median_time(count: int) -> None:
    t = -0.5 + 0.09 * np.arange(count)
    times, medians, counts = binned(t, 3.0 + 2.0 * t, 0.5)
    assert counts.tolist() == [count]
    assert medians[0] == pytest.approx(3.0 + 2.0 * times[0])


@pytest.mark.parametrize(("burst", "traced"), [(12, False), (13, True), (25, True)])
def test_a_burst_of_less_than_half_a_bin_leaves_no_trace(burst: int, traced: bool) -> None:
    t = -0.5 + 0.02 * np.arange(25)
    ranges = np.full(25, 4.0)
    ranges[:burst] += 1.0
    _, medians, _ = binned(t, ranges, 0.5)
    assert bool(medians[0] > 4.0) is traced


def test_empty_bins_are_left_out_and_the_order_of_arrival_is_of_no_account() -> None:
    t = np.array([-0.2, -9.9, -5.1])
    times, medians, counts = binned(t, np.array([1.0, 2.0, 3.0]), 0.5)
    assert times.tolist() == [-9.9, -5.1, -0.2]
    assert medians.tolist() == [2.0, 3.0, 1.0]
    assert counts.tolist() == [1, 1, 1]


def test_nothing_gives_nothing() -> None:
    times, medians, counts = binned(np.zeros(0), np.zeros(0), 0.5)
    assert len(times) == len(medians) == len(counts) == 0


def test_antennas_swing_with_their_robots() -> None:
    rng = np.random.default_rng(4)
    a, b = wander(rng, 12), wander(rng, 12)
    window, true = window_of(a, b, a_antenna=(0.2, -0.1), b_antenna=(-0.3, 0.25))
    assert len(window) == 12
    # the ranges were worked out in the common frame; here they are seen from a's last pose
    in_a = np.array([(matrix(true) @ [*point, 1.0])[:2] for point in window.b_points])
    assert np.allclose(np.hypot(*(in_a - window.a_points).T), window.ranges)
    assert np.allclose(window.a_points[-1], [0.2, -0.1])
    assert np.allclose(window.b_points[-1], [-0.3, 0.25])
