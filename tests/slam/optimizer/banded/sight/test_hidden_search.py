"""Solutions for which sight was blocked, the likelier one first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_problems import held_at, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.sight import hidden_search
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

ROBOTS, COUNT, SINCE = 4, 45, 25


def walled(metres: float, since: int = SINCE) -> tuple[Problem, Array]:
    """Ranges of robots 0 and 1 are too long from some second on."""
    problem, truth = team_problem(3, robots=ROBOTS, count=COUNT, closures=6)
    problem, ranges = held_at(problem, truth), problem.ranges
    wrong = (ranges.pair == 0) & (ranges.i // ROBOTS >= since)
    return replace(
        problem, ranges=replace(ranges, measured=ranges.measured + metres * wrong)
    ), truth


def nominal(problem: Problem) -> Point:
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return descend(Equations(problem), start, 60)


def found(problem: Problem) -> list[tuple[Equations, Point]]:
    return list(hidden_search.solutions(Equations(problem), nominal(problem), 60, TOLERANCE))


def off(point: Point, truth: Array) -> float:
    return float(np.abs(point.poses[:, :2] - truth[:, :2]).max())


def test_first_only_those_were_hidden_of_whom_it_is_seen_and_then_anybody() -> None:
    problem, _ = walled(1.0)
    hidden = [equations.problem.blocked for equations, _ in found(problem)]
    assert [None if h is None else np.flatnonzero(h).tolist() for h in hidden] == [
        [0],
        list(range(6)),
    ]


def test_a_wall_leaves_the_poses_where_they_are_without_it() -> None:
    problem, truth = walled(1.0)
    clean = off(nominal(walled(0.0)[0]), truth)
    assert off(nominal(problem), truth) > 1.5 * clean
    assert off(found(problem)[0][1], truth) < 1.2 * clean


def test_ranges_that_are_too_short_are_out_of_no_sight() -> None:
    """Where half are, the other half may be too long."""
    assert not found(walled(-2.0, since=35)[0])


@pytest.mark.parametrize(
    ("is_near", "short", "steps"),
    [(True, 0.0, [120, 600]), (False, 0.29, [120, 600, 600]), (False, 0.31, [120])],
)
def test_a_far_way_is_gone_to_its_end_unless_many_ranges_are_too_short(
    is_near: bool, short: float, steps: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With twice the steps that a solution takes else, one of twenty was broken off."""
    asked: list[int] = []

    def counted(equations: Equations, start: Calibration, most: int, tolerance: float) -> Point:
        asked.append(most)
        point = descend(equations, start, most, tolerance)
        return point if is_near or len(asked) > 1 else replace(point, converged=False)

    problem, _ = walled(1.0)
    point = nominal(problem)
    monkeypatch.setattr(hidden_search, "descend", counted)
    monkeypatch.setattr(
        hidden_search,
        "outlier_share",
        lambda *_: np.full(6, short if len(asked) == 1 and not is_near else 0.0),
    )
    list(hidden_search.solutions(Equations(problem), point, 60, TOLERANCE))
    assert asked == steps
