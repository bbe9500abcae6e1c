"""What systems of a kept factor are made of, against the system of the whole problem."""

from __future__ import annotations

import numpy as np
import pytest
from kept_scenes import a_team_problem, shaken

from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.kept.believed import Believed


@pytest.mark.parametrize("is_claimed", [False, True])
def test_two_halves_of_all_factors_and_the_priors_are_the_whole(is_claimed: bool) -> None:
    problem = a_team_problem().problem
    point, equations = shaken(problem), Equations(problem)
    claims = np.array([1.5, 2.0, 1.2]) if is_claimed else None
    believed = Believed(problem, point, claims)
    which = np.arange(problem.ends.shape[1]) % 3 == 1
    system = believed.of_factors(which, equations.layout, point.poses)
    system.add(believed.of_factors(~which, equations.layout, point.poses))
    believed.add_priors(system, equations.layout)
    equations.add_gaussian_priors(system)
    whole = equations.weighed(point) if claims is None else equations.claimed(point, claims)
    for found, right in (
        (system.band, whole.band),
        (system.border, whole.border),
        (system.corner, whole.corner),
    ):
        assert np.allclose(found, right, rtol=1e-9, atol=1e-6)


def test_the_lean_system_of_a_head_is_the_same() -> None:
    problem = a_team_problem().problem
    point, equations = shaken(problem), Equations(problem)
    believed = Believed(problem, point)
    every = np.ones(problem.ends.shape[1], dtype=bool)
    lean = believed.of_head(every, equations.layout, is_curved=False)
    full = believed.of_factors(every, equations.layout, point.poses)
    equations.add_gaussian_priors(full)
    n = equations.layout.band
    assert np.allclose(lean.columns(0, n), full.band, rtol=1e-9, atol=1e-6)
    assert np.allclose(lean.border.rows(0, n), full.border, rtol=1e-9, atol=1e-6)
    assert np.allclose(lean.corner, full.corner, rtol=1e-9, atol=1e-6)
