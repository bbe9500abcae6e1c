"""Scores of mountings against dense formulas and against what the cost loses; who is let go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dense_problems import (
    heavy_curvature,
    information_of,
    jacobian,
    link_residuals,
    mounting_curvature,
    packed,
    range_residuals,
    range_weights,
)
from slam_problems import held_at, mismeasured, mismounted, team_problem

from drslamd.slam.optimizer.banded import mountings
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.mountings import WORTH, Scores, fitted, let_go, scores
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

MOST = 60


def solved(problem: Problem) -> tuple[Equations, Point]:
    equations = Equations(problem)
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return equations, descend(equations, start, MOST)


def scored(problem: Problem) -> Scores:
    equations, point = solved(problem)
    return scores(equations, point, weighed(equations, point))


def weighed(equations: Equations, point: Point) -> BandFactor:
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    return factor


def doubts(track: tuple[int, ...] = (), antenna: tuple[int, ...] = (), robots: int = 3) -> Doubted:
    number = np.arange(robots)
    return Doubted(np.isin(number, track), np.isin(number, antenna))


# scores


def dense_scores(problem: Problem, point: Point) -> Scores:
    """f' V^-1 f of each mounting out of matrices in which all mountings have their columns."""
    robots = len(problem.priors.scale)
    wide = replace(problem, doubted=doubts(tuple(range(robots)), tuple(range(robots)), robots))
    x = packed(point.poses, point.calibration, wide.doubted)
    weights = range_weights(wide, x, point.threshold)
    bare = information_of(wide, x, weights)
    whole = bare + heavy_curvature(wide, x) + mounting_curvature(wide, x)
    first = len(x) - 3 * robots
    kept = np.concatenate([problem.doubted.track, np.repeat(problem.doubted.antenna, 2)])
    inside = np.concatenate([np.arange(first), first + np.flatnonzero(kept)])
    links = jacobian(lambda v: link_residuals(wide, v), x).T @ link_residuals(wide, x)
    seen = np.array(range_residuals(wide, x))
    ranges = jacobian(lambda v: range_residuals(wide, v), x).T @ (weights * seen)
    pull = links + ranges
    found = []
    blocks = [[k] for k in range(robots)] + [
        [robots + 2 * k, robots + 2 * k + 1] for k in range(robots)
    ]
    blocks.append([robots + k for k in range(2 * robots) if not kept[robots + k]])
    for block in blocks:
        at = first + np.array(block, dtype=int)
        if kept[block].any() or not block:
            found.append(0.0)
            continue
        across = bare[np.ix_(inside, at)]
        left = bare[np.ix_(at, at)] - across.T @ np.linalg.solve(
            whole[np.ix_(inside, inside)], across
        )
        left += 100 * np.eye(len(block))
        found.append(float(pull[at] @ np.linalg.solve(left, pull[at])))
    return Scores(np.array(found[:robots]), np.array(found[robots:-1]), found[-1])


@pytest.mark.parametrize(
    "doubted", [doubts(), doubts((1,)), doubts((0,), (1, 2))], ids=["none", "one", "three"]
)
def test_scores_are_those_of_the_dense_matrices(doubted: Doubted) -> None:
    """With a track and an antenna that are off; it is 0 of those that are unknowns already."""
    problem, truth = team_problem(3, robots=3, count=12, is_thinned=True)
    beside = ((0.0, 0.0), (0.1, 0.15), (0.0, 0.0))
    problem = mismounted(problem, truth, (0.0, 0.3, 0.0), beside, turned_sigma=0.2)
    # the gauge is none of the first unknowns, which everybody can name by mistake
    problem = replace(problem, gauge=17, initial=truth)
    equations, point = solved(replace(problem, doubted=doubted))
    found = scores(equations, point, weighed(equations, point))
    expected = dense_scores(equations.problem, point)
    assert found.track == pytest.approx(expected.track, rel=1e-3, abs=1e-3)
    assert found.antenna == pytest.approx(expected.antenna, rel=1e-3, abs=1e-3)
    assert found.antennas == pytest.approx(expected.antennas, rel=1e-3, abs=1e-3)
    assert (found.track[doubted.track] == 0).all()
    assert (found.antenna[doubted.antenna] == 0).all()
    assert min(found.track.min(), found.antenna.min()) >= 0


def test_a_score_is_what_the_cost_loses_where_it_is_let_go() -> None:
    """To first order, of a small fault: turns that are 6 % longer."""
    problem, truth = team_problem(4, robots=2, count=60, link_error=0.3, range_error=0.01)
    problem = mismounted(held_at(problem, truth), truth, (0.0, 0.06))
    equations, point = solved(problem)
    score = scores(equations, point, weighed(equations, point)).track[1]
    free = replace(problem, initial=point.poses, doubted=doubts((1,), robots=2))
    wide = Equations(free)
    better = descend(wide, point.calibration, MOST)
    costs = [e.cost(p, point.threshold) for e, p in ((equations, point), (wide, better))]
    # its own prior costs something, and is no part of the score
    own = float(np.log1p((better.calibration.turn[1] / 0.01) ** 2))
    assert better.calibration.turn[1] == pytest.approx(0.06, abs=0.02)
    assert costs[0] - costs[1] + own == pytest.approx(score, rel=0.15)
    assert score > 5


@pytest.mark.parametrize("seed", range(4))
def test_mountings_as_configured_do_not_ask(seed: int) -> None:
    found = scored(team_problem(seed, robots=3, count=60)[0])
    assert not found.ask()
    assert max(found.track.max(), found.antenna.max()) < 20
    assert found.antennas < 30


@pytest.mark.parametrize("robot", [0, 2])
def test_a_track_or_an_antenna_that_is_far_off_asks_by_its_own_score_most(robot: int) -> None:
    problem, truth = team_problem(5, robots=3, count=80)
    turn = tuple(0.4 * (k == robot) for k in range(3))
    found = scored(mismounted(problem, truth, turn))
    assert found.ask()
    assert found.track.argmax() == robot
    beside = tuple((0.3 * (k == robot), -0.2 * (k == robot)) for k in range(3))
    found = scored(mismounted(problem, truth, antenna=beside))
    assert found.ask()
    assert found.antenna.argmax() == robot


def test_what_moves_no_error_scores_nothing() -> None:
    """A robot that never turns says nothing of its track."""
    problem, _ = team_problem(6, robots=2, count=20)
    measured = problem.odometry.measured.copy()
    measured[:, 2] = 0
    links = np.arange(len(measured))
    straight = mismeasured(problem, links, measured)
    assert scored(straight).track.tolist() == [0, 0]


def test_of_a_system_that_cannot_be_solved_nothing_asks() -> None:
    equations, point = solved(team_problem(6, robots=2, count=6)[0])
    factor = weighed(equations, point)
    found = scores(equations, point, replace(factor, schur=np.zeros_like(factor.schur)))
    assert found.track.tolist() == found.antenna.tolist() == [0, 0]


# who is let go


@pytest.mark.parametrize(("score", "asks"), [(29.9, False), (30.1, True)])
def test_a_mounting_asks_beyond_thirty(score: float, asks: bool) -> None:
    low, high = np.array([1.0, 2.0]), np.array([1.0, score])
    for found in (Scores(low, high), Scores(high, low)):
        assert found.ask() is asks
    wider = let_go(doubts((0,), (), 2), Scores(high, low))
    assert wider.track.tolist() == [True, asks]
    assert wider.antenna.tolist() == [False, False]
    wider = let_go(doubts((), (), 2), Scores(low, high))
    assert wider.track.tolist() == [False, False]
    assert wider.antenna.tolist() == [False, asks]


@pytest.mark.parametrize(
    ("score", "robots", "asks"), [(53, 3, False), (55, 3, True), (37, 2, True)]
)
def test_all_antennas_ask_together_beyond_eighteen_for_each_robot(
    score: float, robots: int, asks: bool
) -> None:
    found = Scores(np.zeros(robots), np.full(robots, 12.0), score)
    assert found.ask() is asks
    assert not found.ask_alone()
    wider = let_go(Doubted.none(robots), found)
    assert wider.antenna.tolist() == [asks] * robots
    assert not wider.track.any()
    # what they take off the cost must be worth it
    assert found.least_gain() == WORTH * robots
    assert replace(found, antenna=np.full(robots, 31.0)).least_gain() == 0


@pytest.mark.parametrize(("score", "is_let_go"), [(21.9, False), (22.1, True)])
def test_an_antenna_beside_one_that_is_off_asks_sooner(score: float, is_let_go: bool) -> None:
    none = np.zeros(2)
    for doubted, first in ((doubts((), (0,), 2), 0.0), (doubts((), (), 2), 31.0)):
        wider = let_go(doubted, Scores(none, np.array([first, score])))
        assert wider.antenna.tolist() == [True, is_let_go]
    assert not let_go(doubts((), (), 2), Scores(none, np.array([0.0, score]))).any()


def test_two_antennas_that_are_off_alike_are_found_though_each_hides_the_other() -> None:
    """By 0.3 m ahead, as where a team was mounted alike."""
    beside = ((0.3, 0.0), (0.3, 0.0))
    problem, truth = team_problem(7, robots=2, count=90, range_error=0.03)
    problem = mismounted(held_at(problem, truth), truth, antenna=beside)
    equations, point = fit(problem)
    assert equations.problem.doubted.antenna.tolist() == [True, True]
    assert point.calibration.antenna == pytest.approx(np.array(beside), abs=0.1)


def fit(problem: Problem) -> tuple[Equations, Point]:
    equations, point = solved(problem)
    found = scores(equations, point, weighed(equations, point))
    return fitted(equations, point, found, MOST, TOLERANCE)


def test_mountings_that_are_off_are_found_with_their_values() -> None:
    problem, truth = team_problem(7, robots=3, count=120, range_error=0.03)
    problem = held_at(problem, truth)
    beside = ((0.25, -0.2), (0.0, 0.0), (0.0, 0.0))
    problem = mismounted(problem, truth, (0.0, 0.0, 0.35), beside, turned_sigma=0.2)
    equations, point = fit(problem)
    doubted = equations.problem.doubted
    assert doubted.track.tolist() == [False, False, True]
    assert doubted.antenna.tolist() == [True, False, False]
    assert point.converged
    assert point.calibration.turn == pytest.approx([0, 0, 0.35], abs=0.05)
    assert point.calibration.antenna == pytest.approx(np.array(beside), abs=0.05)
    before = solved(problem)[1]
    errors = [np.hypot(*(p.poses - truth)[:, :2].T).max() for p in (before, point)]
    assert errors[1] < 0.5 * errors[0]


def test_who_does_not_ask_is_not_let_go_and_nothing_is_solved_again() -> None:
    equations, point = solved(team_problem(1, robots=3, count=40)[0])
    none = Scores(np.full(3, 30.0), np.full(3, 30.0))
    same, where = fitted(equations, point, none, MOST, TOLERANCE)
    assert same is equations
    assert where is point


def test_mountings_are_let_go_round_by_round_but_not_for_ever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One more asks in each round; those that were let go before stay so."""
    problem, _ = team_problem(1, robots=3, count=6)
    equations, point = solved(problem)
    seen: list[Doubted] = []

    def asking(e: Equations, p: Point, factor: BandFactor) -> Scores:
        seen.append(e.problem.doubted)
        number, rounds = np.arange(3), len(seen)
        return Scores(
            np.where(number == rounds, 99.0, 0.0), np.where(number == rounds - 3, 99.0, 0.0)
        )

    monkeypatch.setattr(mountings, "scores", asking)
    first = Scores(np.array([99.0, 0, 0]), np.zeros(3))
    end, _ = fitted(equations, point, first, MOST, TOLERANCE)
    assert [d.track.tolist() for d in seen] == [
        [True, False, False],
        [True, True, False],
        [True, True, True],
        [True, True, True],
    ]
    assert end.problem.doubted.antenna.tolist() == [True, False, False]
    assert len(seen) == mountings.ROUNDS


def test_each_round_goes_on_from_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, _ = team_problem(1, robots=2, count=10)
    equations, point = solved(problem)
    ends, asked = [point], []

    def watched(e: Equations, start: Calibration, most: int, tolerance: float) -> Point:
        assert e.problem.initial is ends[-1].poses
        assert start is ends[-1].calibration
        assert (most, tolerance) == (MOST, TOLERANCE)
        ends.append(descend(e, start, most, tolerance))
        return ends[-1]

    def asking(e: Equations, p: Point, factor: BandFactor) -> Scores:
        assert p is ends[-1]
        asked.append(e)
        return Scores(np.array([0.0, 99.0]), np.zeros(2))

    monkeypatch.setattr(mountings, "descend", watched)
    monkeypatch.setattr(mountings, "scores", asking)
    found = Scores(np.array([99.0, 0]), np.zeros(2))
    end, where = fitted(equations, point, found, MOST, TOLERANCE)
    # the third time nobody asks who was not let go
    assert len(asked) == 2
    assert len(ends) == 3
    assert (end, where) == (asked[-1], ends[-1])
