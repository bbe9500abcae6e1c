"""Is the model one of what was measured, and what is taken in its place."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from slam_problems import (
    IDS,
    held_at,
    links_of,
    mismeasured,
    mismounted,
    no_ranges,
    slipping,
    stuck,
    team_problem,
)
from slam_scenes import Array

from drslamd.slam.optimizer.banded import common_level, explanation, mountings, odometry_levels
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.common_level import ASKS, TAILS, CommonLevel
from drslamd.slam.optimizer.banded.explanation import MUCH, NOT_WHEELS, Explanation, explain
from drslamd.slam.optimizer.banded.lapses import lapse_search
from drslamd.slam.optimizer.banded.lapses.stretches import freed_links, with_freed
from drslamd.slam.optimizer.banded.misfit import (
    Misfit,
    Run,
    guessed_misfit,
    misfit,
    outlier_share,
    runs,
)
from drslamd.slam.optimizer.banded.mountings import TOGETHER, WORTH, Scores
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE, descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.odometry_levels import STANDS_OUT, TARGET, Levels, raised
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.sight import hidden_search
from drslamd.slam.optimizer.banded.sight.hidden import LONG, blocked
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


def explained(problem: Problem, point: Point | None = None) -> Explanation:
    return explain(Equations(problem), point or nominal(problem), 60, TOLERANCE)


def ratio_of(problem: Problem, point: Point, is_guessed: bool = False) -> Array:
    equations = Equations(problem)
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    of = guessed_misfit if is_guessed else misfit
    return of(equations, point, factor).ratio(problem.odometry.robot, ROBOTS)


def worst(point: Point, truth: Array) -> float:
    return float(np.hypot(*(point.poses - truth)[:, :2].T).max())


@pytest.fixture
def nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wheels say nothing of where they may have stood or spun."""
    monkeypatch.setattr(lapse_search, "likely_stretches", lambda _: [])


@pytest.fixture
def in_sight(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody asks whether sight was blocked."""
    monkeypatch.setattr(explanation, "many_wrong", lambda *_: False)


# as configured


@pytest.mark.parametrize("seed", [1, 2, 7])
def test_where_all_is_as_configured_nothing_changes(seed: int) -> None:
    problem, _ = a_team(seed)
    equations, point = Equations(problem), nominal(problem)
    found = explain(equations, point, 60, TOLERANCE)
    assert found.equations is equations
    assert found.point is point
    assert found.other is None
    assert (found.level == 1).all()
    assert found.feared.min() >= 1
    assert found.feared.max() < 1.7


@pytest.mark.parametrize("is_asked", [False, True])
def test_where_all_fits_stretches_are_asked_for_only_if_wheels_changed_their_speed_at_once(
    is_asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(lapse_search, "is_asked_for", lambda _: is_asked)
    monkeypatch.setattr(lapse_search, "best", lambda *args: asked.append(args))
    problem, _ = a_team(1)
    point = nominal(problem)
    assert explained(problem, point).point is point
    assert len(asked) == int(is_asked)


def test_odometry_that_is_somewhat_worse_is_feared_to_be_as_much_worse_as_it_looks() -> None:
    """The poses are those of the nominal solution; only what is claimed of them grows."""
    problem = held_at(*team_problem(3, robots=ROBOTS, count=COUNT, link_error=1.15))
    point = nominal(problem)
    found = explained(problem, point)
    ratio = ratio_of(problem, point, is_guessed=True)
    assert 1.2 < ratio.max() < 3
    assert found.point is point
    assert (found.level == 1).all()
    assert found.feared == pytest.approx(np.maximum(ratio, 1)[problem.odometry.robot])
    assert np.array_equal(found.lately, found.feared)


def all_are_worse() -> Problem:
    return held_at(*team_problem(3, robots=ROBOTS, count=COUNT, link_error=2.5))


def test_odometry_that_is_worse_for_all_alike_is_believed_less_and_nobody_doubted() -> None:
    problem = all_are_worse()
    point = nominal(problem)
    found = explained(problem, point)
    variance = float(found.level[0]) ** 2
    assert 4 < variance < 9
    assert (found.level == found.level[0]).all()
    assert found.feared == pytest.approx(np.full(len(found.level), 1 + TAILS * (variance - 1)))
    assert (found.lately == 1).all()
    assert found.other is None
    believed = Equations(raised(problem, found.level**2, point))
    again = descend(believed, point.calibration, 60)
    assert found.point.poses == pytest.approx(again.poses, abs=1e-5)


def test_of_one_that_is_worse_alone_so_much_is_feared_of_late_too() -> None:
    problem, _ = a_team(2)
    links = links_of(problem, 2, 0, COUNT)
    noise = np.random.default_rng(5).normal(0, [0.04, 0.04, 0.032], (len(links), 3))
    found = explained(mismeasured(problem, links, problem.odometry.measured[links] + noise))
    robot = problem.odometry.robot
    assert (found.level[robot == 2] > 1.5).all()
    assert (found.level[robot != 2] == 1).all()
    assert np.array_equal(found.lately, found.feared)


@pytest.mark.parametrize(("ratio", "is_taken"), [(TARGET, True), (TARGET + 0.01, False)])
def test_what_leaves_one_robot_standing_out_is_not_common(
    ratio: float, is_taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = all_are_worse()
    really = common_level.common_level

    def one_stands_out(*arguments: Any) -> CommonLevel | None:
        found = really(*arguments)
        return found and replace(found, ratio=np.array([1.0, ratio, 1.0, 1.0]))

    monkeypatch.setattr(common_level, "common_level", one_stands_out)
    level = explained(problem).level
    assert bool((level == level[0]).all() and level[0] > 1) is is_taken


@pytest.mark.parametrize(("share", "is_asked"), [(0.11, True), (0.13, False)])
def test_what_leaves_many_outliers_is_not_looked_for_in_all_odometry(
    share: float, is_asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes long where ranges are nonsense."""
    problem = all_are_worse()
    point = nominal(problem)
    monkeypatch.setattr(
        explanation, "outlier_share", lambda _, at: np.array([share if at is point else 0.0])
    )
    level = explained(problem, point).level
    assert bool((level == level[0]).all() and level[0] > 1) is is_asked


@pytest.mark.parametrize(("asks", "is_asked"), [(0.99, True), (1.01, False)])
def test_it_is_looked_into_where_all_together_are_worse(
    asks: float, is_asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = all_are_worse()
    check = explanation._checked(Equations(problem), nominal(problem))
    monkeypatch.setattr(explanation, "ASKS", asks * check.pooled)
    monkeypatch.setattr(explanation, "STANDS_OUT", 99.0)
    assert bool(explained(problem).level.max() > 1) is is_asked


def test_a_scale_that_is_far_off_is_learned_and_no_fault() -> None:
    problem, truth = a_team(1)
    links = links_of(problem, 2, 0, COUNT)
    problem = mismeasured(problem, links, problem.odometry.measured[links] * [1.4, 1.4, 1])
    found = explained(problem)
    assert (found.level == 1).all()
    # what is measured is 1.4 times the way
    assert found.point.calibration.scale[2] == pytest.approx(1 - 1 / 1.4, abs=0.02)
    assert worst(found.point, truth) < 0.5


@pytest.mark.parametrize(("times", "is_computed"), [(1.001, False), (0.999, True)])
def test_a_guess_that_is_suspicious_is_computed(
    times: float, is_computed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, _ = a_team(3)
    point = nominal(problem)
    guess = ratio_of(problem, point, is_guessed=True).max()
    computed = []

    def watched(*args: object) -> Misfit:
        computed.append(args)
        return misfit(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(explanation, "SUSPICIOUS", times * guess)
    monkeypatch.setattr(explanation, "misfit", watched)
    found = explained(problem, point)
    assert bool(computed) is is_computed
    exact = ratio_of(problem, point, is_guessed=not is_computed)
    assert found.feared == pytest.approx(np.maximum(exact, 1)[problem.odometry.robot])


def test_of_poses_that_nothing_holds_nothing_is_asked() -> None:
    problem, _ = team_problem(3, robots=2, count=6, closures=0)
    problem = replace(problem, ranges=no_ranges(), pairs=0)
    point = nominal(problem)
    found = explained(problem, point)
    assert found.point is point
    assert found.other is None
    assert (found.feared == 1).all()


# odometry that was worse for a while


@pytest.mark.usefixtures("nowhere", "in_sight")
@pytest.mark.parametrize(("times", "is_raised"), [(1.001, False), (0.999, True)])
def test_a_robot_that_stands_out_is_believed_less(
    times: float, is_raised: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stuck for so short that by now its ranges fit."""
    problem = stuck(a_team(3)[0], 1, 25, 29)
    point = nominal(problem)
    assert not runs(problem, point)
    ratio = ratio_of(problem, point)
    for module in (explanation, odometry_levels):
        monkeypatch.setattr(module, "STANDS_OUT", times * ratio.max())
    found = explained(problem, point)
    assert (found.point is not point) is is_raised
    assert bool(found.level.max() > 1) is is_raised
    if not is_raised:
        assert found.feared == pytest.approx(np.maximum(ratio, 1)[problem.odometry.robot])


def beside(seed: int, first: int, metres: float) -> Problem:
    """From some second on the ranges of robots 0 and 1 are too long, or too short."""
    problem, _ = a_team(seed)
    ranges = problem.ranges
    wrong = (ranges.pair == 0) & (ranges.i // ROBOTS >= first)
    return replace(problem, ranges=replace(ranges, measured=ranges.measured + metres * wrong))


@pytest.mark.parametrize(("count", "is_found"), [(3, False), (4, True)])
def test_a_burst_is_not_looked_into_and_a_run_is(count: int, is_found: bool) -> None:
    """What is found is that nobody can say who is wrong: the poses stay, and there are others."""
    problem = beside(1, COUNT - count, metres=-1.0)
    equations, point = Equations(problem), nominal(problem)
    found = explain(equations, point, 60, TOLERANCE)
    assert (found.other is not None) is is_found
    assert found.point is point
    assert found.equations is equations


@pytest.mark.usefixtures("nowhere")
def test_who_slipped_is_believed_less_by_sigmas_as_it_was_seen_and_by_variances_as_is_feared() -> (
    None
):
    problem, truth = a_team(2)
    problem = slipping(problem, 1, *FAULT)
    point = nominal(problem)
    found = explained(problem, point)
    levels = odometry_levels.levelled(
        Equations(problem), point, ratio_of(problem, point), runs(problem, point), 60, TOLERANCE
    )
    assert found.other is None
    assert np.allclose(found.level, np.sqrt(levels.seen))
    assert np.array_equal(found.feared, levels.feared)
    assert worst(point, truth) > 1.5
    assert worst(found.point, truth) < 0.7


# wheels that stood or spun


@pytest.mark.parametrize("fault", [stuck, slipping])
def test_wheels_that_stood_or_spun_explain_it_and_the_rest_is_as_configured(fault: object) -> None:
    problem, truth = a_team(2)
    problem = fault(problem, 1, *FAULT)  # type: ignore[operator]
    point = nominal(problem)
    found = explained(problem, point)
    (freed,) = found.equations.problem.freed
    assert (freed.robot, freed.stands) == (1, fault is stuck)
    assert found.other is None
    assert (found.level == 1).all()
    assert found.feared.max() < 2
    assert np.array_equal(found.lately, found.feared)
    assert worst(point, truth) > 1.5
    assert worst(found.point, truth) < 1


@pytest.mark.parametrize("share", [0.05, 0.07])
def test_a_stretch_that_leaves_many_outliers_is_no_reason(
    share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = slipping(a_team(2)[0], 1, *FAULT)
    monkeypatch.setattr(explanation, "outlier_share", lambda *_: np.array([0.0, share]))
    assert bool(explained(problem).equations.problem.freed) is (share < 0.06)


def test_a_stretch_that_leaves_another_robot_at_fault_is_no_reason() -> None:
    problem = slipping(a_team(2)[0], 1, *FAULT)
    links = links_of(problem, 2, 10, 16)
    turned = problem.odometry.measured[links] + [0.0, 0.0, 0.3]
    found = explained(mismeasured(problem, links, turned))
    assert found.equations.problem.freed == ()
    assert found.level.max() > 5


@pytest.mark.parametrize("share", [0.05, 0.07])
def test_many_outliers_are_looked_into_where_wheels_stood(
    share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though odometry fits: it was bent until it did."""
    problem = stuck(a_team(3)[0], 1, 25, 29)
    point = nominal(problem)
    passed = explanation._Check(np.ones(ROBOTS), [], Scores(np.zeros(ROBOTS), np.zeros(ROBOTS)))
    monkeypatch.setattr(explanation, "_checked", lambda *_: passed)
    monkeypatch.setattr(
        explanation,
        "outlier_share",
        lambda _, at: np.array([share if at is point else 0.0]),
    )
    found = explained(problem, point)
    assert bool(found.equations.problem.freed) is (share > 0.06)
    assert (found.point is point) is (share < 0.06)


# mountings


def long_team() -> tuple[Problem, Array]:
    problem, truth = team_problem(7, robots=3, count=120)
    return held_at(problem, truth), truth


def test_a_track_that_is_far_off_explains_it_for_good() -> None:
    """All along its way odometry is as good as configured, with turns that are a third longer."""
    problem, truth = long_team()
    problem = mismounted(problem, truth, (0.0, 0.35, 0.0))
    point = nominal(problem)
    found = explained(problem, point)
    assert found.equations.problem.doubted.track.tolist() == [False, True, False]
    assert not found.equations.problem.doubted.antenna.any()
    assert found.other is None
    assert (found.level == 1).all()
    assert found.feared.max() < 2
    assert found.point.calibration.turn[1] == pytest.approx(0.35, abs=0.05)
    assert worst(found.point, truth) < 0.5 * worst(point, truth)


def test_an_antenna_that_is_far_off_explains_it_for_good() -> None:
    problem, truth = long_team()
    problem = mismounted(problem, truth, antenna=((0.0, 0.0), (0.0, 0.0), (-0.3, 0.2)))
    found = explained(problem)
    assert found.equations.problem.doubted.antenna.tolist() == [False, False, True]
    assert found.other is None
    assert (found.level == 1).all()
    assert found.point.calibration.antenna[2] == pytest.approx([-0.3, 0.2], abs=0.05)


def test_what_was_let_go_before_is_no_longer_asked_for() -> None:
    problem, truth = long_team()
    problem = mismounted(problem, truth, (0.0, 0.35, 0.0))
    first = explained(problem)
    again = replace(first.equations.problem, initial=first.point.poses)
    equations = Equations(again)
    point = descend(equations, first.point.calibration, 60)
    assert explain(equations, point, 60, TOLERANCE).equations is equations


RUN = Run(0, 1, 0, 0, 10)


class Asked:
    """What is asked of solutions, and what is answered: a model of a model that fails."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, gain: float) -> None:
        self.problem, _ = team_problem(1, robots=2, count=12)
        self.equations = Equations(self.problem)
        self.nominal = nominal(self.problem)
        self.mounted = Equations(replace(self.problem))
        self.better = replace(self.nominal, poses=self.nominal.poses + 0.0)
        self.levelled: list[Equations] = []
        self.explaining: list[Equations] = []
        self.is_passed_later = False
        monkeypatch.setattr(explanation, "_checked", self.check)
        monkeypatch.setattr(explanation, "_gain", lambda *_: gain)
        monkeypatch.setattr(mountings, "fitted", self.fitted)
        monkeypatch.setattr(odometry_levels, "levelled", self.level)

    def check(self, equations: Equations, point: Point) -> explanation._Check:
        none = np.zeros(2)
        is_first = equations is self.equations
        ratio = np.array([1.0, 9.0 if is_first else 1.0 if self.is_passed_later else 8.0])
        asked = Scores(np.array([99.0, 0.0]) if is_first else none, none)
        return explanation._Check(ratio, [RUN] if is_first else [], asked)

    def fitted(self, *_: object) -> tuple[Equations, Point]:
        return self.mounted, self.better

    def level(
        self, equations: Equations, point: Point, ratio: Array, found: list[Run], *limits: float
    ) -> Levels:
        # what stands out is what did so in the solution that is gone on from
        assert ratio[1] == (9 if equations is self.equations else 8)
        assert len(found) == (1 if equations is self.equations else 0)
        assert limits == (60, TOLERANCE)
        self.levelled.append(equations)
        many = np.ones(len(self.problem.odometry))
        return Levels(point, 4 * many, 9 * many, 6 * many, equations in self.explaining)

    def explained(self) -> Explanation:
        return explain(self.equations, self.nominal, 60, TOLERANCE)


def test_mountings_with_which_all_fits_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Asked(monkeypatch, gain=0.0)
    scene.is_passed_later = True
    found = scene.explained()
    assert (found.equations, found.point) == (scene.mounted, scene.better)
    assert scene.levelled == []


@pytest.mark.parametrize(("gain", "is_mounting"), [(49.0, False), (51.0, True)])
def test_mountings_must_explain_more_than_odometry_that_was_worse(
    gain: float, is_mounting: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Asked(monkeypatch, gain)
    scene.is_passed_later = True
    variance = np.full(len(scene.problem.odometry), 5.0)
    common = CommonLevel(variance, scene.nominal, 50.0, np.ones(2), is_alone=False)
    monkeypatch.setattr(
        explanation, "_in_common", lambda at, *_: common if at is scene.equations else None
    )
    found = scene.explained()
    assert found.equations is (scene.mounted if is_mounting else scene.equations)
    assert found.level[0] == pytest.approx(1.0 if is_mounting else math.sqrt(5))
    assert scene.levelled == []


def test_under_mountings_odometry_may_be_worse_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Asked(monkeypatch, gain=60.0)
    variance = np.full(len(scene.problem.odometry), 5.0)
    common = CommonLevel(variance, scene.better, 50.0, np.ones(2), is_alone=False)
    monkeypatch.setattr(explanation, "_in_common", lambda *_: common)
    found = scene.explained()
    assert (found.equations, found.point) == (scene.mounted, scene.better)
    assert found.level[0] == pytest.approx(math.sqrt(5))


def test_where_odometry_was_worse_all_along_no_lapse_is_looked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It would be found: slip looks like wheels that spin, and a stop like wheels that stand."""
    monkeypatch.setattr(explanation, "_by_lapse", lambda *_: 1 / 0)
    assert (explained(all_are_worse()).level > 1).all()


@pytest.mark.parametrize("share", [0.05, 0.07])
def test_mountings_that_leave_many_outliers_are_not_enough(
    share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Asked(monkeypatch, gain=0.0)
    scene.is_passed_later = True
    monkeypatch.setattr(explanation, "outlier_share", lambda *_: np.array([0.0, share]))
    assert (scene.explained().equations is scene.mounted) is (share < 0.06)


@pytest.mark.parametrize(("gain", "is_taken"), [(2 * WORTH - 1, False), (2 * WORTH + 1, True)])
def test_antennas_that_only_ask_together_must_be_worth_it(
    gain: float, is_taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else all stays as it was, for odometry and ranges fit."""
    scene = Asked(monkeypatch, gain)
    none = np.zeros(2)
    together = explanation._Check(np.ones(2), [], Scores(none, none, 2 * TOGETHER + 1))
    monkeypatch.setattr(explanation, "_checked", lambda *_: together)
    found = scene.explained()
    assert found.equations is (scene.mounted if is_taken else scene.equations)
    assert scene.levelled == []


@pytest.mark.parametrize(("pooled", "is_taken"), [(ASKS, True), (1.01 * ASKS, False)])
def test_antennas_that_only_ask_together_must_explain_all_odometry(
    pooled: float, is_taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who slips has antennas that seem to be off a little."""
    scene = Asked(monkeypatch, gain=4 * WORTH)
    none = np.zeros(2)
    together = Scores(none, none, 2 * TOGETHER + 1)

    def checked(equations: Equations, point: Point) -> explanation._Check:
        is_mounted = equations is scene.mounted
        return explanation._Check(np.ones(2), [], together, pooled if is_mounted else 1.0)

    monkeypatch.setattr(explanation, "_checked", checked)
    monkeypatch.setattr(explanation, "_in_common", lambda *_: None)
    assert (scene.explained().equations is scene.mounted) is is_taken


def test_mountings_whose_solution_was_not_reached_are_not_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = Asked(monkeypatch, gain=2 * MUCH)
    scene.is_passed_later = True
    scene.better = replace(scene.better, converged=False)
    assert scene.explained().equations is scene.equations
    assert scene.levelled == [scene.equations]


@pytest.mark.parametrize(("gain", "is_kept"), [(0.99 * MUCH, False), (1.01 * MUCH, True)])
def test_mountings_that_take_a_lot_off_the_cost_are_kept_under_odometry_that_was_worse(
    gain: float, is_kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Asked(monkeypatch, gain)
    scene.explaining = [scene.mounted, scene.equations]
    found = scene.explained()
    assert found.equations is (scene.mounted if is_kept else scene.equations)
    assert found.point is (scene.better if is_kept else scene.nominal)
    assert found.other is None
    assert (found.level == 2).all()
    assert (found.feared == 9).all()
    assert (found.lately == 6).all()
    assert len(scene.levelled) == 1


def test_where_odometry_explains_nothing_beside_mountings_it_is_asked_without_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = Asked(monkeypatch, 2 * MUCH)
    scene.explaining = [scene.equations]
    found = scene.explained()
    assert scene.levelled == [scene.mounted, scene.equations]
    assert found.equations is scene.equations
    assert found.other is None


def test_where_nothing_explains_it_the_nominal_solution_stays_beside_another(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = Asked(monkeypatch, 2 * MUCH)
    found = scene.explained()
    assert (found.equations, found.point) == (scene.equations, scene.nominal)
    assert found.other is not None
    assert (found.feared == 9).all()
    assert (found.lately == 6).all()


def test_a_gain_is_what_the_cost_fell_by_where_ranges_lose_weight_as_before() -> None:
    problem, truth = long_team()
    problem = mismounted(problem, truth, (0.0, 0.35, 0.0))
    equations, point = Equations(problem), nominal(problem)
    better = explained(problem, point)
    found = explanation._gain(equations, point, better.equations, better.point)
    held = replace(better.point, threshold=point.threshold)
    costs = [e.cost(p, point.threshold) for e, p in ((equations, point), (better.equations, held))]
    assert found == pytest.approx(costs[0] - costs[1])
    assert found > MUCH
    assert not math.isclose(
        found, costs[0] - better.equations.cost(better.point, better.point.threshold), rel_tol=1e-3
    )


def test_outliers_count_by_the_pair_that_has_most_of_them() -> None:
    problem = beside(1, COUNT - 3, metres=1.0)
    assert outlier_share(problem, nominal(problem)).argmax() == 0


# sight that is blocked


WALLS = {0: (5, 35), 1: (20, 45), 4: (10, 40), 5: (0, 20)}
"""Pairs between which sight is blocked, from which second until when."""


def around_walls(seed: int) -> tuple[Problem, Array]:
    """Ranges are a metre too long there."""
    problem, truth = a_team(seed)
    ranges, second = problem.ranges, problem.ranges.i // ROBOTS
    longer = ranges.measured.copy()
    for pair, (since, until) in WALLS.items():
        longer += (ranges.pair == pair) & (second >= since) & (second < until)
    return replace(problem, ranges=replace(ranges, measured=longer)), truth


@pytest.mark.parametrize("seed", [2, 7])
def test_where_sight_was_blocked_that_explains_it_and_wheels_are_as_configured(seed: int) -> None:
    problem, truth = around_walls(seed)
    point = nominal(problem)
    found = explained(problem, point)
    assert found.equations.problem.blocked is not None
    assert found.other is None
    assert (found.level == 1).all()
    assert found.lately.max() < STANDS_OUT
    assert worst(found.point, truth) < worst(point, truth) / 3
    pairs = blocked(found.equations.problem, found.point)
    assert np.flatnonzero(pairs).tolist() == list(WALLS)


@pytest.mark.parametrize(("ranges", "is_found"), [(LONG - 1, False), (LONG, True)])
def test_a_wall_that_came_between_two_is_known_once_others_have_seen_both_for_long(
    ranges: int, is_found: bool
) -> None:
    """Wheels that stood or spun would explain it as well until then."""
    found = explained(beside(3, COUNT - ranges, metres=1.0))
    hidden = found.equations.problem.blocked
    assert (hidden is not None) is is_found
    if hidden is not None:
        assert np.flatnonzero(hidden).tolist() == [0]
        assert not found.equations.problem.freed


def test_what_was_freed_for_a_wall_is_told_again_once_the_wall_is_known() -> None:
    problem, truth = beside(3, 25, metres=1.0), a_team(3)[1]
    links = np.flatnonzero((problem.odometry.robot == 0) & (problem.odometry.i // ROBOTS == 25))
    freed = with_freed(problem, freed_links(problem, 0, links, False))
    point = nominal(freed)
    found = explained(freed, point)
    assert not found.equations.problem.freed
    assert np.array_equal(found.equations.problem.odometry.covariance, problem.odometry.covariance)
    clean = nominal(a_team(3)[0])
    assert worst(found.point, truth) < 1.2 * worst(clean, truth) < worst(point, truth)


def test_a_wall_is_not_asked_for_each_second_of_the_hours_after_a_lapse(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, _ = a_team(3)
    links = np.flatnonzero((problem.odometry.robot == 0) & (problem.odometry.i // ROBOTS == 5))
    freed = with_freed(problem, freed_links(problem, 0, links, False))
    point, asked = nominal(freed), list[str]()

    def looked_for(*_: object) -> list[tuple[Equations, Point]]:
        asked.append("a wall")
        return []

    monkeypatch.setattr(hidden_search, "solutions", looked_for)
    explained(freed, point)
    assert asked
    asked.clear()
    monkeypatch.setattr(explanation, "freed_lately", lambda _: False)
    explained(freed, point)
    assert not asked


def test_sight_that_is_free_again_leaves_freed_what_was_freed() -> None:
    """Of two robots nobody sees both: wheels that spun are not told again for a wall."""
    problem, truth = around_walls(7)
    links = np.flatnonzero((problem.odometry.robot == 0) & (problem.odometry.i // ROBOTS == 25))
    freed = with_freed(problem, freed_links(problem, 0, links, False))
    found = explained(freed)
    assert found.equations.problem.blocked is not None
    assert len(found.equations.problem.freed) == 1
    assert worst(found.point, truth) < worst(nominal(freed), truth)


def test_one_pair_whose_ranges_are_too_short_is_out_of_no_sight() -> None:
    found = explained(beside(1, 30, metres=-2.0))
    assert found.equations.problem.blocked is None
    assert found.other is not None


@pytest.mark.parametrize(("ranges", "is_asked"), [(NOT_WHEELS - 1, False), (NOT_WHEELS, True)])
def test_what_began_just_now_may_be_wheels_until_they_had_time_to_show_it(
    ranges: int, is_asked: bool
) -> None:
    problem, _ = around_walls(7)
    newest = np.array([problem.n[problem.robot_id == robot].max() for robot in IDS[:ROBOTS]])
    problem = replace(problem, fitted=newest - 10 * ranges)
    found = explained(problem, nominal(problem))
    assert (found.equations.problem.blocked is not None) is is_asked


def test_who_stood_all_the_time_does_not_hide_that_the_others_have_driven() -> None:
    problem, _ = around_walls(7)
    newest = np.array([problem.n[problem.robot_id == robot].max() for robot in IDS[:ROBOTS]])
    parked = np.array([True, False, False, False])
    problem = replace(problem, fitted=newest - np.where(parked, 0, 10 * NOT_WHEELS))
    assert explained(problem, nominal(problem)).equations.problem.blocked is not None


@pytest.mark.parametrize(
    ("name", "verdict"),
    [("many_wrong", False), ("_fits", False), ("has_passed", False), ("_checked", None)],
)
def test_sight_must_leave_hardly_a_range_too_short_and_nobody_at_fault(
    name: str, verdict: bool | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, _ = around_walls(7)
    point, was = nominal(problem), getattr(explanation, name)

    def said(first: Any, *rest: Any) -> Any:
        problem = getattr(first, "problem", first)
        if name != "many_wrong" and problem.blocked is None:
            return was(first, *rest)
        if verdict is None:
            return replace(was(first, *rest), ratio=np.full(ROBOTS, STANDS_OUT + 1e-6))
        return verdict

    monkeypatch.setattr(explanation, name, said)
    assert explained(problem, point).equations.problem.blocked is None
