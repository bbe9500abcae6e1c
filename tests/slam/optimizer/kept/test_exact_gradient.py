"""The gradient in sums, against that of the normal equations and against differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kept_scenes import a_problem, shaken

from drslamd.slam.optimizer.banded import mountings
from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.kept.exact_gradient import exact_gradient, mounting_pulls
from drslamd.slam.optimizer.problem import Doubted


@pytest.mark.parametrize("is_doubted", [False, True])
def test_the_gradient_is_that_of_the_normal_equations(is_doubted: bool) -> None:
    problem = a_problem(carried=True)
    problem = replace(problem, width=np.linspace(1.0, 1.4, problem.pairs))
    robots = len(problem.priors.scale)
    if is_doubted:
        doubted = Doubted(np.arange(robots) == 1, np.arange(robots) != 1)
        problem = replace(problem, doubted=doubted)
    point = shaken(problem)
    equations = Equations(problem, layout=BandLayout.flat(problem))
    expected = equations.gradient(point)
    found = exact_gradient(equations, point)
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_pulls_at_mountings_are_those_that_scores_are_made_of() -> None:
    problem = a_problem(carried=True)
    problem = replace(problem, width=np.linspace(1.0, 1.4, problem.pairs))
    point = shaken(problem)
    expected = mountings.pulls(Equations(problem), point)
    assert np.allclose(mounting_pulls(problem, point), expected, rtol=1e-9)
