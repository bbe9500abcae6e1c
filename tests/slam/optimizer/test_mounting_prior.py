"""What is believed of tracks and antennas: costs by their formula, derivatives by differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from dense_problems import curvature_of
from slam_scenes import Array

from drslamd.slam.optimizer.bias_prior import WEIGHT, WHOLE
from drslamd.slam.optimizer.mounting_prior import ANTENNA, TRACK, MountingPrior

PRIOR = MountingPrior(width=0.1, most=0.8)


def test_one_component_costs_as_cauchy_and_the_tails_of_gauss_say() -> None:
    """0.3 is three half widths; others add up."""
    assert PRIOR.cost(np.zeros((2, 1))) == 0
    expected = math.log(10) + (0.3 / 0.8) ** 2
    assert PRIOR.cost(np.array([[0.3]])) == pytest.approx(expected)
    assert PRIOR.cost(np.array([[0.3], [-0.3], [0.0]])) == pytest.approx(2 * expected)


def test_two_components_cost_by_their_length_alone() -> None:
    expected = 1.5 * math.log(1 + 25) + (0.5 / 0.8) ** 2
    for angle in (0.0, 0.7, 2.0, -1.5):
        value = 0.5 * np.array([[math.cos(angle), math.sin(angle)]])
        assert PRIOR.cost(value) == pytest.approx(expected)
    # an antenna that is off by x and y is one thing, and cheaper than two
    apart = 2 * PRIOR.cost(np.array([[0.5 / math.sqrt(2)]]))
    assert expected < apart


@pytest.mark.parametrize("times", [0.0, 0.3, 1.0, 7.0])
@pytest.mark.parametrize("components", [1, 2])
def test_the_pull_is_half_the_derivative_of_the_cost(times: float, components: int) -> None:
    rng, h = np.random.default_rng(1), 1e-6
    values = times * PRIOR.width * rng.normal(size=(3, components))
    pull = PRIOR.pull(values)
    assert pull.shape == values.shape
    for row in range(3):
        for part in range(components):
            step = np.zeros_like(values)
            step[row, part] = h
            slope = (PRIOR.cost(values + step) - PRIOR.cost(values - step)) / (2 * h)
            assert pull[row, part] == pytest.approx(slope / 2, rel=1e-6, abs=1e-6)


def hessian(prior: MountingPrior, value: Array) -> Array:
    """Half the second derivative of the cost of one value, by differences."""
    return curvature_of(lambda v: prior.cost(v[None]), value, 1e-3 * prior.width)


def off(times: float, components: int) -> Array:
    """A value so many half widths off."""
    direction = np.array([0.6, -0.8])[:components]
    return np.asarray(times * PRIOR.width * direction / np.linalg.norm(direction))


@pytest.mark.parametrize("times", [0.0, 0.5, 0.9, 0.91, 3.0])
@pytest.mark.parametrize("components", [1, 2])
def test_the_curvature_is_that_of_the_cost_outwards_down_to_a_tenth_of_its_weight(
    times: float, components: int
) -> None:
    """(1 - t^2) / (1 + t^2) meets a tenth at 0.9045 half widths; sideways all of it counts."""
    value = off(times, components)
    away = value / np.linalg.norm(value) if times else np.eye(components)[0]
    whole, tails = hessian(PRIOR, value), PRIOR.most**-2
    weight = (1 + components) / 2 / (PRIOR.width**2 * (1 + times**2))
    (found,) = PRIOR.curvature(value[None])
    outwards = float(away @ found @ away)
    bent = float(away @ whole @ away)
    assert outwards == pytest.approx(bent if times < 0.9045 else weight / 10 + tails, rel=1e-4)
    assert outwards >= bent * (1 - 1e-4)
    if components == 2:
        side = np.array([-away[1], away[0]])
        assert float(side @ found @ side) == pytest.approx(weight + tails, rel=1e-6)
        assert float(side @ whole @ side) == pytest.approx(weight + tails, rel=1e-4)
        assert float(side @ found @ away) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("times", [0.0, 0.7, 4.0])
def test_near_a_minimum_it_is_the_second_derivative_and_far_away_the_square_that_pulls_so(
    times: float,
) -> None:
    value = off(times, 2)
    (whole,) = PRIOR.curvature(value[None], WHOLE)
    assert np.allclose(whole, hessian(PRIOR, value), rtol=1e-4, atol=1e-3)
    (square,) = PRIOR.curvature(value[None], WEIGHT)
    assert np.allclose(square @ value, PRIOR.pull(value[None])[0], rtol=1e-12)
    assert np.allclose(square, square[0, 0] * np.eye(2))


def test_the_curvature_stays_positive_definite_however_far_off() -> None:
    far = np.array([[0.2, 0.1], [2.0, -1.0], [1e3, 1e3]])
    assert (np.linalg.eigvalsh(PRIOR.curvature(far)) >= PRIOR.most**-2).all()


@pytest.mark.parametrize(
    ("prior", "usual", "far"), [(TRACK, 0.01, 0.5), (ANTENNA, 0.02, 0.5)], ids=["track", "antenna"]
)
def test_a_percent_of_track_and_two_centimetres_of_antenna_are_usual_and_half_of_one_is_much(
    prior: MountingPrior, usual: float, far: float
) -> None:
    """Beyond half a metre, or half of a track, it is Gauss who counts."""
    heads = prior.cost(np.array([[usual]]))
    assert heads == pytest.approx(math.log(2), abs=0.002)
    # as many sigmas of Gauss as half of one is, and a head that hardly grows
    growth = prior.cost(np.array([[3 * far]])) - prior.cost(np.array([[far]]))
    assert growth == pytest.approx(9 - 1 + 2 * math.log(3), abs=0.01)


def test_of_nobody_nothing_is_believed() -> None:
    none = np.zeros((0, 2))
    assert PRIOR.cost(none) == 0
    assert PRIOR.pull(none).shape == (0, 2)
    assert PRIOR.curvature(none).shape == (0, 2, 2)
