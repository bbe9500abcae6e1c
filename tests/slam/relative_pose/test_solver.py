"""Module 1 where the answer is known: exact windows, and windows that say too little."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares, minimize_scalar
from slam_scenes import (
    EXACT,
    NOISE,
    Array,
    curved_window,
    matrix,
    same_pose,
    straight,
    wander,
    window_of,
)
from window_scenes import fit_of, seeds_of

from drslamd.slam import se2
from drslamd.slam.range_model import LINKTRACK, RangeModel, RangeNoise
from drslamd.slam.relative_pose import algorithm_1, solver
from drslamd.slam.relative_pose.algorithm_1 import linear, window_residuals
from drslamd.slam.relative_pose.descent import ITERATIONS, Descent
from drslamd.slam.relative_pose.estimate import PairNoise, RelativePoseEstimate, Verdict
from drslamd.slam.relative_pose.solver import solve, solve_all
from drslamd.slam.relative_pose.window import Window

SENSORS = PairNoise(RangeNoise(0.10, 0.30), NOISE, NOISE)
DELTA = 0.1


def curved(seed: int, apart: float = 9.0, **antennas: tuple[float, float]) -> tuple[Window, Array]:
    one, other = antennas.get("a", (0.0, 0.0)), antennas.get("b", (0.0, 0.0))
    rng = np.random.default_rng(seed)
    return curved_window(rng, apart, a_antenna=one, b_antenna=other)


def with_ranges(window: Window, ranges: Array) -> Window:
    return replace(window, ranges=ranges)


def solved(window: Window) -> RelativePoseEstimate:
    return solve(window, SENSORS, DELTA)


def nees(estimate: RelativePoseEstimate, true: Array) -> float:
    best = estimate.hypotheses[0]
    error = best.a_T_b - true
    error[2] = math.remainder(error[2], 2 * math.pi)
    return float(error @ np.linalg.solve(best.covariance, error))


# robots that only turn


def spinning(count: int, turns: float, x: float) -> Array:
    """(count, 3) who turns in place."""
    return np.column_stack([np.full(count, x), np.zeros(count), np.linspace(0, turns, count)])


def test_two_that_only_turn_say_nothing_of_each_other_wherever_their_antennas_are() -> None:
    """Ranges are exact here; on robots they also move with bearing, as much as with the turns."""
    a, b = spinning(60, 9.0, 0.0), spinning(60, -5.0, 6.0)
    window, _ = window_of(a, b, a_antenna=(0.31, 0.0), b_antenna=(0.31, 0.0))
    assert np.ptp(window.ranges) > 0.5
    assert solved(window).verdict is Verdict.UNOBSERVABLE


@pytest.mark.parametrize(("times", "is_enough"), [(0.99, True), (1.01, False)])
def test_who_came_half_a_metre_far_does_not_only_turn(
    times: float, is_enough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert solver.SPOT_M == 0.5
    window, _ = curved(1)
    far = max(float(np.hypot(*p[:, :2].T).max()) for p in (window.a_poses, window.b_poses))
    monkeypatch.setattr(solver, "SPOT_M", times * far)
    assert (solved(window).verdict is Verdict.UNIQUE) is is_enough
    if not is_enough:
        assert (
            solve_all([window, window], [SENSORS, SENSORS], DELTA)
            == [RelativePoseEstimate(Verdict.UNOBSERVABLE)] * 2
        )


# what curved motion fixes


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 5, 6, 7, 8, 10])
def test_an_exact_window_gives_the_exact_pose(seed: int) -> None:
    window, true = curved(seed)
    estimate = solved(window)
    assert estimate.verdict is Verdict.UNIQUE
    assert same_pose(estimate.hypotheses[0].a_T_b, true, 1e-6)
    assert estimate.hypotheses[0].chi2 < 1e-6
    assert -math.pi < estimate.hypotheses[0].a_T_b[2] <= math.pi


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_antennas_off_the_middle_are_taken_into_account(seed: int) -> None:
    window, true = curved(seed, a=(0.3, -0.2), b=(-0.25, 0.15))
    assert same_pose(solved(window).hypotheses[0].a_T_b, true, 1e-6)
    forgotten = replace(window, a_antenna=np.zeros(2), b_antenna=np.zeros(2))
    wrong = solved(forgotten).hypotheses
    assert not wrong or not same_pose(wrong[0].a_T_b, true, 0.05)


@pytest.mark.parametrize("bias", [0.5, -0.5])
@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 5])
def test_a_constant_bias_does_no_more_than_the_covariance_says(seed: int, bias: float) -> None:
    """A bias of 0.5 m where 0.3 m was expected is an error of at most (0.5 / 0.3)^2."""
    window, true = curved(seed)
    assert nees(solved(with_ranges(window, window.ranges + bias)), true) < (0.5 / 0.3) ** 2 + 0.05


def test_a_bias_costs_nothing_where_the_other_robot_is_circled() -> None:
    """Ranges from all sides, and odometry that lets old ones count as much as new ones."""
    turn = np.linspace(0, 2 * math.pi, 60)
    a = np.stack([5 * np.sin(turn), -5 * np.cos(turn), turn], axis=-1)
    b = wander(np.random.default_rng(3), 60, 0.03)
    b[:, :2] -= b[:, :2].mean(axis=0)
    for bias in (0.5, -0.5):
        window, true = window_of(a, b, bias)
        best = solve(window, PairNoise(SENSORS.ranges, EXACT, EXACT), DELTA).hypotheses[0]
        assert np.hypot(*(best.a_T_b - true)[:2]) < 0.03


@pytest.mark.parametrize("seed", [0, 3, 5, 6, 7])
def test_bursts_on_a_fifth_of_the_ranges_are_tolerated(seed: int) -> None:
    window, true = curved(seed)
    rng = np.random.default_rng(100 + seed)
    ranges = window.ranges + rng.normal(0, 0.03, 60)
    plain = solved(with_ranges(window, ranges))
    ranges[rng.choice(60, 12, replace=False)] += 1.0
    estimate = solved(with_ranges(window, ranges))
    assert nees(estimate, true) < 7.8
    moved = (estimate.hypotheses[0].a_T_b - plain.hypotheses[0].a_T_b)[:2]
    assert np.hypot(*moved) < 0.25


# what it does not fix


def mirrored(pose: Array) -> Array:
    """Seen in the line along which a drives."""
    return pose * [1, -1, -1]


@pytest.mark.row("M6")
def test_straight_paths_leave_the_mirror_image() -> None:
    window, true = window_of(straight((0, 0, 0), 60, 0.25), straight((3, 4, 2.0), 60, 0.2))
    estimate = solved(window)
    assert estimate.verdict is Verdict.AMBIGUOUS
    for wanted in (true, mirrored(true)):
        assert any(same_pose(h.a_T_b, wanted, 1e-3) for h in estimate.hypotheses)
    poses = [h.a_T_b for h in estimate.hypotheses]
    assert len(poses) <= solver.HYPOTHESES
    assert [h.chi2 for h in estimate.hypotheses] == sorted(h.chi2 for h in estimate.hypotheses)
    for k, pose in enumerate(poses):
        assert not any(same_pose(pose, other, 0.1) for other in poses[:k])


def passing(seed: int) -> tuple[Window, Array]:
    """Two robots of which one passes the other at 0.7 m, under noise that does not average out."""
    rng = np.random.default_rng(seed)
    a, b = wander(rng, 60, 0.15), wander(rng, 60, 0.15)
    side = a[20, 2] + math.pi / 2 * rng.choice([-1, 1])
    b[:, :2] += a[20, :2] - b[20, :2] + 0.7 * np.array([math.cos(side), math.sin(side)])
    window, true = window_of(a, b)
    slow = np.convolve(rng.normal(0, 0.2, 80), np.full(10, 0.1), "valid")[:60]
    return with_ranges(window, window.ranges + slow + rng.normal(0, 0.03, 60)), true


@pytest.mark.parametrize("seed", [12, 53, 115, 232, 290, 380, 392])
def test_a_robot_may_have_passed_on_the_other_side(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seven of four hundred such windows in which the search ends on the wrong side."""
    window, true = passing(seed)

    def least_nees() -> float:
        hypotheses = solved(window).hypotheses
        return min(nees(RelativePoseEstimate(Verdict.UNIQUE, (one,)), true) for one in hypotheses)

    nearest = float(window.ranges.min())
    monkeypatch.setattr(solver, "CLOSE_PASS_M", nearest * 1.001)
    assert least_nees() < 14.2
    monkeypatch.setattr(solver, "CLOSE_PASS_M", nearest * 0.999)
    assert least_nees() > 14.2


def test_one_curve_is_enough_to_tell_left_from_right() -> None:
    window, true = window_of(
        straight((1, 3, 0), 60, 0.25), wander(np.random.default_rng(5), 60, 0.25)
    )
    estimate = solved(window)
    assert estimate.verdict is Verdict.UNIQUE
    assert same_pose(estimate.hypotheses[0].a_T_b, true, 1e-6)


STANDS = straight((1, 3, 0), 60, 0.0)
CURVE = wander(np.random.default_rng(5), 60, 0.25)


@pytest.mark.row("M5")
@pytest.mark.parametrize(
    ("a", "b"),
    [
        (straight((0, 0, 0), 60, 0.25), straight((1, 3, 0), 60, 0.25)),
        (straight((0, 0, 0), 60, 0.25), straight((1, 3, 0), 60, 0.15)),
        (CURVE, STANDS),
        (STANDS, CURVE),
        (STANDS, straight((0, 0, 1), 60, 0.0)),
    ],
    ids=["side by side", "one faster", "b stands", "a stands", "both stand"],
)
def test_too_little_motion_is_said_to_be_too_little(a: Array, b: Array) -> None:
    estimate = solved(window_of(a, b)[0])
    assert estimate == RelativePoseEstimate(Verdict.UNOBSERVABLE)


@pytest.mark.parametrize(("count", "verdict"), [(0, True), (5, True), (6, False)])
def test_six_measurements_are_the_fewest(count: int, verdict: bool) -> None:
    rng = np.random.default_rng(8)
    a, b = wander(rng, 60, 0.25), wander(rng, 60, 0.25)
    whole, _ = window_of(a, b)
    part = slice(60 - count, 60)
    window = Window(
        whole.t[part],
        whole.ranges[part],
        whole.a_poses[part],
        whole.b_poses[part],
        whole.a_antenna,
        whole.b_antenna,
    )
    assert (solved(window).verdict is Verdict.TOO_FEW) is verdict


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_ranges_that_are_nonsense_fit_nothing(seed: int) -> None:
    window, _ = curved(seed)
    nonsense = np.random.default_rng(seed).uniform(0, 20, 60)
    assert solved(with_ranges(window, nonsense)) == RelativePoseEstimate(Verdict.POOR_FIT)


# on both sides of each threshold


def chi2_per_degree(window: Window, monkeypatch: pytest.MonkeyPatch) -> float:
    monkeypatch.setattr(solver, "POOR_FIT", math.inf)
    return solved(window).hypotheses[0].chi2 / (len(window) - 3)


@pytest.mark.row("M10")
@pytest.mark.parametrize(("factor", "poor"), [(0.999, True), (1.001, False)])
def test_the_fit_is_poor_just_above_its_threshold(
    factor: float, poor: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, _ = curved(0)
    noisy = with_ranges(window, window.ranges + np.random.default_rng(1).normal(0, 0.2, 60))
    chi2 = chi2_per_degree(noisy, monkeypatch)
    assert chi2 > 1
    monkeypatch.setattr(solver, "POOR_FIT", factor * chi2)
    assert (solved(noisy).verdict is Verdict.POOR_FIT) is poor


@pytest.mark.parametrize(("factor", "kept"), [(0.999, 1), (1.001, 2)])
def test_a_minimum_is_carried_as_long_as_it_is_not_excluded(
    factor: float, kept: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # hardly a curve: the mirror image fits a little worse
    b = straight((3, 4, 2.0), 60, 0.2)
    b[:, 0] += 0.002 * np.arange(60) ** 1.5
    window, _ = window_of(straight((0, 0, 0), 60, 0.25), b)
    monkeypatch.setattr(solver, "EXCLUDED_CHI2", 1e4)
    best, second = solved(window).hypotheses[:2]
    assert second.chi2 > best.chi2 + 1e-3
    monkeypatch.setattr(solver, "EXCLUDED_CHI2", factor * (second.chi2 - best.chi2))
    assert len(solved(window).hypotheses) == kept


@pytest.mark.parametrize(("factor", "observable"), [(0.999, False), (1.001, True)])
@pytest.mark.parametrize("name", ["MAX_SIGMA_M", "MAX_SIGMA_RAD"])
def test_a_pose_is_observable_just_below_the_largest_sigma(
    name: str, factor: float, observable: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, _ = curved(0)
    covariance = solved(window).hypotheses[0].covariance
    sigma = {
        "MAX_SIGMA_M": math.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1]),
        "MAX_SIGMA_RAD": math.sqrt(covariance[2, 2]),
    }[name]
    monkeypatch.setattr(solver, name, factor * sigma)
    assert (solved(window).verdict is Verdict.UNIQUE) is observable


# the parts


def test_the_jacobian_of_the_residuals_is_that_of_finite_differences() -> None:
    window, true = curved(1)
    a, b = window.a_points, window.b_points
    poses = np.array([true + [0.3, -0.2, 0.1], true + [-2.0, 1.0, 1.5]])
    e, jacobian = linear(poses, a, b, window.ranges)
    for k, pose in enumerate(poses):
        moved = np.array([(matrix(pose) @ [*q, 1.0])[:2] for q in b]) - a
        assert np.allclose(e[k], np.hypot(*moved.T) - window.ranges)
    h = 1e-6
    for column in range(3):
        step = np.eye(3)[column] * h
        ahead, behind = (window_residuals(poses + s, a, b, window.ranges) for s in (step, -step))
        assert np.allclose(jacobian[..., column], (ahead - behind) / (2 * h), atol=1e-7)


def huber(window: Window, x: Array) -> Array:
    """Residuals of which scipy's Huber loss makes the cost of `refine`."""
    noise = SENSORS.ranges
    moved = np.array([matrix(x[:3]) @ [*q, 1.0] for q in window.b_points])[:, :2]
    distance = np.hypot(*(moved - window.a_points).T)
    return np.append((distance + x[3] - window.ranges) / noise.sigma, x[3] / noise.bias_sigma)


def cost_of(window: Window, x: Array) -> float:
    size = np.abs(huber(window, x))
    limit = LINKTRACK.huber_sigmas
    return float(np.sum(np.where(size < limit, size**2, limit * (2 * size - limit))))


def cost_at_the_best_bias(window: Window, pose: Array) -> float:
    return float(minimize_scalar(lambda bias: cost_of(window, np.append(pose, bias))).fun)


def minpack(window: Window, seeds: Array) -> Array:
    """The best pose and bias that scipy finds from the same seeds."""
    results = [
        least_squares(
            lambda x: huber(window, x),
            np.append(seed, 0.0),
            loss="huber",
            f_scale=LINKTRACK.huber_sigmas,
        )
        for seed in seeds
    ]
    best = min(results, key=lambda result: float(result.cost))
    assert 2 * best.cost == pytest.approx(cost_of(window, best.x))
    return np.asarray(best.x)


def refined(window: Window, seeds: Array) -> Array:
    fit = fit_of(window)
    descent = Descent(fit, fit.centred(seeds), [SENSORS.ranges])
    descent.run(ITERATIONS)
    return fit.poses(descent.minima()[0].centred)


@pytest.mark.slow
def test_the_refinement_reaches_the_minima_of_minpack() -> None:
    """From the same seeds, with Huber's loss, a bias, noise and bursts."""
    near, windows = 0, 14
    for seed in range(windows):
        window, _ = curved(seed, apart=0.0)
        rng = np.random.default_rng(seed)
        ranges = np.abs(window.ranges + rng.normal(0, 0.08, 60) + 0.2)
        ranges[rng.choice(60, 6, replace=False)] += 0.8
        noisy = with_ranges(window, ranges)
        a, b = noisy.a_points, noisy.b_points
        seeds = seeds_of(a, b, ranges, max(0.1, float(ranges[-1])), DELTA, 8)
        ours = refined(noisy, seeds)[0]
        theirs = minpack(noisy, seeds)
        assert cost_at_the_best_bias(noisy, ours) < cost_of(noisy, theirs) + 0.1
        near += same_pose(ours, theirs[:3], 0.02)
    assert near >= 0.9 * windows


def test_a_seed_from_which_nothing_can_come_is_dropped() -> None:
    window, true = curved(0)
    seeds = np.array([true + [0.1, 0, 0], true * [-1, -1, 1] + [0, 0, 2.0]])
    minima = refined(window, seeds)
    assert len(minima) == 1
    assert same_pose(minima[0], true, 1e-2)


def test_absurd_odometry_of_a_peer_raises_nothing() -> None:
    window, _ = curved(0)
    for far in (1e5, 2e5, 1e9):
        b_poses = window.b_poses * [far, -far, 50.0]
        for poses in (b_poses, np.full_like(b_poses, far), np.zeros_like(b_poses)):
            strange = replace(window, b_poses=poses)
            noisy = PairNoise(SENSORS.ranges, NOISE, replace(NOISE, scale=0.5, yaw_rad_per_m=0.35))
            estimate = solve(strange, noisy, DELTA)
            assert estimate.verdict is not Verdict.UNIQUE
            algorithm_1.solve(strange, 0.1, DELTA)
    assert se2.wrap(0.0) == 0


# a pose is that of the end of its window


@pytest.mark.parametrize(("off", "verdict"), [(0.15, Verdict.UNIQUE), (0.6, Verdict.POOR_FIT)])
def test_ranges_that_leave_the_rest_at_the_end_name_no_pose(off: float, verdict: Verdict) -> None:
    window, _ = curved(2)
    ranges = window.ranges.copy()
    ranges[-3:] += off
    assert solved(with_ranges(window, ranges)).verdict is verdict


def test_the_same_burst_in_the_middle_does_no_harm() -> None:
    window, true = curved(2)
    ranges = window.ranges.copy()
    ranges[-20:-17] += 0.6
    estimate = solved(with_ranges(window, ranges))
    assert estimate.verdict is Verdict.UNIQUE
    assert same_pose(estimate.hypotheses[0].a_T_b, true, 0.3)


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_the_pose_is_that_of_the_reference_time_and_later_ranges_count(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = wander(rng, 60, 0.25), wander(rng, 60, 0.25) + [9.0, 0, 0]
    window, _ = window_of(a, b)
    earlier = replace(
        window,
        t=window.t - window.t[-5],
        a_poses=se2.between(window.a_poses[-5], window.a_poses),
        b_poses=se2.between(window.b_poses[-5], window.b_poses),
    )
    assert (window.before, earlier.before) == (60, 56)
    true = se2.between(a[-5], b[-5])
    assert same_pose(solved(earlier).hypotheses[0].a_T_b, true, 1e-6)


# windows of several pairs at once


def some_windows() -> list[tuple[Window, PairNoise]]:
    """Of unlike length, of every verdict, one with robots that meet, each with its own noise."""
    rng, out = np.random.default_rng(31), []
    for k, count in enumerate([60, 60, 25, 60, 5, 60, 41, 60, 12, 60]):
        window, _ = curved_window(rng, 6.0 * (k % 3), count)
        ranges = np.abs(window.ranges + rng.normal(0, 1.0 if k == 5 else 0.05, count))
        at = -1 - 2 * (k % 2)
        window = replace(
            window,
            ranges=ranges,
            t=window.t - window.t[at],
            a_poses=se2.between(window.a_poses[at], window.a_poses),
            b_poses=se2.between(window.b_poses[at], window.b_poses),
        )
        noise = PairNoise(RangeNoise(0.1, 0.05 * (k + 1), 0.8 + 0.05 * k), NOISE, NOISE)
        out.append((window, replace(noise, b=replace(NOISE, scale=0.02 + 0.01 * (k % 2)))))
    still, _ = window_of(straight((0, 0, 0), 60, 0.0), straight((4, 0, 1), 60, 0.0))
    ambiguous, _ = window_of(straight((0, 0, 0), 60, 0.25), straight((3, 4, 2.0), 60, 0.2))
    return [*out, (still, SENSORS), (ambiguous, SENSORS)]


@pytest.mark.parametrize("at_once", [16, 3])
def test_each_of_several_windows_is_answered_as_if_it_was_alone(
    at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(solver, "MOST_AT_ONCE", at_once)
    windows, noises = zip(*some_windows(), strict=True)
    together = solve_all(windows, noises, DELTA)
    apart = [solve(window, noise, DELTA) for window, noise in some_windows()]
    assert {estimate.verdict for estimate in together} == set(Verdict)
    for ours, alone in zip(together, apart, strict=True):
        assert ours.verdict is alone.verdict
        for h, g in zip(ours.hypotheses, alone.hypotheses, strict=True):
            assert np.abs(h.a_T_b - g.a_T_b).max() < 1e-10
            assert np.allclose(h.covariance, g.covariance, rtol=1e-6)
            assert h.chi2 == pytest.approx(g.chi2, rel=1e-6)


def test_so_is_how_badly_it_fits_at_its_best() -> None:
    some = [(window, noise) for window, noise in some_windows() if len(window) > 5]
    windows, noises = zip(*some, strict=True)
    apart = [solver.least_chi2([window], [noise], DELTA)[0] for window, noise in some]
    assert solver.least_chi2(windows, noises, DELTA) == pytest.approx(apart, rel=1e-6)


def test_where_there_is_nothing_to_solve_there_is_no_answer() -> None:
    assert solve_all([], [], DELTA) == []
    assert not len(solver.least_chi2([], [], DELTA))


def test_windows_of_unlike_sensors_are_not_solved_at_once() -> None:
    window, _ = curved(0)
    other = replace(SENSORS, model=RangeModel(slow_s=1.0))
    with pytest.raises(ValueError, match="several range models"):
        solve_all([window, window], [SENSORS, other], DELTA)
