"""What wheels do for a trajectory."""

from __future__ import annotations

import numpy as np
import pytest
from lab.recordings.recording import Trail, wheel_paths


def test_wheel_paths_of_a_circle_are_those_of_both_wheels() -> None:
    """Radius 2 m, wheels 0.4 m apart: the left one goes round 1.8 m, the right one 2.2 m."""
    angle = np.linspace(0, 3.0, 61)
    odometry = np.column_stack([2 * np.sin(angle), 2 - 2 * np.cos(angle), angle])
    left, right = wheel_paths(Trail(0, angle, odometry, odometry), 0.4)
    assert left == pytest.approx(1.8 * angle)
    assert right == pytest.approx(2.2 * angle)
