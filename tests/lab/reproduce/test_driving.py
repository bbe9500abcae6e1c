"""How robots are driven about a room."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.recordings import world
from lab.reproduce import driving
from lab.reproduce.experiment import SCENE


def test_a_path_has_curves_both_ways_straight_lines_and_stops() -> None:
    rng = np.random.default_rng(11)
    path = driving.by_hand(rng, SCENE)
    step = np.diff(path, axis=0) / world.STEP_S
    speed = np.hypot(step[:, 0], step[:, 1])
    for part in (
        step[:, 2] > 0.1,
        step[:, 2] < -0.1,
        (np.abs(step[:, 2]) < 1e-9) & (speed > 0.15),
        speed < 1e-9,
    ):
        assert np.mean(part) > 0.005


@pytest.mark.parametrize("seed", range(5))
def test_nobody_is_driven_into_a_wall(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    path = driving.by_hand(rng, replace(SCENE, seconds=120.0))
    assert (path[:, :2] > 0.3).all()
    assert (path[:, :2] < np.array([SCENE.width, SCENE.height]) - 0.3).all()
