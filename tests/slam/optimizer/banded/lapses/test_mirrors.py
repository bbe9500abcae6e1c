"""A robot whose wheels stand for good, between two others: on which side it drives."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from slam_problems import held_at, stuck, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded.lapses import mirrors
from drslamd.slam.optimizer.banded.lapses.mirrors import FEWEST, on_likelier_side
from drslamd.slam.optimizer.banded.lapses.stretches import (
    UNKNOWN_M,
    likely_stretches,
    with_freed,
)
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

COUNT, SINCE = 40, 30
"""Keyframes, and the one from which on robot 1 has no wheels."""


def freed_team(seed: int, robots: int = 3, count: int = COUNT) -> tuple[Problem, Array]:
    problem, truth = team_problem(seed, robots=robots, count=count, closures=4)
    problem = stuck(held_at(problem, truth), 1, SINCE, count)
    freed = [one for one in likely_stretches(problem) if one.robot == 1 and one.stands]
    return with_freed(problem, freed[-1]), truth


def ways(truth: Array, robots: int = 3) -> Array:
    """Which poses are of robot 1 without wheels."""
    return np.arange(robots * (SINCE + 1) + 1, len(truth), robots)


def mirrored(truth: Array) -> Array:
    """The truth with robot 1 on the other side of robots 0 and 2 in these seconds."""
    poses = truth.copy()
    for k in ways(truth):
        a, b, here = (complex(*poses[at, :2]) for at in (k - 1, k + 1, k))
        u = (b - a) / abs(b - a)
        there = a + u * np.conj((here - a) / u)
        poses[k, :2] = there.real, there.imag
    return np.asarray(poses)


def solved(problem: Problem, initial: Array) -> tuple[Equations, Point]:
    equations = Equations(replace(problem, initial=initial))
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return equations, descend(equations, start, 60)


def answer(equations: Equations, point: Point) -> Point:
    return on_likelier_side(equations, point, equations.problem.freed[0], 60, TOLERANCE)


def off(point: Point, truth: Array) -> float:
    return float(np.hypot(*(point.poses - truth)[ways(truth), :2].T).max())


@pytest.mark.parametrize("seed", [3, 6])
def test_who_is_solved_on_the_other_side_is_brought_back(seed: int) -> None:
    problem, truth = freed_team(seed)
    equations, wrong = solved(problem, mirrored(truth))
    assert off(wrong, truth) > 10
    assert off(answer(equations, wrong), truth) < 0.55


@pytest.mark.parametrize("seed", [2, 3, 5, 6])
def test_who_is_on_the_right_side_stays_there(seed: int) -> None:
    problem, truth = freed_team(seed)
    equations, right = solved(problem, truth)
    assert answer(equations, right).poses == pytest.approx(right.poses, abs=1e-3)


def test_a_way_that_bends_less_but_fits_less_is_not_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, truth = freed_team(3)
    equations, right = solved(problem, truth)
    monkeypatch.setattr(mirrors._Way, "least_bent", lambda way: way.places[0] + 5.0)
    monkeypatch.setattr(mirrors._Way, "is_other_side", lambda *_: True)
    really = descend(equations, right.calibration, 60)
    worse = replace(really, poses=really.poses + [0.2, 0.0, 0.0])
    worse = Point.of(equations.problem, worse.poses * [1.2, 1, 1], right.calibration)
    monkeypatch.setattr(mirrors, "descend", lambda *_: worse)
    assert answer(equations, right) is right


def test_of_two_robots_of_a_stretch_that_is_over_and_of_wheels_that_spin_no_side_is_told() -> None:
    problem, truth = freed_team(3, robots=2)
    equations, point = solved(problem, truth)
    assert answer(equations, point) is point
    problem, truth = freed_team(3)
    (freed,) = problem.freed
    over = replace(problem, freed=(replace(freed, links=freed.links[:-1], added=freed.added[:-1]),))
    equations, wrong = solved(over, mirrored(truth))
    assert answer(equations, wrong) is wrong
    spun = replace(problem, freed=(replace(freed, stands=False),))
    equations, wrong = solved(spun, mirrored(truth))
    assert answer(equations, wrong) is wrong


@pytest.mark.parametrize(("count", "is_told"), [(FEWEST - 1, False), (FEWEST, True)])
def test_fewer_places_tell_no_side(count: int, is_told: bool) -> None:
    """Of the seconds after them ranges to one robot do not count."""
    problem, truth = freed_team(3)
    sees = np.isin(problem.ranges.j, ways(truth)[count - 1 :]) & (problem.ranges.pair == 0)
    ranges = replace(problem.ranges, sigma=np.where(sees, UNKNOWN_M, problem.ranges.sigma))
    equations, point = solved(replace(problem, ranges=ranges), truth)
    way = mirrors._Way.along(equations.problem, point, problem.freed[0])
    assert (way is not None) is is_told


@pytest.mark.parametrize(
    ("a", "from_a", "b", "from_b", "places"),
    [
        (0j, 5.0, 6 + 0j, 5.0, [3 + 4j, 3 - 4j]),
        (1 + 1j, 2.0, 1 + 4j, 1.0, [1 + 3j, 1 + 3j]),
        # too short to meet: in between, where both are as wrong
        (0j, 1.0, 4 + 0j, 1.0, [2 + 0j, 2 + 0j]),
    ],
)
def test_circles_meet_on_either_side_of_their_middles(
    a: complex, from_a: float, b: complex, from_b: float, places: list[complex]
) -> None:
    found = mirrors._meet(a, from_a, b, from_b)
    assert sorted(found, key=lambda z: z.imag) == pytest.approx(
        sorted(places, key=lambda z: z.imag)
    )


@pytest.mark.parametrize("seed", range(8))
def test_the_least_bent_way_is_that_of_all_ways(seed: int) -> None:
    """Each side in each second tried: what a way costs is told apart from the search."""
    rng = np.random.default_rng(seed)
    places = rng.normal(size=(2, 6)) + 1j * rng.normal(size=(2, 6))
    seconds = np.array([1.0, 3.0, 1.0, 1.0, 2.0, 1.0])
    way = mirrors._Way(
        np.arange(6), places, rng.random((2, 6)), 0.5 * seconds, seconds, 0.3j, 0.2 + 0.1j
    )
    costs = {}
    for sides in itertools.product(range(2), repeat=6):
        chosen = places[list(sides), range(6)]
        steps = np.abs(np.diff(np.append(way.before, chosen))) / way.reach
        costs[sides] = (
            way.bends(chosen) + (steps**2).sum() + way.misfit[list(sides), range(6)].sum()
        )
    best = min(costs, key=lambda sides: costs[sides])
    assert way.least_bent() == pytest.approx(places[list(best), range(6)])
