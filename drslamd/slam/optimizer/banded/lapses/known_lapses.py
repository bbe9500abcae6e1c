"""Lapses that were found before: what is freed again, and what is known of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from drslamd.conventions import GRID_HZ
from drslamd.slam.graph.estimate import Lapse
from drslamd.slam.optimizer.banded.lapses.mirrors import on_likelier_side
from drslamd.slam.optimizer.banded.lapses.placements import best_placed
from drslamd.slam.optimizer.banded.lapses.stretches import (
    freed_links,
    likely_stretches,
    span,
    with_freed,
)
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Freed, Problem

GAIN = 30.0
"""Of cost: what a stretch that is freed must explain; where nothing stood or spun the best gains
less than 20, or the rest still does not fit."""
SETTLES_S = 10.0
"""After a lapse: where the robot went meanwhile shows in the ranges since."""
REGARDED_S = 60.0
"""After a lapse: what else it may have been is asked for so long, and not each second for hours."""


def freed_again(problem: Problem, robots: list[int], lapses: Iterable[Lapse]) -> Problem:
    """With lapses freed that were found before, as far as they are by now.

    Args:
        robots: as the problem numbers them.
    """
    lapses = list(lapses)
    if not lapses:
        return problem
    odometry, found = problem.odometry, likely_stretches(problem)
    first, last = problem.n[odometry.i], problem.n[odometry.j]
    for lapse in lapses:
        if lapse.robot not in robots:
            continue
        robot = robots.index(lapse.robot)
        inside = (odometry.robot == robot) & (first < lapse.last) & (last > lapse.first)
        links = np.flatnonzero(inside)
        links = links[np.argsort(last[links], kind="stable")]
        if not len(links):
            continue
        same = [f for f in found if f.stands == lapse.stood and np.isin(links, f.links).all()]
        freed = same[0] if same else freed_links(problem, robot, links, lapse.stood)
        problem = with_freed(problem, replace(freed, is_settled=lapse.is_settled))
    return problem


def lapse_of(problem: Problem, robots: list[int], freed: Freed) -> Lapse:
    """By its name; `robots`: as the problem numbers them."""
    first, last = span(problem, freed)
    return Lapse(robots[freed.robot], first, last, freed.stands, freed.is_settled)


def freed_lately(problem: Problem) -> bool:
    """Did a stretch that is freed end a minute ago or less?"""
    return any(
        newest_keyframe(problem, one.robot) <= span(problem, one)[1] + REGARDED_S * GRID_HZ
        for one in problem.freed
    )


def newest_keyframe(problem: Problem, robot: int) -> int:
    """The last keyframe of a robot, as the problem numbers it, that has links."""
    return int(problem.n[problem.odometry.j[problem.odometry.robot == robot]].max())


def still_freed(problem: Problem, point: Point) -> tuple[Freed, ...]:
    """Those along which robots did something else than their wheels say."""
    out = []
    for freed in problem.freed:
        error = point.link[freed.links]
        noise = problem.odometry.covariance[freed.links] - freed.added
        squares = np.einsum("ki,ki->", error, np.linalg.solve(noise, error[..., None])[..., 0])
        if squares >= GAIN:
            out.append(freed)
    return tuple(out)


def settled(
    equations: Equations, point: Point, most: int, tolerance: float
) -> tuple[Equations, Point]:
    """The problem and its solution, with the ways behind all stretches where they fit best; those
    of which that is clear, and some seconds old, are settled.

    Args:
        point: the solution as it was come to.
        most, tolerance: see `best`.
    """
    problem, freed = equations.problem, list(equations.problem.freed)
    if all(one.is_settled for one in freed):
        return equations, point
    for at, one in enumerate(freed):
        if not one.is_settled:
            point = on_likelier_side(equations, point, one, most, tolerance)
            point, is_clear = best_placed(equations, point, one, most, tolerance)
            is_old = (
                newest_keyframe(problem, one.robot) >= span(problem, one)[1] + SETTLES_S * GRID_HZ
            )
            freed[at] = replace(one, is_settled=bool(is_clear and is_old))
    return Equations(replace(problem, freed=tuple(freed)), like=equations), point
