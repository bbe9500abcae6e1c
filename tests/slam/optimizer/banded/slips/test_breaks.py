"""The end of a path laid down anew, against where it truly is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_problems import CLOCKS, held_at, stuck, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.slips.breaks import APART_M, FEWEST, piece
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

ROBOTS, COUNT = 3, 40
GONE = 20
"""Keyframe of robot 1 after which its wheels stick for so many."""
LONG = 4


def lost(seed: int, robots: int = ROBOTS, count: int = COUNT) -> tuple[Problem, Point, Array]:
    """Robot 1 stuck; of its poses after that nothing is known, the others are where they are."""
    problem, truth = team_problem(
        seed, robots=robots, count=count, range_error=0.02, link_error=0.3
    )
    problem = stuck(held_at(problem, truth), 1, GONE, GONE + LONG)
    poses = truth.copy()
    poses[(problem.robot == 1) & (problem.n > CLOCKS[1] + 10 * GONE)] += [5.0, -3.0, 1.0]
    known = Calibration.zero(problem.pairs, robots)
    return problem, Point.of(problem, poses, known), truth


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_robot_that_is_anywhere_is_laid_down_where_it_is(seed: int) -> None:
    problem, point, truth = lost(seed)
    found = piece(problem, point, 1, CLOCKS[1] + 10 * GONE)
    assert found is not None
    assert found.before == ROBOTS * GONE + 1
    # no later than its wheels turned again, and some keyframes sooner at most
    assert found.places[-1] == ROBOTS * (COUNT - 1) + 1
    assert found.places[0] <= ROBOTS * (GONE + LONG) + 1
    assert np.hypot(*(found.poses[-1] - truth[found.places[-1]])[:2]) < 0.3
    late = slice(LONG, None)
    off = found.poses[late] - truth[found.places[late]]
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.3
    assert np.abs((off[:, 2] + np.pi) % (2 * np.pi) - np.pi).max() < 0.2


def test_the_next_best_place_is_elsewhere_and_costs_more() -> None:
    problem, point, _ = lost(2)
    found = piece(problem, point, 1, CLOCKS[1] + 10 * GONE)
    assert found is not None
    assert found.margin > 0
    apart = np.abs(found.other[0] - found.poses[0])
    assert apart[:2].max() > APART_M / 2 or apart[2] > 0.4


@pytest.mark.parametrize(("after", "is_found"), [(FEWEST // 2 - 1, False), (12, True)])
def test_so_few_ranges_lay_nothing_down(after: int, is_found: bool) -> None:
    """Two partners make two a second."""
    problem, point, _ = lost(1, count=GONE + 1 + after)
    assert (piece(problem, point, 1, CLOCKS[1] + 10 * GONE) is not None) is is_found


def test_ranges_that_fit_no_path_lay_nothing_down() -> None:
    problem, point, _ = lost(1)
    rng = np.random.default_rng(1)
    noise = rng.normal(0, 1.5, len(problem.ranges))
    measured = np.abs(problem.ranges.measured + noise)
    wild = replace(problem, ranges=replace(problem.ranges, measured=measured))
    again = Point.of(wild, point.poses, point.calibration)
    assert piece(wild, again, 1, CLOCKS[1] + 10 * GONE) is None


def test_before_the_first_keyframe_nothing_is_lost() -> None:
    problem, point, _ = lost(1)
    assert piece(problem, point, 1, CLOCKS[1] - 1) is None
