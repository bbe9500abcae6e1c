"""A kept factor against the factor of the whole system, made anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kept_scenes import a_team_problem, shaken
from slam_scenes import Array

from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem
from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept import border
from drslamd.slam.optimizer.kept.believed import Believed
from drslamd.slam.optimizer.kept.head import LONG_TAIL, TAIL, keys_of, tail_of
from drslamd.slam.optimizer.kept.kept_factor import Current, KeptFactor, build
from drslamd.slam.optimizer.problem import Problem

ROBOTS = 3


@pytest.fixture(scope="module")
def team() -> TeamProblem:
    return a_team_problem()


def is_close(found: Array, expected: Array) -> bool:
    """What is kept has half the digits."""
    return np.allclose(found, expected, rtol=1e-4, atol=2e-6)


def by_another_order(problem: Problem, vector: Array, start: BandLayout, end: BandLayout) -> Array:
    """A vector over the unknowns of one layout, in another."""
    out = np.zeros(end.band + end.border)
    out[end.poses] = vector[start.poses]
    out[end.constants] = vector[start.constants]
    assert len(end.constants) == len(start.constants)
    return out


def anew(believed: Believed, right: Array, flat: BandLayout) -> Array:
    """The solution of the whole system."""
    equations = Equations(believed.problem)
    if believed.claims is None:
        system = equations.weighed(believed.point)
    else:
        system = equations.claimed(believed.point, believed.claims)
    factor = BandFactor.of(system)
    assert factor is not None
    solved = factor.solved(by_another_order(believed.problem, right, flat, equations.layout))
    assert solved is not None
    return by_another_order(believed.problem, solved, equations.layout, flat)


def current(kept: KeptFactor | None, believed: Believed, team: TeamProblem) -> Current:
    assert kept is not None
    places = kept.head.places(believed.problem, team.pairs)
    assert places is not None
    found = kept.on_top(believed, places)
    assert found is not None
    return found


@pytest.mark.parametrize("is_claimed", [False, True])
@pytest.mark.parametrize("tail", [0, TAIL, 9])
def test_of_one_point_it_is_the_factor_of_the_whole(
    team: TeamProblem, tail: int, is_claimed: bool
) -> None:
    problem = replace(team.problem, width=np.array([1.0, 1.2, 1.4]))
    claims = np.array([1.5, 2.0, 1.2]) if is_claimed else None
    believed = Believed(problem, shaken(problem), claims)
    count = len(problem.n)
    kept = build(believed, team.pairs, np.arange(count) >= count - tail * ROBOTS, with_blocks=True)
    found = current(kept, believed, team)
    right = np.random.default_rng(0).normal(size=3 * count + len(found.places.flat.constants))
    expected = anew(believed, right, found.places.flat)
    assert is_close(found.solved(right), expected)
    both = found.solved(np.stack([right, 2 * right], axis=-1))
    assert is_close(both[:, 1], 2 * expected)


def test_a_tail_that_became_head_changes_nothing_of_the_same_point(team: TeamProblem) -> None:
    problem = team.problem
    believed = Believed(problem, shaken(problem))
    count = len(problem.n)
    long = np.arange(count) >= count - 2 * LONG_TAIL * ROBOTS
    before = current(build(believed, team.pairs, long, with_blocks=True), believed, team)
    assert len(before.places.tail) == 2 * LONG_TAIL * ROBOTS
    grown = before.kept.grown(believed, before.places)
    after = current(grown, believed, team)
    assert len(after.places.tail) == TAIL * ROBOTS
    assert grown is not None
    assert len(grown.head.front) < 3 * ROBOTS
    right = np.random.default_rng(0).normal(size=3 * count + len(after.places.flat.constants))
    expected = anew(believed, right, after.places.flat)
    assert is_close(after.solved(right), expected)


def test_the_newest_pose_of_each_robot_is_never_eliminated(team: TeamProblem) -> None:
    problem = team.problem
    believed = Believed(problem, shaken(problem))
    kept = build(believed, team.pairs, np.zeros(len(problem.n), dtype=bool), with_blocks=False)
    assert kept is not None
    assert not kept.blocks
    inside = set(kept.head.keys[kept.head.front].tolist()) | set(kept.head.far.tolist())
    for robot in range(ROBOTS):
        newest = np.flatnonzero(problem.robot_id == robot)[-1]
        assert keys_of(problem)[newest] in inside


def test_a_bias_that_is_new_joins_the_border(team: TeamProblem) -> None:
    """Two pairs at first; the third has met since then, in the tail alone."""
    problem, pairs = team.problem, team.pairs
    count = len(problem.n)
    is_tail = tail_of(problem)
    ranges = problem.ranges
    stays = (ranges.pair != 1) | is_tail[ranges.i] | is_tail[ranges.j]
    whole = replace(problem, ranges=ranges.chosen(stays))
    two = ranges.chosen(ranges.pair != 1)
    first = replace(problem, pairs=2, ranges=replace(two, pair=np.where(two.pair == 2, 1, 0)))
    point = shaken(whole)
    constants = point.calibration
    before = replace(constants, bias=constants.bias[[0, 2]])
    start = Believed(
        first,
        replace(
            Point.of(first, point.poses, before),
            threshold=point.threshold[[0, 2]],
        ),
    )
    kept = build(start, [pairs[0], pairs[2]], is_tail, True)
    believed = Believed(whole, point)
    found = current(kept, believed, team)
    right = np.random.default_rng(0).normal(size=3 * count + len(found.places.flat.constants))
    expected = anew(believed, right, found.places.flat)
    assert is_close(found.solved(right), expected)


def with_a_border(
    team: TeamProblem, monkeypatch: pytest.MonkeyPatch
) -> tuple[Believed, KeptFactor, Current]:
    """What is kept, and the same with the tail on top, of a team whose border is kept however small
    it is."""
    monkeypatch.setattr(border, "FEW", 0)
    believed = Believed(team.problem, shaken(team.problem))
    kept = build(believed, team.pairs, tail_of(team.problem), with_blocks=True)
    assert kept is not None
    return believed, kept, current(kept, believed, team)


def test_a_border_that_is_kept_is_that_of_the_same_point(
    team: TeamProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    believed, kept, first = with_a_border(team, monkeypatch)
    second = current(replace(kept, border=first.border), believed, team)
    assert second.border is first.border
    right = np.random.default_rng(0).normal(
        size=3 * len(team.problem.n) + len(second.places.flat.constants)
    )
    assert np.allclose(second.solved(right), first.solved(right), rtol=1e-9, atol=1e-12)


def test_of_a_border_of_another_time_poses_move_as_constants_are_held_there(
    team: TeamProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where it holds constants a million times as tightly, it is as if these were known."""
    believed, kept, first = with_a_border(team, monkeypatch)
    tight = replace(first.border, lower=1e3 * first.border.lower)
    second = current(replace(kept, border=tight), believed, team)
    at = second.layout.poses[np.flatnonzero(second.layout.poses[:, 0] >= 0)[-ROBOTS:]].ravel()
    whole = first.lower @ first.lower.T
    known = np.linalg.inv(whole)[np.ix_(at, at)]
    assert np.allclose(second.covariance(at), known, rtol=1e-3, atol=1e-9)
    assert (np.diag(first.covariance(at)) >= np.diag(known)).all()
