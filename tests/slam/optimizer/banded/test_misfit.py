"""What does not fit at a solution, against dense formulas; outliers, and runs of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from dense_problems import link_misfit, packed
from slam_problems import CLOCKS, errs, no_ranges, pose_edges, team_problem

from drslamd.slam.optimizer.banded import misfit as misfit_module
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.misfit import (
    OF_RUN,
    RUN,
    Misfit,
    Run,
    contradicted,
    guessed_misfit,
    many_wrong,
    misfit,
    outlier_share,
    outliers,
    runs,
    squares_of_ranges,
)
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration


def solved(problem: Problem) -> tuple[Equations, Point]:
    equations = Equations(problem)
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return equations, descend(equations, start, 60)


def weighed(equations: Equations, point: Point) -> BandFactor:
    factor = BandFactor.of(equations.weighed(point))
    assert factor is not None
    return factor


def far_edges() -> Problem:
    problem, _ = team_problem(6, robots=2, count=14, closures=0)
    rng = np.random.default_rng(7)
    far = [(3, k) for k in range(20, 28, 2)]
    return replace(problem, closures=pose_edges(rng, problem.initial, far, (0.05, 0.05, 0.03)))


# squares, and what could be checked


def mounted() -> Problem:
    """A track and an antenna are unknowns."""
    problem, _ = team_problem(1, robots=3, count=7, is_thinned=True)
    return replace(problem, doubted=Doubted(np.arange(3) == 1, np.arange(3) == 2))


@pytest.mark.parametrize("kind", ["band", "border", "mountings"])
def test_misfit_is_that_of_the_dense_matrices(kind: str) -> None:
    problem = team_problem(1, robots=3, count=7, is_thinned=True)[0]
    problem = {"band": problem, "border": far_edges(), "mountings": mounted()}[kind]
    equations, point = solved(problem)
    found = misfit(equations, point, weighed(equations, point))
    x = packed(point.poses, point.calibration, problem.doubted)
    squares, checked = link_misfit(problem, x, point.threshold)
    assert found.squares == pytest.approx(squares, rel=1e-4, abs=1e-6)
    assert found.checked == pytest.approx(checked, abs=1e-4)
    assert checked.sum() > 1


def test_a_guess_of_what_a_robot_could_check_is_near_and_always_the_same() -> None:
    problem, _ = team_problem(2, robots=3, count=60)
    equations, point = solved(problem)
    robot = problem.odometry.robot
    factor = weighed(equations, point)
    exact, guess = (of(equations, point, factor) for of in (misfit, guessed_misfit))
    assert np.array_equal(guess.squares, exact.squares)
    for number in range(3):
        sums = [float(m.checked[robot == number].sum()) for m in (exact, guess)]
        assert sums[1] == pytest.approx(sums[0], abs=0.15 * sums[0] + 1)
    assert guess.ratio(robot, 3) == pytest.approx(exact.ratio(robot, 3), rel=0.2)
    assert np.array_equal(guessed_misfit(equations, point, factor).checked, guess.checked)


@pytest.mark.parametrize("doubted", [Doubted.none(3), Doubted(np.arange(3) == 1, np.arange(3) < 2)])
def test_with_many_signs_a_guess_is_what_is_computed(
    doubted: Doubted, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The gauge is none of the first unknowns, which everybody can name by mistake."""
    problem, _ = team_problem(2, robots=3, count=20)
    equations, point = solved(replace(problem, gauge=25, doubted=doubted))
    factor, robot = weighed(equations, point), problem.odometry.robot
    monkeypatch.setattr(misfit_module, "PROBES", 4000)
    sums = [
        np.bincount(robot, of(equations, point, factor).checked) for of in (misfit, guessed_misfit)
    ]
    assert sums[1] == pytest.approx(sums[0], rel=0.05)


@pytest.mark.parametrize("is_guessed", [False, True])
def test_where_nothing_holds_the_poses_nothing_was_checked(is_guessed: bool) -> None:
    equations, point = solved(team_problem(3, robots=2, count=6)[0])
    factor = weighed(equations, point)
    singular = replace(factor, schur=np.zeros_like(factor.schur))
    found = (guessed_misfit if is_guessed else misfit)(equations, point, singular)
    assert found.checked.tolist() == [0.0] * 10
    assert np.array_equal(found.squares, misfit(equations, point, factor).squares)


def test_of_what_cannot_be_solved_no_robot_stands_out() -> None:
    assert Misfit.unknown(3).ratio(np.array([0, 1, 1]), 2).tolist() == [1.0, 1.0]


def test_ratios_are_held_at_one_by_one_degree_of_freedom() -> None:
    """A negative sum of degrees, which a guess may be, counts as none."""
    found = Misfit(np.array([4.0, 5.0, 2.0, 0.5]), np.array([1.0, 1.0, -3.0, 0.25]))
    ratio = found.ratio(np.array([0, 0, 2, 3]), 4)
    assert ratio == pytest.approx([10 / 3, 1.0, 3.0, 1.2])


# outliers


@pytest.mark.parametrize("times", [0.99, 1.01, -0.99, -1.01])
def test_a_range_is_an_outlier_beyond_two_and_a_half_sigmas(times: float) -> None:
    problem, point = errs(np.array([0.0, times * 2.5, 0.0]))
    assert outliers(problem, point).tolist() == [False, abs(times) > 1, False]


def test_squares_of_ranges_are_those_of_each_pair_as_far_as_they_are_believed() -> None:
    problem, point = errs(np.array([1.0, -2.0, 0.0, 8.0]), np.array([0, 0, 1, 1]))
    far = point.threshold
    right = [1 / (1 + far[0] ** -2) + 4 / (1 + 4 * far[0] ** -2), 64 / (1 + 64 * far[1] ** -2), 0.0]
    assert squares_of_ranges(problem, point) == pytest.approx(right)
    wider = replace(problem, width=np.array([1.0, 2.0, 1.0]))
    assert squares_of_ranges(wider, point) == pytest.approx(np.array(right) / [1, 4, 1])


def test_shares_of_outliers_are_those_of_each_pair() -> None:
    pair = np.array([0, 0, 1, 1, 0, 0])
    problem, point = errs(np.array([9.0, 0, 9, 9, 0, 0]), pair)
    assert outlier_share(problem, point).tolist() == [0.25, 1.0, 0.0]


@pytest.mark.parametrize(
    ("pairs", "several", "count", "share"),
    [
        (28, 1, 16, 1 / 16),  # 28 pairs with one of 16 where 1/1000 is wrong: 0.448 of them
        (33, 1, 16, 0.0),
        (1000, 1, 2, 0.0),
        (1000, 2, 20, 0.1),  # 1000 * 0.02^2 / 2 = 0.2
        (1000, 2, 33, 0.0),  # 1000 * 0.033^2 / 2 = 0.54
        (1000, 3, 33, 3 / 33),  # 1000 * 0.033^3 / 6 = 0.006
        (1000, 400, 1000, 0.4),
    ],
)
def test_among_many_pairs_some_have_outliers_by_chance(
    pairs: int, several: int, count: int, share: float
) -> None:
    problem, point = errs(np.array([9.0] * several + [0.0] * (count - several)))
    found = outlier_share(replace(problem, pairs=pairs), point)
    assert found[0] == pytest.approx(share)
    assert not found[1:].any()


@pytest.mark.parametrize(
    ("wrong", "good", "expected"),
    [(3, 10, False), (4, 10, True), (4, 62, True), (4, 63, False), (0, 5, False)],
)
def test_many_ranges_are_wrong_where_more_of_a_pair_are_than_bursts_are(
    wrong: int, good: int, expected: bool
) -> None:
    """Four one after the other, and six of a hundred: 4 of 66 and not 4 of 67."""
    assert many_wrong(*errs(np.array([9.0] * wrong + [0.0] * good))) is expected


def test_bursts_are_many_ranges_and_not_for_long() -> None:
    assert not many_wrong(*errs(np.array([9.0, 9, 9, 0] * 8)))
    # nor is what lies at the end of one pair and at the beginning of the next
    pair = np.repeat([0, 1], 6)
    sigmas = np.array([0.0, 0, 0, 0, 9, 9, 9, 9, 0, 0, 0, 0])
    assert not many_wrong(*errs(sigmas, pair))
    assert many_wrong(*errs(sigmas, np.zeros(12, dtype=int)))


# runs


def run_of(wrong: str) -> list[Run]:
    """Of the ranges of robots 0 and 1, `x` for an outlier."""
    return runs(*errs(np.array([9.0 if c == "x" else 0.0 for c in wrong])))


@pytest.mark.parametrize(
    ("wrong", "count"),
    [
        ("......xxx", 0),
        (".....xxxx", 4),
        ("xxxx.....", 0),
        (".xxxxxxx.", 0),
        ("xxxxx.xxx", 0),
        # four of five and eight of ten are enough; four of the six before them are not
        ("....x.xxxx", 6),
        ("....x..xxxx", 4),
        ("..x.xxx.xxxx", 10),
        ("..x..xx.xxxx", 7),
        ("xx", 0),
    ],
)
def test_a_run_lasts_until_now_and_goes_back_as_far_as_most_are_outliers(
    wrong: str, count: int
) -> None:
    found = run_of(wrong)
    if not count:
        assert not found
        return
    (run,) = found
    first = len(wrong) - count
    assert run == Run(0, 1, CLOCKS[0] + 10 * first, CLOCKS[1] + 10 * first, count)
    assert count >= RUN
    assert wrong[first:].count("x") / count >= OF_RUN


def test_each_pair_has_its_run_and_names_its_robots_as_the_problem_numbers_them() -> None:
    """Whose ids are others; each says when by its own clock, whichever end of a range it is."""
    pair = np.array([1, 2] * 6)
    problem, point = errs(np.full(12, 9.0), pair)
    r = problem.ranges
    turned = replace(r, i=r.j, j=r.i, q_i=r.q_j, q_j=r.q_i)
    problem = replace(problem, ranges=turned)
    found = runs(problem, point)
    assert found == [
        Run(0, 2, CLOCKS[0], CLOCKS[2], 6),
        Run(1, 2, CLOCKS[1] + 10, CLOCKS[2] + 10, 6),
    ]


def test_ranges_are_looked_at_in_the_order_of_time() -> None:
    problem, point = errs(np.array([0.0, 0, 0, 0, 9, 9, 9, 9]))
    order = np.random.default_rng(5).permutation(8)
    r = problem.ranges
    names = [name for name in r.__dataclass_fields__ if name != "carried"]
    columns = {name: getattr(r, name)[order] for name in names}
    other = replace(problem, ranges=replace(r, **columns))
    assert runs(other, Point.of(other, point.poses, point.calibration)) == runs(problem, point)
    assert len(runs(problem, point)) == 1


def test_without_ranges_there_is_no_run() -> None:
    problem, point = errs(np.zeros(3))
    problem = replace(problem, ranges=no_ranges())
    point = Point.of(problem, point.poses, point.calibration)
    assert runs(problem, point) == []
    assert outlier_share(problem, point).tolist() == [0, 0, 0]


# ranges that scatter without a run

BAD = 9.0


def scattered(*sigmas: float) -> int:
    """Ranges of the run that is found among these, oldest first; 0 if none is."""
    found = runs(*errs(np.array(sigmas)))
    assert len(found) < 2
    return found[0].count if found else 0


@pytest.mark.parametrize(("sign", "last"), [(1.0, 0.0), (-1.0, 0.0), (-1.0, BAD)])
def test_outliers_of_both_signs_are_a_misfit_without_a_run(sign: float, last: float) -> None:
    """Four or five of the last ten, back to the oldest of them."""
    sigmas = [0.0, 0.0, BAD, 0.0, sign * BAD, 0.0, BAD, 0.0, sign * BAD, last]
    assert scattered(*sigmas) == 8


@pytest.mark.parametrize(("rest", "count"), [(0.0, 0), (1.06, 0), (1.08, 4)])
def test_a_burst_of_three_is_a_misfit_only_if_the_others_scatter_too(
    rest: float, count: int
) -> None:
    """However long its ranges are, they count as three sigmas: (3 * 9 + 7 * 1.069^2) / 10 = 3.5."""
    for burst in (3.01, 300.0):
        others = [rest, -rest] * 3
        assert scattered(*others, burst, burst, burst, rest) == count


@pytest.mark.parametrize(("sigmas", "count"), [(2.64, 0), (2.65, 9), (-2.64, 0), (-2.65, 9)])
def test_what_is_less_than_three_sigmas_counts_as_it_is(sigmas: float, count: int) -> None:
    """Five of ten: 2.646^2 / 2 = 3.5."""
    assert scattered(*[0.0, sigmas] * 5) == count


@pytest.mark.parametrize(("sigmas", "count"), [(1.86, 0), (1.88, 10), (2.49, 10)])
def test_where_no_range_is_an_outlier_and_all_are_off_it_goes_back_to_the_last_ten(
    sigmas: float, count: int
) -> None:
    """1.871^2 = 3.5."""
    assert scattered(*[0.0] * 3, *[sigmas, -sigmas] * 5) == count


def test_nine_ranges_are_too_few_and_older_ones_than_ten_count_for_nothing() -> None:
    nine = [BAD, 0.0, BAD, 0.0, BAD, 0.0, BAD, BAD, 0.0]
    assert scattered(*nine) == 0
    assert scattered(0.0, *nine) == 9
    assert scattered(*[BAD, 0.0] * 10) == 10
    assert scattered(*[0.0, BAD] * 10) == 9
    assert scattered(*[BAD, 0.0] * 10, 0.0, 0.0, 0.0, 0.0) == 0


def test_ranges_of_which_nothing_is_known_are_no_misfit() -> None:
    assert scattered(*[math.nan] * 12) == 0


def test_a_run_that_goes_back_further_says_so() -> None:
    assert scattered(*[0.0] * 4, *[BAD] * 12) == 12


@pytest.mark.parametrize("pair", [0, 2])
def test_a_pair_that_scatters_is_contradicted_and_the_others_are_not(pair: int) -> None:
    """Three of ten are too few to be many; with the others they scatter."""
    other = 2 - pair
    numbers = np.array([pair, other] * 10)
    sigmas = np.zeros(20)
    for rest, is_wrong in ((1.06, False), (1.08, True)):
        sigmas[::2] = [BAD, rest, rest, rest, -BAD, rest, rest, BAD, rest, rest]
        found = contradicted(*errs(sigmas, numbers))
        assert found.tolist() == [is_wrong and k == pair for k in range(3)]


@pytest.mark.parametrize(
    ("count", "wrong", "expected"), [(8, 4, True), (8, 3, False), (7, 3, False)]
)
def test_many_outliers_of_late_contradict_a_pair(count: int, wrong: int, expected: bool) -> None:
    """Four of ten ranges, and of no fewer than eight; none of these is a run."""
    sigmas = np.zeros(count)
    sigmas[:wrong] = BAD
    found = contradicted(*errs(sigmas))
    assert found.tolist() == [expected, False, False]
