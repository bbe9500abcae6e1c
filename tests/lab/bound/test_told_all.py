"""Who is told all errs as the bound says, on what the simulator really draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.bound import cramer_rao, told_all
from lab.recordings import world
from lab.recordings.recording import Array

SCENE = world.Scene(robots=2, seconds=8.0, range_hz=10, odometry_hz=10)
TIMES = np.array([4.0, 7.5])


def squared(error: Array, covariance: Array) -> float:
    """Per degree of freedom."""
    return float(error @ np.linalg.solve(covariance, error)) / len(error)


@pytest.mark.slow
def test_errors_of_many_seeds_are_as_large_as_the_bound_has_them() -> None:
    live, hindsight = [], []
    for seed in range(20):
        recording = world.simulate(SCENE, seed)
        bound = cramer_rao.of_recording(recording, SCENE, TIMES)
        found = told_all.of_recording(recording, SCENE, TIMES)
        for k in range(2):
            off = (found.live - bound.poses)[k].ravel(), (found.hindsight - bound.poses)[k].ravel()
            # robot 0 began where it is known to have, so what is known of it is nearly singular
            live.append(squared(off[0][3:], bound.live[k][3:, 3:]))
            hindsight.append(squared(off[1][3:], bound.hindsight[k][3:, 3:]))
    assert 0.7 < np.mean(live) < 1.4
    assert 0.7 < np.mean(hindsight) < 1.4


def test_in_hindsight_is_better_than_live_and_last_the_same() -> None:
    recording = world.simulate(SCENE, 7)
    last = np.array([round(recording.duration / cramer_rao.STEP_S) * cramer_rao.STEP_S - 0.1])
    found = told_all.of_recording(recording, SCENE, last)
    assert found.hindsight == pytest.approx(found.live, abs=1e-6)


@pytest.mark.parametrize(("off", "is_used"), [(0.2, True), (0.31, False)])
def test_a_range_in_a_burst_is_known_to_be_in_one(off: float, is_used: bool) -> None:
    recording = world.simulate(replace(SCENE, ranges=world.RangeModel(0.1, 0, 2.5, 0, 0)), 3)
    truths = cramer_rao.true_steps(recording)
    clean, white = told_all._ranged(recording, SCENE, truths)
    wrong = recording.ranges.copy()
    rows = np.flatnonzero(np.floor(wrong[:, 0] / cramer_rao.STEP_S + 1e-6) == 50)
    wrong[rows[0], 3] += off
    some, fewer = told_all._ranged(replace(recording, ranges=wrong), SCENE, truths)
    assert len(rows) == 2
    assert some[50, 0] - clean[50, 0] == pytest.approx(off / 2 if is_used else 0.0, abs=1e-3)
    assert fewer[50, 0] / white[50, 0] == pytest.approx(1.0 if is_used else 2.0)
    assert white[50, 0] == pytest.approx(SCENE.ranges.white**2 / 2)
