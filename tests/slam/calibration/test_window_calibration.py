"""Windows rid of what is known of the sensors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, Array, curved_window, inverted, product, same_pose

from drslamd.conventions import Segment
from drslamd.slam.calibration.window_calibration import (
    ODD_YAW,
    EndCalibration,
    PairCalibration,
    calibrated_window,
    remaining,
)
from drslamd.slam.graph.estimate import LEAST_SCALE, Learned, TeamEstimate
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.range_model import LINKTRACK, RangeNoise
from drslamd.slam.relative_pose.estimate import PairNoise
from drslamd.slam.relative_pose.mistakes.what_if import MIRROR
from drslamd.slam.relative_pose.solver import solve
from drslamd.slam.relative_pose.window import Window

SENSORS = PairNoise(RangeNoise(0.10, 0.30), NOISE, NOISE)
KNOWN = PairCalibration(
    Learned(-0.4, 0.01),
    EndCalibration(Learned(0.15, 0.001)),
    EndCalibration(Learned(-0.05, 0.001)),
)


def uncalibrated(seed: int) -> tuple[Window, Array]:
    """A window whose ranges are 0.4 m short, whose odometries count 1 / 0.85 and 1 / 1.05."""
    window, true = curved_window(np.random.default_rng(seed), 7.0)
    return replace(
        window,
        ranges=window.ranges - 0.4,
        a_poses=window.a_poses / [0.85, 0.85, 1],
        b_poses=window.b_poses / [1.05, 1.05, 1],
    ), true


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_calibrated_window_gives_the_exact_pose(seed: int) -> None:
    window, true = uncalibrated(seed)
    better = solve(*calibrated_window(window, SENSORS, KNOWN), 0.1)
    assert same_pose(better.hypotheses[0].a_T_b, true, 1e-6)
    before = solve(window, SENSORS, 0.1).hypotheses
    assert not before or not same_pose(before[0].a_T_b, true, 0.1)


def mounted(seed: int, before: int) -> tuple[Window, Window]:
    """A window of two robots on curves as it should be, and as it is with tracks and antennas that
    are not as configured; so many measurements lie before its reference time.

    Wheels of a tell two thirds of each turn and those of b one and a quarter of it, in steps so
    small that their ways are the same.
    """
    rng = np.random.default_rng(seed)
    n, fine = 40, 50
    right, wrong = [], []
    for scale, turn in ((1.0, 1.5), (0.8, 0.8)):
        bends = np.repeat(rng.normal(0, 0.2, n - 1), fine) / fine
        ends = []
        for each, way in ((bends, 0.25 / fine), (bends / turn, 0.25 / fine / scale)):
            heading = 0.7 + np.append(0.0, np.cumsum(each))
            middle = heading[:-1] + each / 2
            place = way * np.cumsum(np.stack([np.cos(middle), np.sin(middle)], axis=-1), axis=0)
            path = np.column_stack([np.vstack([[0, 0], place]), heading])[::fine]
            ends.append(np.array([product(inverted(path[before - 1]), p) for p in path]))
        right.append(ends[0])
        wrong.append(ends[1])
    t = 0.5 * (np.arange(n) - before + 1)
    antennas = np.array([0.1, 0.0]), np.array([0.0, -0.2])
    ranges = np.full(n, 5.0)
    beside = np.array([0.2, -0.1]), np.array([0.0, 0.3])
    told = Window(t, ranges, wrong[0], wrong[1], antennas[0], antennas[1])
    return replace(
        told,
        a_poses=right[0],
        b_poses=right[1],
        a_antenna=antennas[0] + beside[0],
        b_antenna=antennas[1] + beside[1],
    ), told


MOUNTED = PairCalibration(
    a=EndCalibration(turn=0.5, antenna=(0.2, -0.1)),
    b=EndCalibration(Learned(0.2, 0.001), turn=-0.2, antenna=(0.0, 0.3)),
)


@pytest.mark.parametrize("before", [40, 30, 1])
def test_tracks_and_antennas_of_a_window_become_what_they_are(before: int) -> None:
    """On both sides of the reference time, from which everything is seen."""
    real, told = mounted(1, before)
    assert told.before == before
    better, noise = calibrated_window(told, SENSORS, MOUNTED)
    for name in ("a_poses", "b_poses"):
        expected, found, raw = (getattr(w, name) for w in (real, better, told))
        # half of a turn acts over the way of a step, of which there are fine ones between
        assert np.hypot(*(found - expected)[:, :2].T).max() < 0.03
        assert found[:, 2] == pytest.approx(expected[:, 2], abs=1e-6)
        assert np.hypot(*(raw - expected)[:, :2].T).max() > 0.3
    assert better.a_antenna == pytest.approx(real.a_antenna)
    assert better.b_antenna == pytest.approx(real.b_antenna)
    assert np.array_equal(better.ranges, told.ranges)
    # a known turn makes no noise smaller
    assert noise.a == SENSORS.a


def test_a_window_without_turns_is_scaled_and_no_more() -> None:
    window, _ = uncalibrated(6)
    better, _ = calibrated_window(window, SENSORS, KNOWN)
    assert np.allclose(better.a_poses, window.a_poses * [0.85, 0.85, 1], atol=1e-12)
    assert np.allclose(better.b_poses, window.b_poses * [1.05, 1.05, 1], atol=1e-12)
    assert np.array_equal(better.a_antenna, window.a_antenna)


@pytest.mark.parametrize(
    ("known", "correction"),
    [
        (EndCalibration(), Correction()),
        # a scale that is nearly right is noise over a long way, and bends nothing
        (EndCalibration(Learned(0.2, 0.01)), Correction()),
        (EndCalibration(Learned(0.2, 0.01), turn=0.1), Correction(scale=0.2, turn=0.1)),
        (EndCalibration(antenna=(0.1, 0.2)), Correction()),
    ],
)
def test_a_long_way_is_corrected_where_turns_are_not_as_configured(
    known: EndCalibration, correction: Correction
) -> None:
    assert known.correction == correction


@pytest.mark.parametrize(("of_usual", "is_out"), [(0.99, False), (1.01, True)])
def test_a_yaw_rate_is_taken_out_where_it_is_unusual(of_usual: float, is_out: bool) -> None:
    """Of a window and of a long way: straight on by odometry, and really along a circle."""
    rate = of_usual * ODD_YAW
    estimate = TeamEstimate(Segment(0, 1, 0), {}, yaw={2: Learned(rate, 0.001)})
    end = EndCalibration.of(estimate, 2)
    straight = np.column_stack([np.arange(1, 1001) / 100, np.zeros(1000), np.zeros(1000)])
    x, y, theta = end.path(straight, 0)[-1]
    turned = -10 * rate if is_out else 0.0
    assert theta == pytest.approx(turned)
    assert y == pytest.approx((math.cos(turned) - 1) / rate if is_out else 0.0, abs=0.01)
    assert x == pytest.approx(math.sin(-turned) / rate if is_out else 10.0, abs=0.01)
    assert end.correction.yaw == (rate if is_out else 0.0)


def test_what_was_never_measured_changes_nothing() -> None:
    window, _ = uncalibrated(3)
    same, noise = calibrated_window(window, SENSORS, PairCalibration.of(None, 0, 1))
    assert np.array_equal(same.ranges, window.ranges)
    assert np.array_equal(same.a_poses, window.a_poses)
    assert noise.ranges.bias_sigma == pytest.approx(0.30)
    assert noise.ranges.bias_beyond == 0
    assert noise.a.scale == pytest.approx(NOISE.scale)


def test_what_is_left_is_never_below_what_no_constant_describes() -> None:
    _, noise = calibrated_window(uncalibrated(4)[0], SENSORS, KNOWN)
    assert noise.ranges.bias_sigma == pytest.approx(math.hypot(0.01, LINKTRACK.least_bias_m))
    assert noise.b.scale == pytest.approx(math.hypot(0.001, LEAST_SCALE))
    assert noise.b.scale < NOISE.scale
    assert noise.a.yaw_rad_per_m == NOISE.yaw_rad_per_m


@pytest.mark.parametrize("scatter", [0.5, 1.0, 1.3])
def test_what_module_3_says_of_its_sigmas_is_taken_as_it_is(scatter: float) -> None:
    """How much the ranges of the pair scatter is part of those sigmas, and does not count twice."""
    window, _ = uncalibrated(5)
    a, b = EndCalibration(Learned(0.05, 0.02)), EndCalibration(Learned(0.0, 0.01))
    learned = PairCalibration(Learned(0.1, 0.08), a, b, scatter, bias_sigma=0.2)
    wide = replace(NOISE, scale=0.1)
    same, noise = calibrated_window(window, replace(SENSORS, a=wide, b=wide), learned)
    assert np.allclose(same.ranges, window.ranges - 0.1)
    # weights are those that the configuration asks for, claims those of what was learned
    assert noise.ranges.sigma == SENSORS.ranges.sigma
    assert noise.ranges.scatter == scatter
    assert noise.ranges.bias_sigma == pytest.approx(math.hypot(0.08, LINKTRACK.least_bias_m))
    assert noise.ranges.bias_beyond == pytest.approx(math.sqrt(0.2**2 - 0.08**2))
    assert noise.a.scale == pytest.approx(math.hypot(0.02, LEAST_SCALE))
    assert noise.b.scale == pytest.approx(math.hypot(0.01, LEAST_SCALE))


@pytest.mark.parametrize(("wrong", "beyond"), [(0.05, 0.0), (0.5, math.sqrt(0.09 - 0.0089))])
def test_a_bias_is_no_more_wrong_than_was_configured_and_no_less_than_it_is_held(
    wrong: float, beyond: float
) -> None:
    learned = PairCalibration(Learned(0.1, 0.08), bias_sigma=wrong)
    _, noise = calibrated_window(uncalibrated(5)[0], SENSORS, learned)
    assert LINKTRACK.least_bias_m == 0.05
    assert noise.ranges.bias_beyond == pytest.approx(beyond)


@pytest.mark.parametrize(
    ("sigma", "least", "left"),
    [(0.01, 0.0, 0.01), (0.03, 0.04, 0.05), (0.299, 0.0, 0.299), (0.301, 0.0, 0.3)],
)
def test_what_is_left_is_what_was_learned_and_what_changes_but_no_more_than_before(
    sigma: float, least: float, left: float
) -> None:
    assert remaining(Learned(0.2, sigma), before=0.3, least=least) == pytest.approx(left)


def test_of_what_was_never_measured_all_is_left() -> None:
    assert remaining(Learned(), before=0.3, least=0.05) == 0.3


def test_what_strong_signals_do_is_taken_out_of_near_ranges_alone() -> None:
    window, _ = uncalibrated(5)
    window = replace(window, ranges=np.linspace(-0.2, 30.0, len(window.ranges)))
    better, _ = calibrated_window(window, SENSORS, PairCalibration(near_bias=Learned(-0.2, 0.02)))
    added = better.ranges - window.ranges
    assert added[0] == pytest.approx(0.2)
    assert np.interp(3.0, window.ranges, added) == pytest.approx(0.2 / math.e, abs=0.003)
    assert added[-1] == pytest.approx(0.0, abs=1e-4)


def test_what_strong_signals_do_goes_by_the_distance_without_the_bias() -> None:
    """A range of 3 m, of which 2 m are bias, is one of a module 1 m away, but for that itself."""
    window, _ = uncalibrated(5)
    window = replace(window, ranges=np.full(len(window.ranges), 3.0))
    known = PairCalibration(bias=Learned(2.0, 0.02), near_bias=Learned(-0.2, 0.02))
    better, _ = calibrated_window(window, SENSORS, known)
    distance = 1.0
    for _ in range(50):
        distance = 1.0 + 0.2 * math.exp(-distance / 3.0)
    assert better.ranges == pytest.approx(distance, abs=0.002)


def test_a_pair_is_found_whoever_owns_it() -> None:
    estimate = TeamEstimate(
        Segment(0, 1, 0),
        {},
        bias_m={(1, 2): Learned(0.3, 0.02)},
        scale={2: Learned(0.1, 0.01)},
        scatter={(1, 2): 0.7},
        bias_sigma_m={(1, 2): 0.2},
    )
    sensors = PairCalibration.of(replace(estimate, near_bias_m=Learned(-0.1, 0.03)), 2, 1)
    assert sensors.bias.value == 0.3
    assert sensors.bias_sigma == 0.2
    assert sensors.scatter == 0.7
    assert PairCalibration.of(estimate, 0, 1).scatter == 1.0
    assert sensors.near_bias == (-0.1, 0.03)
    assert sensors.a.scale.value == 0.1
    assert math.isinf(sensors.b.scale.sigma)
    assert sensors.b == EndCalibration()
    turned = replace(
        estimate,
        turn={1: Learned(0.3, 0.05)},
        antenna_m={2: (Learned(0.1, 0.02), Learned(-0.2, 0.02))},
    )
    sensors = PairCalibration.of(turned, 2, 1)
    assert sensors.a == EndCalibration(Learned(0.1, 0.01), 0.0, (0.1, -0.2))
    assert sensors.b == EndCalibration(turn=0.3)
    # where module 3 has not come to an end, nothing has been learned
    assert PairCalibration.of(replace(estimate, converged=False), 2, 1) == PairCalibration()


def test_a_peer_that_turns_the_other_way_is_seen_in_the_mirror_until_module_3_knows_more() -> None:
    """As soon as it does, also of scale and yaw rate."""
    flip = np.array([1.0, -1.0, -1.0])
    real, _ = mounted(2, 30)
    told = replace(real, b_poses=real.b_poses * flip)
    known = PairCalibration.of(None, 1, 2, MIRROR)
    better, noise = calibrated_window(told, SENSORS, known)
    assert better.b_poses == pytest.approx(real.b_poses)
    assert np.array_equal(better.a_poses, real.a_poses)
    assert noise == SENSORS
    assert known.b.correction.is_mirrored
    learned = TeamEstimate(
        Segment(0, 1, 0), {}, scale={2: Learned(0.1, 0.01)}, turn={2: Learned(-2.0, 0.01)}
    )
    assert PairCalibration.of(learned, 1, 2, MIRROR).b.scale.value == 0.1
