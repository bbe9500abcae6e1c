"""Who is believed less, when, and by how much; and when nobody can say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_problems import (
    CLOCKS,
    held_at,
    links_of,
    mismeasured,
    slipping,
    stuck,
    team_problem,
)
from slam_scenes import Array

from drslamd.slam.optimizer.banded import odometry_levels
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.misfit import (
    FEW_OUTLIERS,
    Misfit,
    Run,
    misfit,
    outlier_share,
    runs,
)
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.odometry_levels import (
    BEFORE,
    FIRST_LEVEL,
    FLOOR,
    LONG_RUN,
    MOST_LEVEL,
    STANDS_OUT,
    TARGET,
    Levels,
    levelled,
    raised,
)
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

ROBOTS, COUNT = 4, 45
FAULT = (25, 31)
"""Keyframes between which something happens to robot 1."""


def a_team(seed: int) -> tuple[Problem, Array]:
    problem, truth = team_problem(seed, robots=ROBOTS, count=COUNT, closures=6)
    return held_at(problem, truth), truth


def nominal(problem: Problem) -> Point:
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return descend(Equations(problem), start, 60)


def explained(problem: Problem, point: Point | None = None, most: int = 60) -> Levels:
    point, equations = point or nominal(problem), Equations(problem)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    ratio = misfit(equations, point, factor).ratio(problem.odometry.robot, ROBOTS)
    return levelled(equations, point, ratio, runs(problem, point), most, TOLERANCE)


def worst(point: Point, truth: Array) -> float:
    return float(np.hypot(*(point.poses - truth)[:, :2].T).max())


def levels(problem: Problem, variance: Array) -> Array:
    """(robots, keyframes - 1) sigmas over the nominal ones."""
    links = problem.odometry
    out = np.zeros((ROBOTS, COUNT - 1))
    out[links.robot, links.i // ROBOTS] = np.sqrt(variance)
    return out


# faults


@pytest.mark.parametrize("seed", [1, 2, 7])
@pytest.mark.parametrize("fault", [stuck, slipping])
def test_who_was_stuck_or_slipped_for_six_seconds_is_blamed_alone_and_for_that_time(
    fault: object, seed: int
) -> None:
    problem, truth = a_team(seed)
    problem = fault(problem, 1, *FAULT)  # type: ignore[operator]
    point = nominal(problem)
    found = explained(problem, point)
    assert found.is_odometry
    assert worst(point, truth) > 1.5
    assert worst(found.point, truth) < 0.7
    level = levels(problem, found.seen)
    assert level[1, slice(*FAULT)].min() > 10
    assert np.delete(level, 1, axis=0).max() == 1
    # nor is anybody else feared
    assert np.delete(levels(problem, found.lately), 1, axis=0).max() == math.sqrt(TARGET)
    # a cell of two seconds on either side may take part of it
    assert np.delete(level[1], np.arange(FAULT[0] - 2, FAULT[1] + 2)).max() < 3
    assert np.median(level) == 1


@pytest.mark.parametrize("tried", [1, 2])
def test_of_two_with_a_fault_both_are_blamed_and_alone_where_so_many_are_tried(
    tried: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither explains all of it; where two are not tried what all cells asked for stays."""
    monkeypatch.setattr(odometry_levels, "MOST_TRIED", tried)
    problem = slipping(stuck(a_team(2)[0], 1, *FAULT), 2, 10, 16)
    found = explained(problem)
    level = levels(problem, found.seen)
    assert level[1, slice(*FAULT)].min() > 10
    assert level[2, 11:15].min() > 10
    assert bool(level[[0, 3]].max() == 1) is (tried == 2)


def test_fewer_are_not_blamed_where_that_leaves_more_outliers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All are asked for again, as if no solution with fewer robots fitted."""
    problem = slipping(a_team(2)[0], 1, *FAULT)
    assert np.delete(levels(problem, explained(problem).seen), 1, axis=0).max() == 1
    shares = iter([np.zeros(problem.pairs), *[np.full(problem.pairs, 1.0)] * 9])
    monkeypatch.setattr(odometry_levels, "outlier_share", lambda *_: next(shares))
    assert np.delete(levels(problem, explained(problem).seen), 1, axis=0).max() > 1


@pytest.mark.parametrize(
    ("share", "is_asked"), [(FEW_OUTLIERS - 1e-6, True), (FEW_OUTLIERS, False)]
)
def test_whose_fault_it_is_is_not_asked_where_odometry_does_not_explain_it(
    monkeypatch: pytest.MonkeyPatch, share: float, is_asked: bool
) -> None:
    """All that were raised stay so, for none of them is the cause."""
    problem = slipping(a_team(2)[0], 1, *FAULT)
    shares = iter([np.full(problem.pairs, share), *[np.zeros(problem.pairs)] * 9])
    monkeypatch.setattr(odometry_levels, "outlier_share", lambda *_: next(shares))
    others = np.delete(levels(problem, explained(problem).seen), 1, axis=0)
    assert bool(others.max() == 1) is is_asked


def test_what_was_seen_is_feared_to_have_gone_on_before_and_not_less() -> None:
    problem = stuck(a_team(2)[0], 1, *FAULT)
    found = explained(problem)
    assert (found.lately >= TARGET * found.seen * (1 - 1e-9)).all()
    assert (found.feared >= found.lately).all()
    feared = levels(problem, found.feared)
    # it is feared to linger, but not before it was seen
    assert feared[1, FAULT[1] + 5 :].min() > 3 * math.sqrt(TARGET)
    assert feared[1].min() > math.sqrt(TARGET)


def test_odometry_that_is_bad_all_along_is_believed_less_where_it_shows_and_feared_all_along() -> (
    None
):
    """Six times as noisy as configured, from the beginning to the end."""
    problem, truth = a_team(5)
    links = links_of(problem, 2, 0, COUNT)
    noise = np.random.default_rng(5).normal(0, [0.06, 0.06, 0.048], (len(links), 3))
    problem = mismeasured(problem, links, problem.odometry.measured[links] + noise)
    point = nominal(problem)
    found = explained(problem, point)
    assert found.is_odometry
    level, feared = levels(problem, found.seen), levels(problem, found.feared)
    assert np.mean(level[2] > 2) > 0.25
    assert np.delete(level, 2, axis=0).max() < 2
    assert feared[2].min() > 2 * math.sqrt(TARGET)
    assert np.delete(feared, 2, axis=0).max() < 2 * math.sqrt(TARGET)
    assert worst(found.point, truth) < 0.8 * worst(point, truth)


def test_the_end_is_as_exact_as_every_other_solution() -> None:
    """Rounds in between are rough."""
    problem = stuck(a_team(1)[0], 1, *FAULT)
    found = explained(problem)
    believed = raised(problem, found.seen, found.point)
    again = descend(Equations(believed), found.point.calibration, 10)
    assert found.point.converged
    assert np.abs(again.poses - found.point.poses).max() < 1e-6


# ranges that are wrong for long


def beside(seed: int, first: int, metres: float = 1.0) -> Problem:
    """From some second on the ranges of robots 0 and 1 are too long."""
    problem, _ = a_team(seed)
    ranges = problem.ranges
    wrong = (ranges.pair == 0) & (ranges.i // ROBOTS >= first)
    longer = replace(ranges, measured=ranges.measured + metres * wrong)
    return replace(problem, ranges=longer)


@pytest.mark.parametrize("seed", [1, 3, 7])
def test_one_pair_whose_ranges_were_wrong_for_ten_seconds_is_not_called_odometry(
    seed: int,
) -> None:
    problem = beside(seed, COUNT - 10)
    point = nominal(problem)
    (last,) = runs(problem, point)
    # one or two good ranges may lie among the outliers before it
    assert 10 <= last.count <= 13
    found = explained(problem, point)
    assert not found.is_odometry
    assert found.feared.max() > TARGET


@pytest.mark.parametrize(("times", "is_odometry"), [(0.999, False), (1.001, True)])
def test_an_explanation_that_leaves_many_outliers_is_none(
    times: float, is_odometry: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = slipping(a_team(2)[0], 1, *FAULT)
    point = nominal(problem)
    share = outlier_share(problem, explained(problem, point).point).max()
    assert 0 < share < FEW_OUTLIERS
    # below or above what is left
    monkeypatch.setattr(odometry_levels, "FEW_OUTLIERS", times * share)
    assert explained(problem, point).is_odometry is is_odometry


def test_an_explanation_that_was_not_reached_is_none() -> None:
    problem = slipping(a_team(2)[0], 1, *FAULT)
    found = explained(problem, most=0)
    assert not found.point.converged
    assert not found.is_odometry


def run(i: int, j: int, count: int = 10) -> Run:
    return Run(i, j, 0, 0, count)


@pytest.mark.parametrize(
    ("found", "is_one"),
    [
        ([], False),
        ([run(0, 1)], False),
        ([run(0, 1), run(2, 3)], False),
        ([run(0, 1), run(1, 3)], True),
        ([run(0, 1), run(0, 2), run(2, 3)], True),
        ([run(0, 1, LONG_RUN - 1)], False),
        ([run(0, 1, LONG_RUN)], True),
    ],
)
def test_who_contradicts_two_others_or_one_for_long_is_wrong_himself(
    found: list[Run], is_one: bool
) -> None:
    assert odometry_levels._is_one_robot(found) is is_one


# the pieces


@pytest.mark.parametrize("off", [-1, 0])
def test_a_run_points_to_both_robots_and_a_little_back_by_the_clock_of_each(off: int) -> None:
    problem, _ = a_team(1)
    seen = Run(1, 3, CLOCKS[1] + 10 * 30 + off, CLOCKS[3] + 10 * 20 + off, 12)
    level = levels(problem, odometry_levels._run_level(problem, [seen]))
    assert BEFORE == 30
    # a link belongs to the keyframe at its end
    expected = np.ones((ROBOTS, COUNT - 1))
    expected[1, 26:] = expected[3, 16:] = FIRST_LEVEL
    if off:
        expected[1, 26 - 1 + 0] = expected[3, 16 - 1] = 1
    assert np.array_equal(level, expected)


def one_link(variance: float, squares: float, checked: float) -> float:
    """What one cell of two links wants, that had this variance."""
    found = Misfit(np.array([squares, 0.0]), np.array([checked, 0.0]))
    cell = np.zeros(2, dtype=int)
    wanted = odometry_levels._wanted(found, np.full(2, variance), cell)
    assert wanted[0] == wanted[1]
    return float(wanted[0])


@pytest.mark.parametrize(
    ("variance", "squares", "checked", "wanted"),
    [
        # as large as it should be: nothing changes
        (1.0, TARGET * 2.0, 2.0, 1.0),
        (9.0, 0.0, 0.0, 1.0),
        # ten times as large, held by a tenth of a degree of freedom
        (1.0, 10 * TARGET * 2.0, 2.0, 20.1 / 2.1),
        (4.0, 10 * TARGET * 2.0, 2.0, 4 * 20.025 / 2.1),
        # where there is little to check, little is asked for
        (1.0, TARGET * 0.1, 0.0, 2.0),
        (1.0, 1e9, 1.0, MOST_LEVEL**2),
        (1.0, 0.0, 5.0, 1.0),
    ],
)
def test_a_cell_wants_the_variance_at_which_its_squares_are_what_could_be_checked(
    variance: float, squares: float, checked: float, wanted: float
) -> None:
    assert one_link(variance, squares, checked) == pytest.approx(wanted)


def test_where_runs_of_two_pairs_meet_in_one_robot_the_others_are_witnesses() -> None:
    problem, _ = a_team(1)
    ends = [Run(1, 3, CLOCKS[1] + 300, CLOCKS[3] + 300, 12)]
    ends.append(Run(0, 1, CLOCKS[0] + 250, CLOCKS[1] + 250, 12))
    level = levels(problem, odometry_levels._run_level(problem, ends))
    expected = np.ones((ROBOTS, COUNT - 1))
    expected[1, 21:] = FIRST_LEVEL
    assert np.array_equal(level, expected)


def test_what_lasted_for_twenty_seconds_is_feared_on_average_and_so_is_all_that_ever_was() -> None:
    problem, _ = a_team(1)
    rng = np.random.default_rng(6)
    variance = rng.uniform(1, 100, len(problem.odometry))
    lately_of, so_far_of = odometry_levels._lingering(problem, variance)
    feared, so_far = levels(problem, lately_of) ** 2, levels(problem, so_far_of) ** 2
    seen = levels(problem, variance) ** 2
    for robot in range(ROBOTS):
        for k in range(COUNT - 1):
            lately = seen[robot, max(0, k - 20) : k + 1].mean()
            assert feared[robot, k] == pytest.approx(max(seen[robot, k], lately))
            assert so_far[robot, k] == pytest.approx(seen[robot, : k + 1].mean())


def test_raised_links_have_more_noise_and_at_least_some() -> None:
    problem = stuck(a_team(1)[0], 1, *FAULT)
    variance = np.ones(len(problem.odometry))
    links = links_of(problem, 1, 25, 27)
    variance[links] = [4.0, 100.0]
    point = nominal(problem)
    believed = raised(problem, variance, point)
    assert believed.initial is point.poses
    for m in range(len(variance)):
        expected = variance[m] * problem.odometry.covariance[m]
        expected = expected + (variance[m] - 1) * np.diag(FLOOR)
        assert np.allclose(believed.odometry.covariance[m], expected, rtol=1e-12)
    rest = np.delete(np.arange(len(variance)), links)
    assert np.array_equal(believed.odometry.covariance[rest], problem.odometry.covariance[rest])


def test_links_that_are_believed_more_have_less_noise_and_no_more_than_that() -> None:
    problem = a_team(1)[0]
    variance = np.full(len(problem.odometry), 0.1)
    believed = raised(problem, variance, nominal(problem))
    assert np.allclose(believed.odometry.covariance, 0.1 * problem.odometry.covariance, rtol=1e-12)


@pytest.mark.parametrize(
    ("ratio", "level"),
    [
        ([STANDS_OUT, 3.9, 1.0, 1.0], [1, 1, 1, 1]),
        ([STANDS_OUT + 0.1, TARGET + 0.1, TARGET, 1.0], [3.28, 2.08, 1, 1]),
        ([1e6, 1.0, 1.0, 1.0], [MOST_LEVEL**2, 1, 1, 1]),
        # who is less than 0.3 times as bad as the worst may only look so
        ([10.0, 3.01, 2.99, 1.0], [8.0, 2.408, 1, 1]),
    ],
)
def test_robots_are_raised_by_twice_what_they_are_beyond_the_target(
    ratio: list[float], level: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, _ = a_team(1)
    point = nominal(problem)
    fits = Misfit(np.zeros(len(problem.odometry)), np.ones(len(problem.odometry)))
    monkeypatch.setattr(odometry_levels, "_solved", lambda e, v, near: (near, fits))
    found, _ = odometry_levels._robots_raised(Equations(problem), point, np.array(ratio))
    assert found == pytest.approx(level)


def test_robots_are_raised_again_until_they_fit_but_not_for_ever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, _ = a_team(1)
    point, solutions = nominal(problem), []

    def unfit(e: Equations, variance: Array, near: Point) -> tuple[Point, Misfit]:
        solutions.append(variance)
        squares = np.where(e.problem.odometry.robot == 2, 5.0, 0.0)
        return near, Misfit(squares, np.ones(len(squares)))

    monkeypatch.setattr(odometry_levels, "_solved", unfit)
    found, _ = odometry_levels._robots_raised(Equations(problem), point, np.array([5.0, 1, 1, 1]))
    assert len(solutions) == odometry_levels.ROUNDS_OF_ROBOTS
    # of 44 links: (5 * 44 + 1) / (44 + 1), twice that over the target, in each of the other rounds
    rounds = odometry_levels.ROUNDS_OF_ROBOTS - 1
    assert found == pytest.approx([4.0, 1.0, (2 * 221 / 45 / TARGET) ** rounds, 1.0])


def test_robots_that_never_moved_are_not_blamed() -> None:
    """One pose each and no odometry; from some moment on they cannot be so far apart."""
    problem, _ = team_problem(1, robots=2, count=12, closures=1)
    ranges = problem.ranges
    still = replace(
        ranges,
        i=np.zeros(12, dtype=int),
        j=np.ones(12, dtype=int),
        measured=np.where(np.arange(12) < 7, 3.0, 6.0),
    )
    links = problem.odometry
    none = np.zeros(len(links), dtype=bool)
    columns = {name: getattr(links, name)[none] for name in links.__dataclass_fields__}
    problem = replace(
        problem,
        robot_id=problem.robot_id[:2],
        n=problem.n[:2],
        initial=problem.initial[:2],
        odometry=replace(links, **columns),
        closures=replace(problem.closures, i=np.array([0]), j=np.array([1])),
        ranges=still,
    )
    point = nominal(problem)
    assert len(runs(problem, point)) == 1
    assert not explained(problem, point).is_odometry
