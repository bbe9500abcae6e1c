"""What is asked of a matrix is asked of where it was made."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from kept_scenes import a_team_problem

from drslamd.slam.optimizer.banded import banded_solver, mountings
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept import kept_solution, kept_solver
from drslamd.slam.se2 import Array

TURNED = 0.05
"""rad; about its first pose."""


@pytest.fixture(autouse=True)
def however_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_solver, "FEW", 0)


@lru_cache
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


@lru_cache
def solved() -> tuple[Point, Array]:
    """The solution, and what its own matrix says of mountings."""
    team, _ = turned()
    solution = banded_solver.solve(team.problem, team.start)
    equations = Equations(team.problem)
    point = Point.of(team.problem, solution.poses, solution.calibration)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    right = mountings.variances(equations, point, factor)
    assert right is not None
    return point, right


def kept_of(team: TeamProblem) -> Array:
    """What is known of mountings after a solution."""
    last = tuple(int(np.flatnonzero(team.problem.robot_id == robot)[-1]) for robot in range(3))
    _, kept = kept_solver.solve(team, last, 1e-6)
    assert isinstance(kept, kept_solution.Kept)
    return kept.variances


def is_near(found: Array, right: Array, share: float) -> bool:
    sizes = np.sqrt(np.diag(right))
    return bool((np.abs(found - right) / np.outer(sizes, sizes)).max() < share)


@pytest.mark.parametrize("more", [0, 1])
def test_a_team_that_began_turned_away_knows_of_mountings_what_its_own_matrix_says(
    more: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A large team by the matrix of where it began, asked there; else by one of the solution."""
    team, off = turned()
    assert off > 0.1
    monkeypatch.setattr(kept_solver, "MANY", team.problem.pairs + more)
    assert is_near(kept_of(team), solved()[1], 0.03)


def test_asked_elsewhere_differences_of_large_numbers_come_out_wrong(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    team, _ = turned()
    point, right = solved()
    variances = mountings.variances
    monkeypatch.setattr(kept_solver, "MANY", team.problem.pairs)
    monkeypatch.setattr(
        mountings, "variances", lambda equations, _, matrix: variances(equations, point, matrix)
    )
    assert not is_near(kept_of(team), right, 0.3)
