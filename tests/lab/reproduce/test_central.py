"""The centralised rival, against finite differences and odometry."""

from __future__ import annotations

import numpy as np
import pytest
from lab.reproduce import central, experiment
from lab.reproduce.experiment import PAIRS
from lab.score import metrics


def test_the_centralised_rivals_slope_is_that_of_its_error() -> None:
    data = central.measured(experiment.trial(0))
    rng = np.random.default_rng(4)
    size = 3 * len(experiment.POSE_TIMES)
    poses = rng.normal(size=(size, 3)) * [5, 5, 1]
    _, slope = central._linearised(data, poses)
    direction = rng.normal(size=poses.shape)
    ahead, _ = central._linearised(data, poses + 1e-6 * direction)
    behind, _ = central._linearised(data, poses - 1e-6 * direction)
    scale = np.abs(ahead - behind).max() / 2e-6
    error = slope @ direction.ravel() - (ahead - behind) / 2e-6
    # headings that cross the half turn between the two sides are no slope
    assert np.quantile(np.abs(error), 0.99) < 1e-5 * scale


def test_the_centralised_rival_is_better_than_odometry_and_starts_at_the_truth() -> None:
    trial = experiment.trial(0)
    solved = central.solve(trial)
    for robot, poses in solved.items():
        assert poses[0] == pytest.approx(trial.truth[robot][0], abs=1e-2)
    metres = [
        experiment.pose_errors(metrics.relative(solved[a], solved[b]), trial.true_pairs(a, b))[0]
        for a, b in PAIRS
    ]
    assert np.mean(metres) < 0.7 * experiment.odometry_errors(trial.recording)[0].mean()
