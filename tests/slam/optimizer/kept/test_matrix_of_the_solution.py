"""What is asked of a large team's solution is asked of its own matrix, not of where it began."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kept_scenes import a_team_problem

from drslamd.slam.optimizer.banded import banded_solver, mountings
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept import kept_solver, quick_check
from drslamd.slam.se2 import Array

TURNED = 0.05
"""rad; about its first pose."""


@pytest.fixture(autouse=True)
def however_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_solver, "FEW", 0)


def turned() -> tuple[TeamProblem, float]:
    """A team that is solved but for a turn, and how far its farthest pose is off by that."""
    team = a_team_problem()
    solution = banded_solver.solve(team.problem, team.start)
    poses, gauge = solution.poses.copy(), team.problem.gauge
    turn = np.exp(1j * TURNED)
    place = (poses[:, :2] - poses[gauge, :2]) @ [1, 1j] * turn
    poses[:, :2] = np.column_stack([place.real, place.imag]) + poses[gauge, :2]
    poses[:, 2] += TURNED
    poses[gauge] = team.problem.initial[gauge]
    problem = replace(team.problem, initial=poses)
    off = float(np.abs(poses - solution.poses).max())
    return replace(team, problem=problem, start=solution.calibration, is_near=True), off


def kept_of(team: TeamProblem) -> tuple[Array, Array]:
    """What is known of mountings after a solution, and what the matrix of that solution says."""
    last = tuple(int(np.flatnonzero(team.problem.robot == robot)[-1]) for robot in range(3))
    solution, kept = kept_solver.solve(team, last, 1e-6)
    assert isinstance(kept, kept_solver.Kept)
    equations = Equations(team.problem)
    point = Point.of(team.problem, solution.poses, solution.calibration)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    right = mountings.variances(equations, point, factor)
    assert right is not None
    return kept.variances, right


@pytest.mark.parametrize(
    ("far", "more", "is_right"), [(0.99, 0, True), (1.01, 0, False), (0.99, 1, False)]
)
def test_a_large_team_that_began_far_away_has_another_matrix(
    far: float, more: int, is_right: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By that of where it began, differences of large numbers come out wrong."""
    team, off = turned()
    monkeypatch.setattr(kept_solver, "FAR", far * off)
    monkeypatch.setattr(kept_solver, "MANY", len(team.problem.n) + more)
    found, right = kept_of(team)
    assert np.allclose(found, right, rtol=0.01, atol=0.01 * np.diag(right).min()) is is_right


@pytest.mark.parametrize(("more", "is_anew"), [(0, False), (1, True)])
def test_before_a_large_team_is_solved_anew_it_is_asked_again(
    more: int, is_anew: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def only_once(*args: object) -> Array | None:
        asked.append(args)
        return None if len(asked) == 1 else np.ones(3)

    monkeypatch.setattr(quick_check, "misfit_as_modelled", only_once)
    team = replace(a_team_problem(), is_near=True)
    solution = banded_solver.solve(team.problem, team.start)
    problem = replace(team.problem, initial=solution.poses)
    team = replace(team, problem=problem, start=solution.calibration)
    monkeypatch.setattr(kept_solver, "MANY", len(problem.n) + more)
    last = tuple(int(np.flatnonzero(problem.robot == robot)[-1]) for robot in range(3))
    _, kept = kept_solver.solve(team, last, 1e-6)
    assert isinstance(kept, kept_solver.KeptShares) is is_anew
    assert len(asked) == 2 - more
