"""Relative poses in complex numbers, with DPGO's weights."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.problem import BetweenFactors


def factors(*measured: tuple[float, float, float], sigma: float = 0.1) -> BetweenFactors:
    count = len(measured)
    covariance = np.tile(np.diag([sigma**2, (2 * sigma) ** 2, (sigma / 2) ** 2]), (count, 1, 1))
    return BetweenFactors(np.arange(count), np.arange(count) + 1, np.array(measured), covariance)


def test_a_pose_is_a_unit_number_and_a_place() -> None:
    found = ComplexFactors.of(factors((1.0, -2.0, np.pi / 2), (0.5, 0.0, np.pi)))
    assert found.turn == pytest.approx([1j, -1.0])
    assert found.shift == pytest.approx([1 - 2j, 0.5])
    assert found.i.tolist() == [0, 1]
    assert found.j.tolist() == [1, 2]


def test_weights_are_those_of_dpgo() -> None:
    """Of an isotropic position tau is 1 / variance; kappa counts matrices, whose distance is twice
    as large."""
    found = ComplexFactors.of(factors((1.0, 2.0, 0.3), sigma=0.1))
    assert found.tau == pytest.approx([2 / (0.01 + 0.04)])
    assert found.kappa == pytest.approx([2 / 0.0025])


def test_kappa_makes_a_small_turn_cost_its_squared_sigmas_twice_over() -> None:
    """As the squared Frobenius norm of the difference of two rotation matrices does."""
    turn, sigma = 1e-3, 0.05
    found = ComplexFactors.of(factors((0.0, 0.0, turn), sigma=2 * sigma))

    def rotation(theta: float) -> np.ndarray:
        return np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])

    frobenius = np.sum((rotation(turn) - np.eye(2)) ** 2) / sigma**2
    assert found.kappa[0] * abs(found.turn[0] - 1) ** 2 == pytest.approx(frobenius)


def test_parts_are_joined_in_their_order_and_chosen_with_all_their_columns() -> None:
    one, other = (ComplexFactors.of(factors(m)) for m in ((1.0, 0.0, 0.1), (0.0, 2.0, 0.2)))
    whole = ComplexFactors.joined([one, other])
    assert len(whole) == 2
    assert whole.shift.tolist() == [1.0, 2j]
    last = whole.chosen(np.array([False, True]))
    for name in ("i", "j", "turn", "shift", "kappa", "tau"):
        assert np.array_equal(getattr(last, name), getattr(other, name))


def test_no_factors_are_none() -> None:
    none = factors((1.0, 0.0, 0.0)).chosen(np.array([False]))
    assert len(ComplexFactors.of(none)) == 0
