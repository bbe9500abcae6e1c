"""What is believed of tracks and antennas: costs by their formula, derivatives by differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slam_scenes import Array

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


def bend(prior: MountingPrior, value: Array) -> float:
    """Half the second derivative of the cost, outwards."""
    h, away = 1e-4 * prior.width, value / max(float(np.linalg.norm(value)), 1e-12)
    if not away.any():
        away = np.eye(len(value))[0]
    costs = [prior.cost((value + step * away)[None]) for step in (-h, 0.0, h)]
    return (costs[0] - 2 * costs[1] + costs[2]) / (2 * h**2)


@pytest.mark.parametrize(
    ("times", "is_bent"), [(0.0, True), (0.5, True), (0.9, True), (0.91, False)]
)
@pytest.mark.parametrize("components", [1, 2])
def test_the_curvature_is_that_of_the_cost_outwards_down_to_a_tenth_of_its_weight(
    times: float, is_bent: bool, components: int
) -> None:
    """(1 - t^2) / (1 + t^2) meets a tenth at 0.9045 half widths."""
    direction = np.array([0.6, -0.8])[:components]
    value = times * PRIOR.width * direction / np.linalg.norm(direction)
    weight = (1 + components) / 2 / (PRIOR.width**2 * (1 + times**2))
    expected = bend(PRIOR, value) if is_bent else weight / 10 + PRIOR.most**-2
    assert PRIOR.curvature(value[None]) == pytest.approx([expected], rel=1e-4)
    # on the other side of that threshold the two differ
    other = weight / 10 + PRIOR.most**-2 if is_bent else bend(PRIOR, value)
    assert PRIOR.curvature(value[None])[0] > other * (1 + 1e-4)


def test_the_curvature_stays_positive_however_far_off() -> None:
    far = np.array([[0.2], [2.0], [1e3]])
    assert (PRIOR.curvature(far) >= PRIOR.most**-2).all()


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
    assert PRIOR.curvature(none).shape == (0,)
