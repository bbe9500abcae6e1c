"""Errors of trajectories against what can be worked out by hand or by scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lab.recordings.recording import Array
from lab.score import metrics
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

TURN = np.array([3.0, -2.0, 2.5])
"""Another frame."""


def as_matrix(pose: Array) -> Array:
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    return np.array([[c, -s, x], [s, c, y], [0, 0, 1]])


def random_poses(seed: int, count: int = 40) -> Array:
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(-5, 5, (count, 2)), rng.uniform(-3, 3, count)])


def test_poses_compose_and_divide_like_matrices() -> None:
    a, b = random_poses(1), random_poses(2)
    for one, other, product, ratio in zip(
        a, b, metrics.compose(a, b), metrics.relative(a, b), strict=True
    ):
        assert as_matrix(product) == pytest.approx(as_matrix(one) @ as_matrix(other))
        assert as_matrix(ratio) == pytest.approx(np.linalg.inv(as_matrix(one)) @ as_matrix(other))
        assert -math.pi <= ratio[2] <= math.pi


def test_the_alignment_of_noisy_positions_is_that_of_a_general_solver() -> None:
    rng = np.random.default_rng(3)
    truth = random_poses(3)[:, :2]
    estimate = truth @ as_matrix(TURN)[:2, :2].T + TURN[:2] + rng.normal(0, 0.3, truth.shape)

    def residuals(x: Array) -> Array:
        return np.asarray((estimate @ as_matrix(x)[:2, :2].T + x[:2] - truth).ravel())

    ours = metrics.alignment(estimate, truth)
    theirs = least_squares(residuals, ours + [0.5, -0.4, 0.3]).x
    assert as_matrix(ours) == pytest.approx(as_matrix(theirs), abs=1e-6)
    flat = [np.column_stack([p - p.mean(axis=0), np.zeros(len(p))]) for p in (truth, estimate)]
    kabsch = Rotation.align_vectors(*flat)[0].as_rotvec()[2]
    assert math.remainder(ours[2] - kabsch, 2 * math.pi) == pytest.approx(0, abs=1e-9)


def test_errors_are_those_of_the_definition() -> None:
    truth = np.zeros((4, 3))
    places, degrees = [[3, 4], [0, 1], [0, 0], [0, 2]], [10, 12, 10, -1]
    estimate = np.column_stack([places, np.radians(degrees)])
    errors = metrics.errors({0: estimate}, {0: truth}, 0)
    assert errors["ate_rmse_m"] == pytest.approx(math.sqrt((25 + 1 + 0 + 4) / 4))
    assert errors["ate_mean_m"] == pytest.approx(2.0)
    assert errors["ate_std_m"] == pytest.approx(math.sqrt((9 + 1 + 4 + 0) / 4))
    assert errors["rot_mean_deg"] == pytest.approx(33 / 4)
    assert errors["rot_std_deg"] == pytest.approx(float(np.std([10, 12, 10, 1])))
    # the median turn is 10 degrees
    assert errors["rot_mean_centred_deg"] == pytest.approx((0 + 2 + 0 + 11) / 4)


def test_one_constant_turn_is_removed_from_each_robot() -> None:
    truths = {0: np.zeros((5, 3)), 1: np.zeros((5, 3))}
    turned = {0: truths[0] + [0, 0, 0.1], 1: truths[1] - [0, 0, 3.1]}
    errors = metrics.errors(turned, truths, None)
    assert errors["rot_mean_deg"] == pytest.approx(math.degrees(1.6))
    assert errors["rot_mean_centred_deg"] == pytest.approx(0, abs=1e-9)
