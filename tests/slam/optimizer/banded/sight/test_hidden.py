"""Sight that is blocked, or free again, or seen by a third, by what ranges are off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_problems import errs, team_problem

from drslamd.slam.optimizer.banded.misfit import outliers, sigmas_off
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.sight.hidden import (
    blocked,
    has_passed,
    has_witnesses,
    long_for_long,
    too_long,
)
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration


@pytest.mark.parametrize(
    ("ranges", "expected"),
    [
        ("ooooxxxxoooo", True),
        ("xxxxoooo", True),
        ("oooxxxoooo", False),
        ("ooooxxxxooo", False),
        ("ooooooxxxxx", False),
        ("ooooxxxxoxxxx", False),
        ("oooossssoooo", False),
    ],
)
def test_sight_was_blocked_where_it_is_free_again(ranges: str, expected: bool) -> None:
    """Too long `x`, too short `s`."""
    sigmas = np.array([{"x": 9.0, "s": -9.0}.get(c, 0.0) for c in ranges])
    assert has_passed(*errs(sigmas)) is expected


def test_ranges_that_are_too_long_are_none_the_other_way() -> None:
    problem, point = errs(np.array([2.4, 2.6, -2.6, 0.0]))
    assert too_long(problem, point).tolist() == [False, True, False, False]
    # a problem in which sight is blocked does not count them as wrong
    blocked_too = replace(problem, blocked=np.ones(3, dtype=bool))
    assert outliers(problem, point).tolist() == [False, True, True, False]
    assert outliers(blocked_too, point).tolist() == [False, False, True, False]
    assert sigmas_off(blocked_too, point) == pytest.approx([0.0, 0.0, 2.6, 0.0])


def test_pairs_with_many_ranges_that_are_too_long_are_blocked_where_that_explains_them() -> None:
    """Three of 20 of one, and two of 20 of another that also has some that are too short."""
    pair, sigmas = np.repeat([0, 1], 20), np.zeros(40)
    sigmas[[0, 5, 9, 20, 30]], sigmas[[25, 35]] = 9.0, -9.0
    problem, point = errs(sigmas, pair)
    assert blocked(problem, point).tolist() == [False] * 3
    assert blocked(replace(problem, blocked=np.ones(3, dtype=bool)), point).tolist() == [
        True,
        False,
        False,
    ]


def between_three(*pairs: str) -> tuple[Problem, Point]:
    """Ranges of robots 0 and 1, 0 and 2, 1 and 2: too long `x`, right `o` and none `-`."""
    sigmas = np.array([[9.0 if c == "x" else 0.0 for c in pair] for pair in pairs])
    problem, _ = team_problem(4, robots=3, count=sigmas.shape[1])
    nothing = Calibration.zero(3, 3)
    ranges = problem.ranges
    apart = Point.of(problem, problem.initial, nothing).sight.error
    right = ranges.measured + apart + sigmas.T.ravel() * ranges.sigma
    is_there = np.array([[c != "-" for c in pair] for pair in pairs]).T.ravel()
    problem = replace(problem, ranges=replace(ranges, measured=right).chosen(is_there))
    return problem, Point.of(problem, problem.initial, nothing)


@pytest.mark.parametrize(
    ("between", "beside", "expected"),
    [
        ("ooooxxxxxxxx", "oooooooooooo", True),
        ("oooooxxxxxxx", "oooooooooooo", False),
        ("xxxxxxxxooooooooooo", "ooooooooooooooooooo", False),
        ("oooooooooooo", "oooooooooooo", False),
        ("ooooxxxxxxxx", "oooooooxoooo", True),
        ("ooooxxxxxxxx", "oooooxoxoooo", False),
        ("ooooxxxxxxxx", "oooo-o-o-o-o", True),
        ("ooooxxxxxxxx", "oooo-o-o-o--", False),
        ("ooooxxxxxxxx", "oooooooxxxxx", False),
        ("xxxxxxxxxxxx", "xxxxoooooooo", False),
    ],
)
def test_what_came_between_two_is_seen_by_a_third_that_sees_both(
    between: str, beside: str, expected: bool
) -> None:
    right = "o" * len(between)
    assert has_witnesses(*between_three(between, beside, right)) is expected
    assert has_witnesses(*between_three(between, right, beside)) is expected


@pytest.mark.parametrize(
    ("off", "expected"),
    [
        ([8, 9, 8, 10, 8, 11, 8, 8, 17], True),
        ([8, 9, 8, 10, 8, 11, 8, 8, 0], True),
        ([8, 9, 8, 10, 8, 11, 8, 0, 0], False),
        ([4, 5, 7, 8, 9, 11, 12, 13, 14], False),
        ([14, 12, 11, 9, 8, 7, 5, 4, 4], False),
        ([8, 8, 8, 9, 10, 11, 11, 11, 11], True),
        ([8, 8, 8, 8, 10, 11, 11, 11, 11], True),
    ],
)
def test_a_wall_makes_ranges_longer_by_about_the_same(off: list[float], expected: bool) -> None:
    """Sigmas; half of those beyond 2.5, at least eight, are within 1.5 of their median."""
    problem, point = between_three("oooo" + len(off) * "x", *2 * ["oooo" + len(off) * "o"])
    ranges = problem.ranges
    is_hidden = np.flatnonzero((ranges.pair == 0) & (ranges.i >= 12))
    measured = ranges.measured.copy()
    measured[is_hidden] += (np.array(off[::-1]) - 9.0) * ranges.sigma[is_hidden]
    problem = replace(problem, ranges=replace(ranges, measured=measured))
    point = Point.of(problem, point.poses, point.calibration)
    assert has_witnesses(problem, point) is expected


def test_two_robots_alone_have_no_witness() -> None:
    assert not has_witnesses(*errs(np.array([0.0] * 4 + [9.0] * 12)))


def test_whoever_was_hidden_for_longer_than_a_burst_was_hidden_for_long() -> None:
    problem, point = between_three("oxxxxooooooo", "oxxxoxxxoooo", "oooooooooooo")
    assert long_for_long(problem, point).tolist() == [True, False, False]
