"""The semidefinite program of the window against windows whose pose is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.benchmark import sdp, windows

from drslamd.slam import se2

pytest.importorskip("clarabel", reason="clarabel has no wheel for this Python")


@pytest.mark.parametrize("seed", range(5))
def test_without_noise_it_is_tight_and_exact(seed: int) -> None:
    window, truth = windows.window(np.random.default_rng(seed), 60)
    b_in_a = se2.transform(truth, window.b_points)
    window = replace(window, ranges=np.hypot(*(b_in_a - window.a_points).T))
    found = sdp.relaxed(window)
    assert found.ratio < sdp.TIGHT
    assert np.abs(found.a_T_b[:2] - truth[:2]).max() < 2e-2
    assert abs(se2.wrap(found.a_T_b[2] - truth[2])) < 5e-3


@pytest.mark.parametrize("seed", range(5))
def test_what_ties_the_lifted_unknowns_together_holds_for_every_pose(seed: int) -> None:
    x, y, theta = np.random.default_rng(seed).uniform(-3, 3, 3)
    c, s = np.cos(theta), np.sin(theta)
    u = np.array([[c, s], [-s, c]]) @ [x, y]
    lifted = np.array([1, c, s, x, y, *u, x * x + y * y])
    for tie in sdp.TIES:
        assert sum(k * lifted[i] * lifted[j] for i, j, k in tie) == pytest.approx(0, abs=1e-9)
