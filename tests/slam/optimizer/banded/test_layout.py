"""Where each unknown stands: the band in the order of time, and the border."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dense_problems import places
from slam_problems import no_ranges, pose_edges, team_problem

from drslamd.slam.optimizer.banded.layout import NOWHERE, BandLayout, border_poses
from drslamd.slam.optimizer.problem import Doubted


def test_every_unknown_stands_somewhere_and_only_once() -> None:
    problem, _ = team_problem(6, robots=3, count=30)
    layout = BandLayout.of(problem)
    numbers = np.sort(places(layout))
    assert np.array_equal(numbers, np.arange(layout.band + layout.border))
    # links of three robots reach three poses: 3 * 3 + 2 below the diagonal
    assert layout.width == 3 * 3 + 3
    sensors = layout.calibration(np.arange(len(numbers), dtype=float))
    for name in ("bias", "scale", "yaw", "near_bias", "team_bias"):
        assert getattr(sensors, name).tolist() == getattr(layout, name).tolist()
    sizes = [len(part) for part in (layout.bias, layout.scale, layout.yaw, layout.team_bias)]
    assert sizes == [3, 3, 3, 1]


def test_a_link_depends_on_its_poses_and_on_the_wheels_of_its_robot() -> None:
    problem, _ = team_problem(6, robots=3, count=4)
    layout, links = BandLayout.of(problem), problem.odometry
    for row, i, j, robot in zip(
        layout.odometry_unknowns(links), links.i, links.j, links.robot, strict=True
    ):
        ends = [3 * i, 3 * i + 1, 3 * i + 2, 3 * j, 3 * j + 1, 3 * j + 2]
        # biases of three pairs stand before the scales of three robots and their yaw rates; turns
        # are known
        assert row.tolist() == [*ends, 36 + 3 + robot, 36 + 3 + 3 + robot, NOWHERE]


def test_mountings_in_doubt_stand_last_and_the_others_nowhere() -> None:
    problem, _ = team_problem(6, robots=3, count=4)
    doubted = Doubted(np.array([False, True, True]), np.array([True, False, True]))
    problem = replace(problem, doubted=doubted)
    layout = BandLayout.of(problem)
    assert np.array_equal(np.sort(places(layout)), np.arange(layout.band + layout.border))
    # behind twelve poses, three biases, scales and yaw rates, and two constants of the team
    first = 36 + 9 + 2
    assert layout.turn.tolist() == [NOWHERE, first, first + 1]
    assert layout.antenna.tolist() == [
        [first + 2, first + 3],
        [NOWHERE] * 2,
        [first + 4, first + 5],
    ]
    assert layout.border == 11 + 6
    turns = layout.odometry_unknowns(problem.odometry)[:, 8]
    assert np.array_equal(turns, layout.turn[problem.odometry.robot])
    ranges = problem.ranges
    for row, pair, (a, b) in zip(
        layout.range_unknowns(ranges), ranges.pair, ranges.robots, strict=True
    ):
        constants = [layout.bias[pair], *layout.near_bias]
        assert row[6:].tolist() == [*constants, *layout.antenna[a], *layout.antenna[b]]
    sensors = layout.calibration(np.arange(layout.band + layout.border, dtype=float))
    assert sensors.turn.tolist() == [0, first, first + 1]
    assert sensors.antenna.tolist() == [[first + 2, first + 3], [0, 0], [first + 4, first + 5]]


def test_a_range_that_was_carried_depends_on_the_wheels_of_both_robots() -> None:
    problem, _ = team_problem(6, robots=3, count=4, is_thinned=True)
    layout, ranges = BandLayout.of(problem), problem.ranges
    plain, carried = layout.range_unknowns(ranges), layout.carried_unknowns(ranges)
    assert carried.shape == (4, 16)
    for row, m in zip(carried, ranges.carried.rows, strict=True):
        a, b = ranges.robots[m]
        wheels = [layout.yaw[a], layout.scale[a], layout.yaw[b], layout.scale[b]]
        assert row.tolist() == [*plain[m], *wheels]


def test_a_group_of_one_pose_has_a_layout() -> None:
    problem, _ = team_problem(7, robots=1, count=1, closures=0)
    layout = BandLayout.of(replace(problem, ranges=no_ranges()))
    assert (layout.band, layout.width) == (3, 3)
    # scale, yaw rate, near-range bias and what biases have in common
    assert layout.border == 4


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
    assert layout.border == 3 + len(layout.bias) + len(layout.scale) + len(layout.yaw) + 2
    assert layout.poses[9].tolist() == [3 * 79, 3 * 79 + 1, 3 * 79 + 2]
    # those after it move up, and odometry of two robots reaches two poses
    assert layout.poses[10].tolist() == [27, 28, 29]
    assert layout.width == 3 * 2 + 3


def test_ways_wider_than_the_band_or_of_poses_that_are_no_unknowns_are_left_out() -> None:
    """Poses 0 to 4 in time; the third is in the border, the last is none."""
    problem = team_problem(2, robots=2, count=3)[0]
    number = np.array([0, 4, 15, 1, 2, NOWHERE])
    poses = np.where(number[:, None] == NOWHERE, NOWHERE, 3 * number[:, None] + np.arange(3))
    layout = BandLayout.placed(problem, poses, band=15, outside=33, width=9)
    which = (layout.ways() != NOWHERE).all(axis=1)
    # (0 and 4 are three poses too far apart)
    assert which.tolist() == [False, True, True, True, False]
    assert (layout.ways()[~which] == NOWHERE).all()
    wider = replace(layout, width=15)
    assert (wider.ways()[0] == [0, 1, 2, 12, 13, 14]).all()
