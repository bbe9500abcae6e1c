"""What is believed of biases: derivatives by differences, and what the distribution is like."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import invgamma, multivariate_t
from scipy.stats import t as t_distribution
from slam_scenes import Array

from drslamd.slam.optimizer.bias_prior import (
    LEAST_CURVATURE,
    WEIGHT,
    WHOLE,
    BiasPrior,
    cauchy_curvature,
)
from drslamd.slam.range_model import RangeModel

PRIOR = BiasPrior(sigma=0.3, spread=0.08, dof=3.0, team=0.02)
POINTS = [
    (np.array([0.02, -0.03, 0.01]), 0.004),
    (np.array([0.5, -0.1, 0.02]), -0.3),
    (np.array([0.04]), 0.02),
    (np.zeros(3), 0.0),
]


def test_the_widths_are_shares_of_what_is_configured() -> None:
    model = RangeModel(spread_share=0.25, spread_dof=5.0, team_share=0.125)
    assert BiasPrior.of(0.5, model) == BiasPrior(sigma=0.5, spread=0.125, dof=5.0, team=0.0625)


@pytest.mark.parametrize("count", [1, 3, 6])
def test_what_pairs_have_of_their_own_is_of_students_distribution(count: int) -> None:
    """-2 log of scipy's density, beside Gauss's."""
    student = multivariate_t(np.zeros(count), PRIOR.spread**2 * np.eye(count), df=PRIOR.dof)
    rng = np.random.default_rng(count)
    for own in rng.normal(0, 0.2, (4, count)):
        density = -2 * (student.logpdf(own) - student.logpdf(np.zeros(count)))
        gauss = float(own @ own) / 0.3**2
        assert PRIOR.cost(own, 0.0) == pytest.approx(density + gauss)


@pytest.mark.parametrize("team", [-0.5, -0.02, 0.0, 0.1])
def test_what_is_common_has_the_cost_of_cauchy_and_gauss(team: float) -> None:
    expected = math.log(1 + (team / 0.02) ** 2) + (team / 0.3) ** 2
    assert PRIOR.cost(np.zeros(2), team) == pytest.approx(expected)


def test_without_pairs_only_what_is_common_costs() -> None:
    none = np.zeros(0)
    assert PRIOR.cost(none, 0.02) == pytest.approx(math.log(2) + (0.02 / 0.3) ** 2)
    assert PRIOR.own_pull(none).shape == (0,)
    assert PRIOR.own_curvature(none).shape == (0, 0)


@pytest.mark.parametrize(("own", "team"), POINTS)
def test_the_pull_is_half_the_derivative_of_the_cost(own: Array, team: float) -> None:
    h = 1e-6
    each = [
        (PRIOR.cost(own + h * unit, team) - PRIOR.cost(own - h * unit, team)) / (4 * h)
        for unit in np.eye(len(own))
    ]
    assert PRIOR.own_pull(own) == pytest.approx(np.array(each), rel=1e-6, abs=1e-6)
    common = (PRIOR.cost(own, team + h) - PRIOR.cost(own, team - h)) / (4 * h)
    assert PRIOR.team_pull(team) == pytest.approx(common, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("own", [POINTS[0][0], POINTS[2][0], POINTS[3][0]])
def test_near_zero_the_curvature_is_half_the_second_derivative(own: Array) -> None:
    h = 1e-6
    columns = [
        (PRIOR.own_pull(own + h * unit) - PRIOR.own_pull(own - h * unit)) / (2 * h)
        for unit in np.eye(len(own))
    ]
    assert np.allclose(PRIOR.own_curvature(own), np.stack(columns, axis=1), rtol=1e-6, atol=1e-4)


def test_where_pairs_are_far_apart_the_curvature_stays_positive() -> None:
    """Along the biases the cost bends the other way; across them its curvature is its own."""
    own = np.array([2.0, -1.0, 0.5])
    size = float(np.linalg.norm(own))
    weight = (PRIOR.dof + 3) / (PRIOR.dof * PRIOR.spread**2 + size**2)
    bends, ways = np.linalg.eigh(PRIOR.own_curvature(own))
    assert bends[0] == pytest.approx(LEAST_CURVATURE * weight + 0.3**-2)
    assert np.abs(ways[:, 0] @ own) == pytest.approx(size)
    assert bends[1:] == pytest.approx(weight + 0.3**-2)
    h = 1e-5
    along = own / size
    true = (PRIOR.own_pull(own + h * along) - PRIOR.own_pull(own - h * along)) @ along / (2 * h)
    assert true < bends[0]


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_the_curvature_is_held_only_where_it_would_fall_below_a_tenth(share: float) -> None:
    """1 - 2 s / (w + s) is 0.1 where s is 0.9 w / 1.1; w is dof spread^2."""
    width = PRIOR.dof * PRIOR.spread**2
    own = np.array([math.sqrt(share * 0.9 / 1.1 * width)])
    h = 1e-6
    true = float((PRIOR.own_pull(own + h) - PRIOR.own_pull(own - h))[0]) / (2 * h)
    held = PRIOR.own_curvature(own)[0, 0]
    if share < 1:
        assert held == pytest.approx(true, rel=1e-6)
    else:
        assert held > true * (1 + 1e-4)


@pytest.mark.parametrize("value", [0.0, 0.01, -0.017])
def test_the_curvature_of_cauchys_cost_is_half_its_second_derivative(value: float) -> None:
    h, width = 1e-5, 0.02

    def cost(v: float) -> float:
        return math.log1p((v / width) ** 2)

    true = (cost(value + h) - 2 * cost(value) + cost(value - h)) / (2 * h**2)
    assert cauchy_curvature(width, np.array([value]))[0] == pytest.approx(true, rel=1e-4)
    gauss = 0.3**-2
    assert PRIOR.team_curvature(value) == pytest.approx(true + gauss, rel=1e-4)


@pytest.mark.parametrize(("times", "share"), [(0.5, 0.6), (0.9, 0.105), (0.91, 0.1), (9, 0.1)])
def test_of_cauchys_curvature_a_tenth_is_left_however_far(times: float, share: float) -> None:
    """Of the weight 1 / (w^2 + v^2); (1 - q) / (1 + q) is 0.1 at 0.9045 widths."""
    width = np.array([0.5, 2.0])
    weight = 1 / (width**2 + (times * width) ** 2)
    assert cauchy_curvature(width, times * width) == pytest.approx(share * weight, rel=1e-3)


@pytest.mark.parametrize("own", [np.array([0.5, -0.1, 0.02]), np.array([2.0])])
def test_the_whole_curvature_is_the_second_derivative_however_negative(own: Array) -> None:
    h = 1e-6
    columns = [
        (PRIOR.own_pull(own + h * unit) - PRIOR.own_pull(own - h * unit)) / (2 * h)
        for unit in np.eye(len(own))
    ]
    found = PRIOR.own_curvature(own, WHOLE)
    assert np.allclose(found, np.stack(columns, axis=1), rtol=1e-6, atol=1e-5)
    true = (PRIOR.team_pull(0.3 + h) - PRIOR.team_pull(0.3 - h)) / (2 * h)
    assert PRIOR.team_curvature(0.3, WHOLE) == pytest.approx(true, rel=1e-5)


@pytest.mark.parametrize("own", [np.array([0.5, -0.1, 0.02]), np.zeros(2)])
def test_by_weight_the_curvature_is_that_of_a_square_with_the_same_pull(own: Array) -> None:
    held = PRIOR.own_curvature(own, WEIGHT)
    assert np.allclose(held @ own, PRIOR.own_pull(own))
    assert np.allclose(held, held[0, 0] * np.eye(len(own)))
    assert PRIOR.team_curvature(0.3, WEIGHT) * 0.3 == pytest.approx(PRIOR.team_pull(0.3))


# what it is for


def test_while_all_pairs_agree_each_is_held_tightly() -> None:
    assert PRIOR.own_curvature(np.zeros(3))[0, 0] == pytest.approx(
        (3 + 3) / (3 * 0.08**2) + 0.3**-2
    )


def test_one_pair_that_is_far_off_leaves_the_others_loose() -> None:
    """The pull on a bias of 5 cm is fourteen times weaker beside one of 0.6 m."""
    together = PRIOR.own_pull(np.array([0.05, 0.05, 0.05]))[0] - 0.05 / 0.3**2
    beside = PRIOR.own_pull(np.array([0.05, 0.05, 0.6]))[0] - 0.05 / 0.3**2
    assert together / beside == pytest.approx((3 * 0.08**2 + 0.365) / (3 * 0.08**2 + 0.0075))
    assert together / beside > 13


@pytest.mark.parametrize("metres", [3.0, 30.0])
def test_far_beyond_what_is_configured_gauss_holds_a_bias(metres: float) -> None:
    """Student and Cauchy alone would let it go: their pull falls with the distance."""
    gauss = metres / 0.3**2
    assert gauss < PRIOR.own_pull(np.array([metres, 0.0]))[0] < 1.2 * gauss
    assert gauss < PRIOR.team_pull(metres) < 1.2 * gauss


# how sure one may be


@pytest.mark.parametrize(("sigma", "width"), [(0.3, 0.02), (0.3, 0.3), (0.05, 0.001)])
def test_what_is_common_varies_as_its_distribution_does(sigma: float, width: float) -> None:
    """The density to the cost -2 log of it, integrated; Cauchy's alone has no variance."""
    prior = replace(PRIOR, sigma=sigma, team=width)

    def density(team: float) -> float:
        return math.exp(-prior.cost(np.zeros(0), team) / 2)

    knees = [0.0, width, 10 * width, sigma, 4 * sigma, 12 * sigma]
    spans = list(pairwise(sorted(knees)))
    whole = sum(quad(density, *span)[0] for span in spans)
    squares = sum(quad(lambda t: t * t * density(t), *span)[0] for span in spans)
    assert prior.team_variance == pytest.approx(squares / whole, rel=1e-3)


@pytest.mark.parametrize("count", [1, 3, 40])
def test_before_anything_is_measured_pairs_vary_as_student_does(count: int) -> None:
    """The curvature at the peak would say a sixth of that of three pairs."""
    student = t_distribution(PRIOR.dof, scale=PRIOR.spread).var()
    assert PRIOR.own_variance(np.zeros(count), np.zeros(count)) == pytest.approx(student, rel=1e-2)
    assert 1 / PRIOR.own_curvature(np.zeros(3))[0, 0] < student / 5


def test_pairs_that_are_known_tell_how_much_those_of_a_team_differ() -> None:
    """The mean of a variance whose inverse is of chi-squared, with six degrees of freedom."""
    own, surely = np.array([0.05, -0.3, 0.1]), np.full(3, 1e8)
    scale = (PRIOR.dof * PRIOR.spread**2 + float(own @ own)) / 2
    expected = invgamma((PRIOR.dof + 3) / 2, scale=scale).mean()
    assert PRIOR.own_variance(own, surely) == pytest.approx(expected, rel=1e-3)


def test_of_drawn_teams_the_pair_that_was_not_measured_is_as_far_off_as_is_said() -> None:
    """Two pairs are known to 2 cm; teams that differ much and little are told apart."""
    prior, rng = replace(PRIOR, dof=10.0, sigma=10.0), np.random.default_rng(3)
    width = prior.spread * np.sqrt(prior.dof / rng.chisquare(prior.dof, 3000))
    own = width[:, None] * rng.normal(size=(3000, 3))
    said = np.array(
        [
            prior.own_variance(np.array([*seen, 0.0]), np.array([2500.0, 2500.0, 0.0]))
            for seen in own[:, :2] + rng.normal(0, 0.02, (3000, 2))
        ]
    )
    wide = said > np.median(said)
    assert said[wide].mean() > 1.2 * said[~wide].mean()
    for some in (wide, ~wide):
        assert np.mean(own[some, 2] ** 2 / said[some]) == pytest.approx(1.0, abs=0.12)


@pytest.mark.parametrize("told", [[0.0, 0.0, 0.0], [400.0, 30.0, 0.0], [1e4, 1e4, 1e4]])
def test_a_bias_is_as_wrong_as_what_was_measured_of_it_and_of_the_others_leaves_it(
    told: list[float],
) -> None:
    """Against the inverse of the whole matrix of all biases and what they have in common."""
    own = np.array([0.05, -0.02, 0.0])
    varies = 1 / (1 / PRIOR.own_variance(own, np.array(told)) + PRIOR.sigma**-2)
    beside = np.vstack([np.eye(3), -np.ones(3)])
    information = beside @ beside.T / varies + np.diag([*told, 1 / PRIOR.team_variance])
    expected = np.sqrt(np.diag(np.linalg.inv(information)))[:3]
    assert PRIOR.sigmas(own, np.array(told)) == pytest.approx(expected)
