"""Solutions that are not the best of their graph, and what is begun with once more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import BANDED, SmallTeam, group_of, small_team

from drslamd.conventions import GRID_HZ, Segment
from drslamd.slam.graph.estimate import Learned, TeamEstimate
from drslamd.slam.optimizer import valleys
from drslamd.slam.optimizer.banded import banded_optimizer
from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem
from drslamd.slam.optimizer.banded.solution import Solution
from drslamd.slam.optimizer.valleys import BACKWARDS, HARDLY_WORSE, POSES, is_better, other_starts


@pytest.fixture(scope="module")
def team() -> SmallTeam:
    return small_team(1, robots=2, count=40)


@pytest.fixture(scope="module")
def right(team: SmallTeam) -> TeamEstimate:
    """To the end."""
    first = BANDED.job(team.graph, group_of(team.graph), None, {})()
    return BANDED.job(team.graph, group_of(team.graph), first, {})()


def heading_the_other_way(found: TeamEstimate) -> TeamEstimate:
    """Robot 1 drives the same way backwards."""
    path = found.trajectories[1]
    turned = replace(path, poses=path.poses + [0, 0, np.pi])
    scale = Learned(2 - found.scale[1].value, 0.1)
    return replace(
        found,
        trajectories={**found.trajectories, 1: turned},
        scale={**found.scale, 1: scale},
        kept=None,
    )


def test_who_heads_the_wrong_way_and_counts_backwards_is_turned_about(
    team: SmallTeam, right: TeamEstimate, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong, group = heading_the_other_way(right), group_of(team.graph)
    found = BANDED.job(team.graph, group, wrong, {})()
    assert abs(found.scale[1].value) < 0.1
    for robot, path in right.trajectories.items():
        assert found.trajectories[robot].poses == pytest.approx(path.poses, abs=1e-3)
    # by itself no descent leads out of it: ranges fit as well
    monkeypatch.setattr(valleys, "other_starts", lambda *_: iter(()))
    stays = BANDED.job(team.graph, group, wrong, {})()
    assert stays.scale[1].value > 1.9
    assert stays.trajectories[1].poses[:, :2] == pytest.approx(
        right.trajectories[1].poses[:, :2], abs=0.2
    )


def test_what_nothing_explains_is_begun_at_the_closures_once_more(
    team: SmallTeam, right: TeamEstimate
) -> None:
    starts = []

    def solve(
        problem: TeamProblem, last: tuple[int, ...], tolerance: float, kept: object
    ) -> tuple[Solution, object]:
        """Whoever begins with the last solution's scale ends where nothing explains it."""
        starts.append(float(problem.start.scale[1]))
        solution, kept = banded_optimizer.anew(problem, last, tolerance, kept)
        return replace(solution, is_explained=starts[-1] != 0.25), kept

    numbers, group = replace(BANDED, solve=solve), group_of(team.graph)
    astray = replace(right, scale={**right.scale, 1: Learned(0.25, 0.1)}, kept=None)
    found = numbers.job(team.graph, group, astray, {})()
    assert starts == [0.25, 0.0]
    assert found.is_explained
    starts.clear()
    assert numbers.job(team.graph, group, None, {})().is_explained
    assert starts == [0.0]


@pytest.mark.parametrize(
    ("in_vain", "converged", "starts"),
    [(2, False, []), (3, False, [None]), (3, True, []), (4, False, []), (6, False, [None])],
)
def test_where_a_valley_leads_nowhere_again_and_again_another_is_looked_for_as_well(
    in_vain: int, converged: bool, starts: list[None], right: TeamEstimate
) -> None:
    found, before = replace(right, converged=converged), replace(right, in_vain=in_vain)
    assert list(other_starts(found, before)) == starts


def test_a_valley_that_leads_nowhere_is_stayed_in_where_no_other_costs_less(
    team: SmallTeam, right: TeamEstimate
) -> None:
    for cost, is_left in ((right.cost - 1.0, False), (right.cost + 1.0, True)):

        def solve(
            problem: TeamProblem,
            last: tuple[int, ...],
            tolerance: float,
            kept: object,
            cost: float = cost,
        ) -> tuple[Solution, object]:
            """Whoever begins with the last solution's scale comes to no end, at that cost."""
            solution, kept = banded_optimizer.anew(problem, last, tolerance, kept)
            if problem.start.scale[1] != 0.25:
                return solution, kept
            return replace(solution, cost=cost, converged=False), kept

        numbers = replace(BANDED, solve=solve)
        astray = {**right.scale, 1: Learned(0.25, 0.1)}
        before = replace(right, scale=astray, in_vain=3, converged=False, kept=None)
        found = numbers.job(team.graph, group_of(team.graph), before, {})()
        assert (found.cost != cost) is is_left


def test_where_that_is_not_explained_either_the_lower_cost_counts(right: TeamEstimate) -> None:
    known, unknown = replace(right, cost=9.0), replace(right, cost=5.0, is_explained=False)
    assert is_better(known, unknown)
    assert not is_better(unknown, known)
    for found in (known, unknown):
        assert is_better(replace(found, cost=found.cost - 0.1), found)
        assert not is_better(replace(found, cost=found.cost), found)


@pytest.mark.parametrize(("worse", "is_taken"), [(-0.1, True), (0.1, False)])
def test_what_comes_to_rest_may_cost_a_little_more(
    worse: float, is_taken: bool, right: TeamEstimate
) -> None:
    restless = replace(right, converged=False)
    assert is_better(replace(right, cost=right.cost + HARDLY_WORSE + worse), restless) is is_taken
    assert not is_better(replace(restless, cost=right.cost - 100.0), right)


@pytest.mark.parametrize(
    ("robot", "beyond", "count"), [(1, 0.01, 1), (1, -0.01, 0), (0, 0.01, 0), (7, 0.01, 0)]
)
def test_only_a_robot_that_counts_backwards_is_turned_about_and_never_the_one_of_the_frame(
    robot: int, beyond: float, count: int, right: TeamEstimate
) -> None:
    """Nor a standing point, which has no heading."""
    found = replace(right, scale={**right.scale, robot: Learned(BACKWARDS + beyond, 0.1)})
    assert found.frame == Segment(*right.trajectories[0].chain, 0)
    starts = list(other_starts(found, right))
    assert len(starts) == count
    for start in starts:
        assert start is not None
        assert start.scale[1].value == pytest.approx(2 - BACKWARDS - beyond)
        turned = start.trajectories[1].poses - found.trajectories[1].poses
        assert turned == pytest.approx(np.tile([0, 0, np.pi], (len(turned), 1)))
        assert start.trajectories[0] is found.trajectories[0]
        assert start.kept is None


@pytest.mark.parametrize(
    ("poses", "second", "explained_before", "starts"),
    [
        (POSES - 1, 41, False, [None]),
        (POSES, 41, False, []),
        (POSES, 42, False, [None]),
        (POSES, 41, True, [None]),
        (2 * POSES, 41, False, []),
        (2 * POSES, 42, False, [None]),
    ],
)
def test_what_stays_unexplained_is_begun_anew_more_rarely_in_larger_graphs(
    poses: int, second: int, explained_before: bool, starts: list[None], right: TeamEstimate
) -> None:
    """A first solution was begun at the closures already."""
    path = right.trajectories[0]
    n = GRID_HZ * second + 9 + np.arange(1 - poses, 1)
    longer = replace(path, n=n, poses=np.zeros((poses, 3)))
    found = replace(right, trajectories={0: longer}, is_explained=False)
    before = replace(right, is_explained=explained_before)
    assert list(other_starts(found, before)) == starts
    assert list(other_starts(found, None)) == []
