"""Covariances as six numbers, against matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drslamd.near.packed import added_up, moved, times, turned
from drslamd.slam import se2

ROOT = np.random.default_rng(3).normal(size=(3, 3))
KNOWN = ROOT @ ROOT.T


def test_a_covariance_moves_with_its_lever() -> None:
    s = np.array([[1.0, 0.0, -0.7], [0.0, 1.0, 1.3], [0.0, 0.0, 1.0]])
    assert np.allclose(moved(se2.packed(KNOWN), 1.3, 0.7), se2.packed(s @ KNOWN @ s.T))


def test_its_axes_turn() -> None:
    cos, sin = math.cos(0.8), math.sin(0.8)
    r = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    assert np.allclose(turned(se2.packed(KNOWN), cos, sin), se2.packed(r @ KNOWN @ r.T))


def test_rows_of_many_are_what_each_is() -> None:
    rows = np.array([se2.packed(KNOWN), se2.packed(2 * KNOWN)]).T
    found = np.array(moved(rows, np.array([1.0, 2.0]), np.array([0.5, -1.0])))
    assert found[:, 1] == pytest.approx(moved(se2.packed(2 * KNOWN), 2.0, -1.0))


def test_sums_and_multiples_are_those_of_each_number() -> None:
    one, other = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0), (10.0, 30.0, 50.0, 70.0, 90.0, 110.0)
    assert added_up(one, other) == (11.0, 32.0, 53.0, 74.0, 95.0, 116.0)
    assert times(3.0, one) == (3.0, 6.0, 9.0, 12.0, 15.0, 18.0)
