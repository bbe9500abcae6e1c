"""Where each unknown stands: the band in the order of time, and the border."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_problems import no_ranges, pose_edges, team_problem

from drslamd.slam.optimizer.banded.layout import BandLayout, border_poses


def test_every_unknown_stands_somewhere_and_only_once() -> None:
    problem, _ = team_problem(6, robots=3, count=30)
    layout = BandLayout.of(problem)
    parts = [layout.poses.ravel(), layout.bias, layout.scale, layout.yaw, layout.near_bias]
    numbers = np.sort(np.concatenate(parts))
    assert np.array_equal(numbers, np.arange(layout.band + layout.border))
    # links of three robots reach three poses: 3 * 3 + 2 below the diagonal
    assert layout.width == 3 * 3 + 3
    step = np.arange(len(numbers), dtype=float)
    assert layout.calibration(step).scale.tolist() == layout.scale.tolist()


def test_a_group_of_one_pose_has_a_layout() -> None:
    problem, _ = team_problem(7, robots=1, count=1, closures=0)
    problem = replace(problem, ranges=no_ranges())
    layout = BandLayout.of(problem)
    assert (layout.band, layout.width) == (3, 3)


@pytest.mark.parametrize(("reach", "apart"), [(20, 0), (21, 1)])
def test_poses_are_taken_out_only_beyond_the_reach_that_needs_no_attention(
    reach: int, apart: int
) -> None:
    i = np.array([0, 1, 2, 50])
    assert len(border_poses(i, i + [1, 1, 1, reach], narrow=20)) == apart


def test_the_pose_of_one_who_stands_is_enough_for_all_its_edges() -> None:
    i, j = np.full(500, 7), np.arange(500)
    assert border_poses(i, j, narrow=20).tolist() == [7]


def test_what_is_left_in_the_band_is_narrow_and_few_are_at_the_border() -> None:
    rng = np.random.default_rng(8)
    i = np.arange(1000)
    j = np.minimum(i + rng.integers(1, 6, 1000), 999)
    hubs = rng.choice(1000, 12, replace=False)
    i = np.concatenate([i, np.repeat(hubs, 40)])
    j = np.concatenate([j, rng.integers(0, 1000, 480)])
    apart = border_poses(i, j, narrow=20)
    assert set(apart.tolist()) <= set(hubs.tolist())
    left = ~np.isin(i, apart) & ~np.isin(j, apart)
    assert np.abs(i - j)[left].max() <= 20


def test_edges_all_over_the_place_widen_the_band_instead() -> None:
    rng = np.random.default_rng(9)
    i, j = rng.integers(0, 300, (2, 2000))
    apart = border_poses(i, j, narrow=20)
    left = ~np.isin(i, apart) & ~np.isin(j, apart)
    reach = int(np.abs(i - j)[left].max(initial=0))
    assert len(apart) <= 160
    assert reach <= 320


def test_poses_at_the_border_stand_behind_the_band() -> None:
    """One pose that all others are joined to."""
    problem, _ = team_problem(3, robots=2, count=40, closures=0)
    far = [(9, k) for k in range(40, 80, 7)]
    edges = pose_edges(np.random.default_rng(4), problem.initial, far, (0.05, 0.05, 0.03))
    layout = BandLayout.of(replace(problem, closures=edges))
    assert layout.band == 3 * 79
    assert layout.border == 3 + len(layout.bias) + len(layout.scale) + len(layout.yaw) + 1
    assert layout.poses[9].tolist() == [3 * 79, 3 * 79 + 1, 3 * 79 + 2]
    # those after it move up, and odometry of two robots reaches two poses
    assert layout.poses[10].tolist() == [27, 28, 29]
    assert layout.width == 3 * 2 + 3
