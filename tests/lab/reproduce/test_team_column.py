"""This system's column of tools/reproduce: what it claims, and how that is counted."""

from __future__ import annotations

import numpy as np
import pytest
from lab.reproduce import experiment, team_column
from lab.reproduce.tally import Tally
from lab.score.outcome import Closure


def test_a_claim_counts_on_the_right_side_of_each_threshold() -> None:
    covariance = np.diag([0.04, 0.04, 0.01])
    for squared, below, wild in ((14.1, 1, 0), (14.3, 0, 0), (50.1, 0, 1)):
        tally = Tally()
        pose = np.array([0.2 * np.sqrt(squared), 0.0, 0.0])
        team_column.claim(tally, "x", pose, covariance, np.zeros(3))
        assert tally["x/nees"].mean == pytest.approx(squared / 3)
        assert tally["x/below"].mean == below
        assert tally["x/wild"].mean == wild


def test_only_closures_that_name_one_pose_are_held_to_their_claim() -> None:
    trial = experiment.trial(0)
    truth = trial.true_pairs(0, 1)[30]
    t = float(experiment.POSE_TIMES[30])
    one = np.array([truth + [0.1, 0.0, 0.0]])
    covariance = np.array([np.eye(3)])
    two = np.concatenate([one, one + 5])
    found = [
        Closure(t, 0, 1, "unique", one, covariance, True),
        Closure(t, 0, 1, "ambiguous", two, np.concatenate([covariance, covariance]), True),
        Closure(t, 0, 1, "not enough motion", np.zeros((0, 3)), np.zeros((0, 3, 3)), False),
    ]
    tally = Tally()
    team_column.closures(tally, trial, found)
    assert tally["drslamd/before/m"].n == 1
    assert tally["drslamd/before/m"].mean == pytest.approx(0.1, abs=1e-6)
    assert tally["drslamd/claim/nees"].n == 1
    assert tally["drslamd/keeps"].n == 2
    assert tally["drslamd/verdict/not enough motion"].n == 1
