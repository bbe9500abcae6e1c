"""The benchmark's windows are what their truth says."""

from __future__ import annotations

import numpy as np
import pytest
from lab.benchmark import windows

from drslamd.slam import se2


@pytest.mark.parametrize("straight", [False, True])
def test_windows_are_what_their_truth_says(straight: bool) -> None:
    rng = np.random.default_rng(1)
    for _ in range(5):
        window, a_T_b = windows.window(rng, 100, straight)
        b = se2.transform(a_T_b, window.b_points)
        errors = np.hypot(*(b - window.a_points).T) - window.ranges
        assert 0.07 < errors.std() < 0.13
        speed = np.hypot(*np.diff(window.a_poses[:, :2], axis=0).T) * windows.HZ
        np.testing.assert_allclose(speed, windows.SPEED_M_S, rtol=1e-6)
        assert window.a_poses[-1].tolist() == [0, 0, 0]
