"""What is claimed from a kept factor, against what is claimed from one that is made anew."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from kept_scenes import a_team_problem, shaken

from drslamd.slam.calibration.range_scatter import LEAST_SCATTER
from drslamd.slam.optimizer.banded import claims
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept.believed import Believed
from drslamd.slam.optimizer.kept.head import tail_of
from drslamd.slam.optimizer.kept.kept_claims import KeptSpread, kept_covariance, turn_since
from drslamd.slam.optimizer.kept.kept_factor import build
from drslamd.slam.optimizer.sensor_priors import Calibration


def test_covariances_and_sigmas_are_those_of_the_whole_system() -> None:
    team = a_team_problem()
    problem = team.problem
    point, scatter = shaken(problem), np.array([0.2, 0.9, 1.4])
    wanted = np.array([np.flatnonzero(problem.robot_id == robot)[-1] for robot in range(3)])
    joint, spread, biases = claims.covariances(Equations(problem), point, scatter, wanted)
    ratio = problem.model.correlated_ratio(1.0) * np.maximum(scatter, LEAST_SCATTER)
    believed = Believed(problem, point, ratio)
    kept = build(believed, team.pairs, tail_of(problem), with_blocks=False)
    assert kept is not None
    places = kept.head.places(problem, team.pairs)
    assert places is not None
    current = kept.on_top(believed, places)
    assert current is not None
    found = kept_covariance(current, point, wanted)
    assert found is not None
    assert np.allclose(found, joint, rtol=1e-6, atol=1e-12)
    kept_spread = KeptSpread.of(problem, point, current)
    assert kept_spread is not None
    learned = kept_spread.told(problem, point, current)
    for f in fields(Calibration):
        assert np.allclose(getattr(learned[0], f.name), getattr(spread, f.name), rtol=1e-6), f.name
    assert np.allclose(learned[1], biases, rtol=1e-6)
    # of what was eliminated it cannot say it
    assert kept_covariance(current, point, np.array([0, 1, 2])) is None


def test_a_team_that_was_turned_as_a_whole_is_claimed_as_it_stands() -> None:
    """By what was made of how it stood before."""
    team = a_team_problem()
    problem, angle = team.problem, 0.7
    before, scatter = shaken(problem), np.array([0.2, 0.9, 1.4])
    places = (before.poses[:, :2] @ [1, 1j]) * np.exp(1j * angle) + 5
    poses = np.column_stack([places.real, places.imag, before.poses[:, 2] + angle])
    point = Point.of(problem, poses, before.calibration)
    wanted = np.array([np.flatnonzero(problem.robot_id == robot)[-1] for robot in range(3)])
    joint, _, _ = claims.covariances(Equations(problem), point, scatter, wanted)
    ratio = problem.model.correlated_ratio(1.0) * np.maximum(scatter, LEAST_SCATTER)
    kept = build(Believed(problem, before, ratio), team.pairs, tail_of(problem), with_blocks=False)
    assert kept is not None
    at = kept.head.places(problem, team.pairs)
    assert at is not None
    assert kept.laid_over(poses, at) == pytest.approx(before.poses, abs=1e-9)
    current = kept.on_top(Believed(problem, point, ratio), at)
    assert current is not None
    assert turn_since(current, point, wanted) == pytest.approx(angle)
    found = kept_covariance(current, point, wanted)
    assert found is not None
    assert np.allclose(found, joint, rtol=1e-6, atol=1e-9 * joint.max())
