"""How long what is left of a system for its border is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kept_scenes import a_team_problem
from slam_problems import IDS

from drslamd.conventions import GRID_HZ
from drslamd.slam.optimizer.kept import border
from drslamd.slam.optimizer.kept.border import FEW, GROWN, SECONDS, Border
from drslamd.slam.optimizer.problem import Problem

ROBOTS, PAIRS = 3, ((0, 1), (0, 2), (1, 2))


def a_problem() -> Problem:
    """Of robots whose ids are not their numbers."""
    problem = a_team_problem(seconds=90).problem
    return replace(problem, robot_id=np.array(IDS)[problem.robot_id])


@pytest.fixture
def made() -> Border:
    return Border.of(a_problem(), PAIRS, np.eye(FEW + 1))


def later(problem: Problem, samples: int, robot: int | None = None) -> Problem:
    """The newest keyframe of each robot, or of one, comes later."""
    n = problem.n.copy()
    for k in range(ROBOTS) if robot is None else [robot]:
        n[np.flatnonzero(problem.robot_id == IDS[k])[-1]] += samples
    return replace(problem, n=n)


@pytest.mark.parametrize("robot", [None, 0, 2])
def test_to_lead_to_a_solution_a_border_holds_for_some_seconds(
    made: Border, robot: int | None
) -> None:
    problem = a_problem()
    assert made.holds(problem, PAIRS, is_claimed=False)
    most = SECONDS * GRID_HZ
    assert made.holds(later(problem, most, robot), PAIRS, is_claimed=False)
    assert not made.holds(later(problem, most + 1, robot), PAIRS, is_claimed=False)


@pytest.mark.parametrize("robot", [None, 0, 2])
def test_claims_are_made_by_it_while_nobody_has_driven_much_longer(
    made: Border, robot: int | None
) -> None:
    """After 90 s, of which a hundredth is 0.9 s."""
    problem = a_problem()
    assert made.holds(problem, PAIRS, is_claimed=True)
    assert made.holds(later(problem, 8, robot), PAIRS, is_claimed=True)
    assert not made.holds(later(problem, 10, robot), PAIRS, is_claimed=True)


@pytest.mark.parametrize("is_claimed", [True, False])
def test_a_pair_that_met_since_makes_it_anew(made: Border, is_claimed: bool) -> None:
    assert not made.holds(a_problem(), (*PAIRS, (0, 3)), is_claimed)


def test_a_way_that_is_longer_makes_it_anew(made: Border) -> None:
    problem = a_problem()
    links = len(problem.odometry)
    assert replace(made, links=int(links / GROWN) + 1).holds(problem, PAIRS, False)
    assert not replace(made, links=int(links / GROWN) - 1).holds(problem, PAIRS, False)


def test_a_small_one_is_made_each_time(made: Border, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = a_problem()
    small = replace(made, lower=np.eye(FEW))
    assert not small.holds(problem, PAIRS, False)
    monkeypatch.setattr(border, "FEW", 0)
    assert small.holds(problem, PAIRS, False)
