"""Where the poses of a head are in other problems."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kept_scenes import a_team_problem, shaken

from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem
from drslamd.slam.optimizer.kept.believed import Believed
from drslamd.slam.optimizer.kept.head import TAIL, tail_of
from drslamd.slam.optimizer.kept.kept_factor import build
from drslamd.slam.optimizer.problem import Doubted, Problem


@pytest.fixture(scope="module")
def team() -> TeamProblem:
    return a_team_problem()


def without_pose(problem: Problem, pose: int) -> Problem:
    """The pose is another one's."""
    n = problem.n.copy()
    n[pose] += 1
    return replace(problem, n=n)


def test_a_problem_that_lacks_a_pose_of_the_head_has_no_places(team: TeamProblem) -> None:
    problem = team.problem
    kept = build(Believed(problem, shaken(problem)), team.pairs, tail_of(problem), True)
    assert kept is not None
    assert kept.head.places(problem, team.pairs) is not None
    assert kept.head.places(without_pose(problem, 5), team.pairs) is None
    last = len(problem.n) - 1
    assert kept.head.places(without_pose(problem, last), team.pairs) is not None
    assert kept.head.places(problem, team.pairs[:2]) is None
    doubted = replace(problem, doubted=Doubted(np.arange(3) == 0, np.zeros(3, dtype=bool)))
    assert kept.head.places(doubted, team.pairs) is None


def test_a_pose_that_comes_late_is_known_as_such(team: TeamProblem) -> None:
    problem = team.problem
    count = len(problem.n)
    late = np.arange(count) == count // 2
    kept = build(Believed(problem, shaken(problem)), team.pairs, tail_of(problem) | late, True)
    assert kept is not None
    places = kept.head.places(problem, team.pairs)
    # what hangs on it had to wait for it
    assert places is not None
    assert not places.is_late(problem)
    moved = replace(problem.odometry, j=np.where(problem.odometry.j == count - 1, 3, count - 1))
    assert places.is_late(replace(problem, odometry=moved))


def test_the_tail_are_the_newest_poses_of_the_team(team: TeamProblem) -> None:
    found = np.flatnonzero(tail_of(team.problem))
    count = len(team.problem.n)
    assert found.tolist() == list(range(count - 3 * TAIL, count))
