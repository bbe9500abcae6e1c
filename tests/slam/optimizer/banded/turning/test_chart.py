"""Steps in which a team turns as a whole, against turns and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from slam_scenes import Array

from drslamd.slam.optimizer.banded.turning.chart import TurningChart, beyond

COUNT = 9


def chart(gauge: int = 4, around: int = 2) -> TurningChart:
    origin = np.random.default_rng(1).normal(size=(COUNT, 3)) * [3, 3, 1]
    return TurningChart(origin, gauge, around)


def some_step(size: float, seed: int = 2) -> Array:
    return np.random.default_rng(seed).normal(0, size, (COUNT, 3))


def turned_by(poses: Array, about: Array, angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    places = (poses[:, :2] - about) @ np.array([[cos, sin], [-sin, cos]]) + about
    return np.column_stack([places, poses[:, 2] + angle])


@pytest.mark.parametrize("around", [0, 2, 20])
def test_a_team_that_turns_keeps_its_shape_however_far_it_turns(around: int) -> None:
    for gauge in (0, 4, COUNT - 1):
        one = chart(gauge, around)
        arms = one.origin[:, :2] - one.origin[gauge, :2]
        tangent = np.column_stack([-arms[:, 1], arms[:, 0], np.ones(COUNT)])
        expected = turned_by(one.origin, one.origin[gauge, :2], 1.2)
        assert one.poses(1.2 * tangent) == pytest.approx(expected, abs=1e-12)
        assert one.own_size(1.2 * tangent) == pytest.approx(0.0, abs=1e-12)


def test_to_first_order_a_step_goes_straight_on() -> None:
    one = chart()
    away = one.poses(some_step(1e-6)) - one.origin - some_step(1e-6)
    assert np.abs(away).max() < 1e-10
    assert np.abs(one.poses(some_step(0.1)) - one.origin - some_step(0.1)).max() > 1e-3


def test_the_gauge_goes_where_it_is_told() -> None:
    one, step = chart(gauge=6), some_step(0.4)
    assert one.poses(step)[6] == pytest.approx(one.origin[6] + step[6], abs=1e-12)


@pytest.mark.parametrize("around", [0, 2, 20])
@pytest.mark.parametrize("gauge", [0, 4, COUNT - 1])
def test_a_step_is_known_by_where_it_leads(gauge: int, around: int) -> None:
    one, step = chart(gauge, around), some_step(0.4)
    there = one.poses(step)
    assert one.step(there) == pytest.approx(step, abs=1e-12)
    # as it is published, with headings that are wrapped
    there[:, 2] += 2 * np.pi * np.arange(COUNT)
    assert one.step(there) == pytest.approx(step, abs=1e-12)


@pytest.mark.parametrize("around", [0, 2, 20])
@pytest.mark.parametrize("gauge", [0, 4, COUNT - 1])
def test_a_gradient_is_that_of_finite_differences(gauge: int, around: int) -> None:
    one, step, weights = chart(gauge, around), some_step(0.3), some_step(1.0, seed=3)

    def cost(flat: Array) -> float:
        return float(np.sum(np.sin(one.poses(flat.reshape(-1, 3))) * weights))

    gradient = np.cos(one.poses(step)) * weights
    units = 1e-6 * np.eye(step.size)
    expected = [(cost(step.ravel() + e) - cost(step.ravel() - e)) / 2e-6 for e in units]
    assert one.pulled(gradient, step).ravel() == pytest.approx(expected, abs=1e-7)


def test_who_moves_alone_moves_beside_his_neighbours() -> None:
    step = np.zeros((COUNT, 3))
    step[3, 0] = 0.2
    assert chart().own_size(step) == pytest.approx(0.2)
    step[3] = [0, 0, 0.5]
    assert chart(around=0).own_size(step) >= 0.5


def test_what_is_beyond_a_way_is_what_it_leads_to_from_the_gauge() -> None:
    pulls = np.array([1, 10, 100, 1000]) * (1 + 2j)
    assert beyond(pulls, 0) == pytest.approx(np.array([1110, 1100, 1000]) * (1 + 2j))
    assert beyond(pulls, 2) == pytest.approx(np.array([-1, -11, 1000]) * (1 + 2j))
