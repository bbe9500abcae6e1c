"""How much surer robots are of themselves and of each other than configured."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_problems import BIAS, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.banded_solver import solve
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.pairs import narrowing
from drslamd.slam.optimizer.banded.pairs.narrowing import (
    LEAST_FEARED,
    LEAST_SHARE,
    MOST_POSES,
    held_variances,
    may_narrow,
    narrower,
    seen_noise,
    shares,
)
from drslamd.slam.optimizer.bias_prior import BiasPrior
from drslamd.slam.optimizer.problem import Freed
from drslamd.slam.optimizer.sensor_priors import Calibration

FIVE = 8.5
"""Ranges, one a second, whose squares say as much as five independent ones: 1.7 each."""


def test_a_pair_is_held_at_the_others_and_those_at_what_is_configured() -> None:
    squares, expected = np.array([10.0, 50.0]), np.array([40.0, 100.0])
    unsure = 1 + math.sqrt(3.4 / (FIVE + 140))
    others = (FIVE + 50) / (FIVE + 100), (FIVE + 10) / (FIVE + 40)
    right = [
        unsure * (FIVE * other + s) / (FIVE + e)
        for other, s, e in zip(others, squares, expected, strict=True)
    ]
    assert held_variances(squares, expected) == pytest.approx(right)


@pytest.mark.parametrize(
    ("ranges", "least", "most"), [(0, 1.6, 1.7), (30, 0.5, 0.6), (900, 0.25, 0.3)]
)
def test_nothing_is_narrowed_on_the_word_of_a_few_ranges(
    ranges: int, least: float, most: float
) -> None:
    """Of one pair, whose ranges have a quarter of the variance that is configured."""
    (found,) = held_variances(np.array([ranges / 4]), np.array([float(ranges)]))
    assert least < found < most


def test_a_pair_alone_counts_its_ranges_once() -> None:
    (found,) = held_variances(np.array([0.0]), np.array([FIVE]))
    assert found == pytest.approx((1 + math.sqrt(3.4 / (2 * FIVE))) / 2)


def wide(seed: int, count: int) -> Array:
    root = np.random.default_rng(seed).normal(0, 0.1, (3 * count, 3 * count))
    return np.asarray(root @ root.T)


def in_each_other(one: Array, other: Array, joint: Array) -> Array:
    """(3, 3) covariance of other in one, by differences."""

    def seen(ends: Array) -> Array:
        a, b = ends[:3], ends[3:]
        away = np.exp(-1j * a[2]) * complex(b[0] - a[0], b[1] - a[1])
        return np.array([away.real, away.imag, b[2] - a[2]])

    ends, nudge = np.concatenate([one, other]), 1e-6 * np.eye(6)
    j = np.array([(seen(ends + d) - seen(ends - d)) / 2e-6 for d in nudge]).T
    return np.asarray(j @ joint @ j.T)


def test_what_is_left_is_the_mean_over_all_directions_of_one_in_the_other() -> None:
    poses = np.array([[1.0, 2.0, 0.5], [-3.0, 4.0, -2.5], [0.5, 0.0, 3.0]])
    claimed = wide(1, 3) + 0.02 * np.eye(9)
    seen = 0.4 * claimed + 0.1 * wide(2, 3)
    found = shares(poses, claimed, seen)
    for a, b in ((0, 1), (0, 2), (1, 2)):
        at = np.r_[3 * a : 3 * a + 3, 3 * b : 3 * b + 3]
        before, after = (
            in_each_other(poses[a], poses[b], joint[np.ix_(at, at)]) for joint in (claimed, seen)
        )
        right = np.trace(np.linalg.inv(before) @ after) / 3
        assert found[a, b] == found[b, a] == pytest.approx(right, rel=1e-6)
        assert 0.4 < right < 1


@pytest.mark.parametrize(
    ("times", "left"), [(3.0, 1.0), (1.0, 1.0), (0.5, 0.5), (0.25, 0.25), (0.01, LEAST_SHARE)]
)
def test_nobody_is_claimed_wider_than_he_is_nor_as_known_for_sure(
    times: float, left: float
) -> None:
    claimed = wide(3, 2)
    found = shares(np.zeros((2, 3)), claimed, times * claimed)
    assert found[0, 1] == pytest.approx(left)


def test_of_one_pose_there_is_no_pair() -> None:
    assert shares(np.zeros((1, 3)), np.eye(3), np.eye(3)).tolist() == [[1.0]]


def test_each_pose_alone_is_narrowed_by_the_direction_of_which_least_more_is_known() -> None:
    """Whatever it has to do with the others; never below a fifth."""
    claimed = wide(4, 2)
    seen = claimed.copy()
    root = np.linalg.cholesky(claimed[:3, :3])
    seen[:3, :3] = root @ np.diag([0.2, 0.5, 0.8]) @ root.T
    seen[3:, 3:] *= 0.1
    found = shares(np.zeros((2, 3)), claimed, seen)
    assert found.diagonal() == pytest.approx([0.8, LEAST_SHARE])


@pytest.mark.parametrize("wrong", [0.0, -1e-3])
def test_nothing_is_narrowed_by_what_rounding_has_left_no_covariance(wrong: float) -> None:
    claimed = np.diag([wrong, 1.0, 1.0, 1.0, 1.0, 1.0])
    assert shares(np.zeros((2, 3)), claimed, 0.5 * np.eye(6)).diagonal().tolist() == [1.0, 0.5]


def test_poses_are_named_by_their_robot_and_pairs_by_both() -> None:
    left = np.array([[0.3, 0.5, 0.6], [0.5, 1.0, 0.7], [0.6, 0.7, 0.4]])
    assert narrower([5, 9, 2], left) == {
        (5,): 0.3,
        (2,): 0.4,
        (5, 9): 0.5,
        (2, 5): 0.6,
        (2, 9): 0.7,
    }
    assert narrower([5, 9, 2], np.ones((0, 0))) == {}


def test_ranges_and_odometry_that_are_better_than_configured_are_seen_to_be() -> None:
    problem, _ = team_problem(5, robots=3, count=60, range_error=0.02)
    equations = Equations(problem)
    point = descend(equations, Calibration.zero(problem.pairs, 3), 60)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    ratio, biases = np.array([0.02, 0.5, 1.7]), np.array([0.1, 0.2, 0.3])
    seen = seen_noise(equations, point, factor, ratio, biases)
    assert seen is not None
    # errors of this problem are white, of which more is left than of slow ones; a third as large
    # as sent, held at that
    assert ((seen.scatter > 0.4) & (seen.scatter < 0.8)).all()
    assert seen.feared.tolist() == [LEAST_FEARED, 0.5, 1.7]
    # of Student's distribution with three degrees of freedom, 0.3 m wide, and three pairs
    own = point.calibration.bias - point.calibration.team_bias
    squares = 3 * 0.3**2 + float(own @ own) + 0.1**2 + 0.2**2 + 0.3**2
    assert seen.own_bias == pytest.approx(math.sqrt(squares / 4))
    assert seen.of_biases(problem).priors.bias == replace(BIAS, own_sigma=seen.own_bias)


def told(range_error: float, robots: int = 3, count: int = 40, link_error: float = 1.0) -> Array:
    problem, _ = team_problem(
        5, robots=robots, count=count, range_error=range_error, link_error=link_error
    )
    last = tuple(range(len(problem.n) - robots, len(problem.n)))
    return solve(problem, marginals=last).shares


def test_robots_are_surer_where_sensors_are_better_and_not_where_they_are_as_configured() -> None:
    """Of each other, and of where they are."""
    better, usual = told(0.01), told(0.065)
    assert (better < 0.82).all()
    assert (usual > 0.85).all()


def test_pairs_are_narrower_where_biases_of_a_team_are_alike(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alike = told(0.01)
    monkeypatch.setattr(BiasPrior, "seen_variance", lambda *_: math.inf)
    pairs = np.triu_indices(3, 1)
    assert (alike[pairs] < told(0.01)[pairs]).all()


def test_a_model_that_is_not_one_of_what_was_measured_narrows_nobody() -> None:
    assert not len(told(0.01, robots=2, count=12, link_error=6.0))


def test_nor_one_in_which_wheels_may_have_stood_nor_a_single_robot_nor_a_large_team() -> None:
    problem, _ = team_problem(5, robots=2, count=4)
    for poses, may in ((1, False), (2, True), (MOST_POSES, True), (MOST_POSES + 1, False)):
        assert may_narrow(problem, poses) is may
    freed = Freed(0, np.array([1]), np.zeros((1, 3, 3)), stands=True)
    assert not may_narrow(replace(problem, freed=(freed,)), 2)


def test_nor_is_a_large_team_narrowed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert MOST_POSES == 12
    monkeypatch.setattr(narrowing, "MOST_POSES", 2)
    assert len(told(0.01, robots=2)) == 2
    assert not len(told(0.01, robots=3))


def test_nor_where_the_matrix_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(narrowing, "expected_squares", lambda *_: None)
    assert not len(told(0.01))


def test_poses_and_their_covariances_are_those_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, _ = team_problem(5, robots=2, count=40, range_error=0.01)
    found = solve(problem, marginals=(78, 79))
    monkeypatch.setattr(narrowing, "MOST_POSES", 0)
    plain = solve(problem, marginals=(78, 79))
    assert np.array_equal(found.joint, plain.joint)
    assert np.array_equal(found.poses, plain.poses)
