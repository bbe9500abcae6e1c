"""Steps towards minima, and which of these are one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drslamd.slam.relocation.minima import DAMPING, distinct_poses, gauss_newton_step


def test_a_step_of_a_quadratic_cost_goes_nearly_to_its_minimum() -> None:
    """Damping leaves a thousandth."""
    normal = np.array([[[2.0, 0.0], [0.0, 8.0]], [[1.0, 0.0], [0.0, 1.0]]])
    x = np.array([[0.5, -0.25], [0.0, 0.0]])
    after = gauss_newton_step(x, normal, np.einsum("mij,mj->mi", normal, x), longest=1.0)
    assert after[0] == pytest.approx(x[0] * DAMPING / (1 + DAMPING), rel=1e-4)
    assert after[1].tolist() == [0.0, 0.0]


def test_no_unknown_moves_farther_than_allowed_and_the_direction_stays() -> None:
    x, normal = np.array([[4.0, 2.0, 0.0]]), np.eye(3)[None]
    after = gauss_newton_step(x, normal, x, longest=1.0)
    assert after[0] == pytest.approx([3.0, 1.5, 0.0])


def test_what_nothing_is_known_of_stays() -> None:
    normal = np.diag([1.0, 0.0])[None]
    after = gauss_newton_step(np.array([[1.0, 7.0]]), normal, np.array([[1.0, 0.0]]), longest=2.0)
    assert after[0, 1] == 7.0


@pytest.mark.parametrize(
    ("row", "is_other"),
    [
        ((0.19, 0.0, 0.0), False),
        ((0.21, 0.0, 0.0), True),
        ((0.0, 0.0, 0.14), False),
        ((0.0, 0.0, 0.16), True),
        ((0.0, 0.0, 2 * math.pi - 0.14), False),
    ],
)
def test_minima_that_are_near_in_place_and_heading_are_one(
    row: tuple[float, float, float], is_other: bool
) -> None:
    first = (0.0, 0.0, 0.0)
    kept = distinct_poses(np.array([first, row]), 0.2, 0.15)
    assert kept.tolist() == ([list(first), list(row)] if is_other else [list(first)])
