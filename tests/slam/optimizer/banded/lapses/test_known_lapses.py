"""Lapses that were found: as long as they are known, they are freed again."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lapse_scenes import a_team, driven, nominal
from slam_problems import CLOCKS

from drslamd.slam.graph.estimate import Lapse
from drslamd.slam.optimizer.banded.lapses import known_lapses
from drslamd.slam.optimizer.banded.lapses.known_lapses import (
    GAIN,
    REGARDED_S,
    SETTLES_S,
    freed_again,
    freed_lately,
    lapse_of,
    settled,
    still_freed,
)
from drslamd.slam.optimizer.banded.lapses.placements import PlacedWay
from drslamd.slam.optimizer.banded.lapses.stretches import likely_stretches, with_freed
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.problem import Freed, Problem


def freed_team() -> tuple[Problem, Freed]:
    problem = driven({10: 0.0, 11: 0.0})
    (freed,) = likely_stretches(problem)
    return problem, freed


def test_a_lapse_that_was_found_is_freed_again_as_far_as_it_is_by_now() -> None:
    problem, freed = freed_team()
    name = lapse_of(problem, [4, 6, 9], freed)
    assert name == Lapse(6, CLOCKS[1] + 90, CLOCKS[1] + 130, True)
    (again,) = freed_again(problem, [4, 6, 9], [name]).freed
    assert again.links.tolist() == freed.links.tolist()
    # its wheels stand still
    longer = driven(dict.fromkeys(range(10, 15), 0.0))
    (again,) = freed_again(longer, [4, 6, 9], [name]).freed
    assert lapse_of(longer, [4, 6, 9], again) == name._replace(last=CLOCKS[1] + 160)


def test_a_lapse_that_no_longer_shows_in_the_links_stays_where_it_was() -> None:
    """As where what is old was thinned."""
    problem, freed = freed_team()
    name = lapse_of(problem, [4, 6, 9], freed)
    (again,) = freed_again(driven({}), [4, 6, 9], [name]).freed
    assert again.links.tolist() == freed.links.tolist()
    assert again.added == pytest.approx(freed.added)


def test_of_who_is_not_there_or_did_not_drive_then_nothing_is_freed() -> None:
    problem, freed = freed_team()
    name = lapse_of(problem, [4, 6, 9], freed)
    assert freed_again(problem, [4, 7, 9], [name]) is problem
    long_ago = name._replace(first=name.first - 10_000, last=name.last - 10_000)
    assert freed_again(problem, [4, 6, 9], [long_ago]) is problem


@pytest.mark.parametrize(("times", "is_kept"), [(0.99, False), (1.01, True)])
def test_a_stretch_stays_freed_where_the_robot_did_something_else(
    times: float, is_kept: bool
) -> None:
    """One link is off along x so that its square over its variance comes to the limit."""
    problem, freed = freed_team()
    odometry = replace(problem.odometry, covariance=np.tile(0.1**2 * np.eye(3), (132, 1, 1)))
    problem = with_freed(replace(problem, odometry=odometry), freed)
    link = np.zeros((132, 3))
    link[freed.links[1]] = [0.1 * math.sqrt(times * GAIN), 0.0, 0.0]
    point = replace(nominal(a_team()[0]), link=link)
    assert bool(still_freed(problem, point)) is is_kept


@pytest.mark.parametrize(
    ("second", "is_clear", "is_settled"), [(24, True, False), (23, True, True), (23, False, False)]
)
def test_a_lapse_is_settled_after_ten_seconds_if_then_it_is_clear_where_it_led(
    second: int, is_clear: bool, is_settled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last keyframe is number 44; the stretch ends at 35, or at 34."""
    assert SETTLES_S == 10
    problem = driven({second + 9: 0.8})
    (freed,) = likely_stretches(problem)
    assert lapse_of(problem, [4, 6, 9], freed).last == CLOCKS[1] + 10 * (second + 11)
    equations, point = Equations(with_freed(problem, freed)), nominal(a_team()[0])
    better = replace(point, steps=77)
    monkeypatch.setattr(known_lapses, "best_placed", lambda *_: PlacedWay(better, is_clear))
    said, at = settled(equations, point, 60, TOLERANCE)
    assert at is better
    (again,) = said.problem.freed
    assert again.is_settled is is_settled
    assert lapse_of(problem, [4, 6, 9], again).is_settled is is_settled
    (remembered,) = freed_again(problem, [4, 6, 9], [lapse_of(problem, [4, 6, 9], again)]).freed
    assert remembered.is_settled is is_settled


def test_the_side_on_which_a_way_bends_less_is_where_the_way_behind_begins(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, freed = freed_team()
    point = nominal(a_team()[0])
    bent, behind = (replace(point, poses=point.poses + k) for k in (1.0, 2.0))
    monkeypatch.setattr(known_lapses, "on_likelier_side", lambda *_: bent)
    asked: list[object] = []

    def placed(equations: Equations, at: object, *_: object) -> PlacedWay:
        asked.append(at)
        return PlacedWay(behind, is_clear=False)

    monkeypatch.setattr(known_lapses, "best_placed", placed)
    _, found = settled(Equations(with_freed(problem, freed)), point, 60, TOLERANCE)
    assert asked == [bent]
    assert found is behind


def test_of_what_is_settled_nothing_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, freed = freed_team()
    monkeypatch.delattr(known_lapses, "best_placed")
    equations = Equations(with_freed(problem, replace(freed, is_settled=True)))
    point = nominal(a_team()[0])
    assert settled(equations, point, 60, TOLERANCE) == (equations, point)


@pytest.mark.parametrize(("later_s", "is_lately"), [(0.0, True), (0.1, False)])
def test_what_was_freed_is_asked_about_again_for_a_minute(later_s: float, is_lately: bool) -> None:
    problem, freed = freed_team()
    assert not freed_lately(problem)
    problem = with_freed(problem, freed)
    odometry = problem.odometry
    newest = odometry.j[odometry.robot == freed.robot].max()
    end = problem.n[odometry.j[freed.links[-1]]]
    n = problem.n.copy()
    n[newest] = end + round(10 * (REGARDED_S + later_s))
    assert freed_lately(replace(problem, n=n)) is is_lately
