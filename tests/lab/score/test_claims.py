"""Poses against their own covariance: the right side of each threshold."""

from __future__ import annotations

import numpy as np
import pytest
from lab.score import claims


def test_a_mahalanobis_error_crosses_the_half_turn_and_leaves_its_arguments() -> None:
    pose, truth = np.array([0.0, 0.0, 3.1]), np.array([0.0, 0.0, -3.1])
    squared = claims.mahalanobis(pose, np.eye(3), truth)
    assert squared == pytest.approx((2 * np.pi - 6.2) ** 2)
    assert pose[2] == 3.1
