"""Poses against their own covariance: the right side of each threshold."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lab.score import claims
from lab.score.claims import Claim


def off_by(metres: float, sigma_m: float) -> Claim:
    """A pose that is off along x, with a sigma that is largest along y."""
    covariance = np.diag([(0.5 * sigma_m) ** 2, sigma_m**2, 0.01])
    return claims.claim(np.array([metres, 0.0, 0.0]), covariance, np.zeros(3))


@pytest.mark.parametrize(
    ("metres", "sigma_m", "is_lie"),
    [(1.01, 0.32, True), (0.99, 0.32, False), (1.01, 0.34, False), (-1.01, 0.32, True)],
)
def test_a_lie_is_far_off_and_sure_of_itself(metres: float, sigma_m: float, is_lie: bool) -> None:
    assert off_by(metres, sigma_m).is_lie is is_lie


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0])
def test_the_sigma_is_that_of_the_largest_axis_however_it_lies(angle: float) -> None:
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    covariance = turn @ np.diag([0.04, 0.25, 0.01]) @ turn.T
    assert claims.claim(np.zeros(3), covariance, np.zeros(3)).sigma_m == pytest.approx(0.5)


@pytest.mark.parametrize(("sigmas", "is_inside"), [(2.44, True), (2.45, False)])
def test_the_ellipse_ends_where_it_holds_95_percent(sigmas: float, is_inside: bool) -> None:
    # exp(-r^2 / 2) of a plane's normal distribution lie beyond r sigmas
    assert (math.exp(-(sigmas**2) / 2) > 0.05) is is_inside
    claim = claims.claim(np.array([0.0, 0.1 * sigmas, 0.0]), np.eye(3) * 0.01, np.zeros(3))
    assert claim.is_inside is is_inside


def test_honest_poses_have_a_squared_error_of_one_per_degree_and_are_inside_95_times() -> None:
    rng = np.random.default_rng(1)
    root = np.array([[0.3, 0.0, 0.0], [0.1, 0.2, 0.0], [0.05, -0.1, 0.15]])
    truth = np.array([1.0, -2.0, 3.1])
    found = [
        claims.claim(truth + root @ rng.normal(size=3), root @ root.T, truth) for _ in range(4000)
    ]
    assert np.mean([c.squared / 3 for c in found]) == pytest.approx(1.0, abs=0.05)
    assert np.mean([c.is_inside for c in found]) == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize("variance", [0.0, -0.01])
def test_a_covariance_that_is_none_is_infinitely_wrong(variance: float) -> None:
    claim = claims.claim(np.zeros(3), np.diag([variance, 0.04, 0.01]), np.zeros(3))
    assert claim.squared == claim.squared_position == float("inf")
    assert not claim.is_inside


def test_a_mahalanobis_error_crosses_the_half_turn_and_leaves_its_arguments() -> None:
    pose, truth = np.array([0.0, 0.0, 3.1]), np.array([0.0, 0.0, -3.1])
    squared = claims.mahalanobis(pose, np.eye(3), truth)
    assert squared == pytest.approx((2 * np.pi - 6.2) ** 2)
    assert pose[2] == 3.1
