"""Windows rid of what is known of the sensors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, Array, curved_window, same_pose

from drslamd.conventions import Segment
from drslamd.slam.calibration.window_calibration import (
    LEAST_SCALE,
    PairCalibration,
    calibrated_window,
    remaining,
)
from drslamd.slam.graph.estimate import Learned, TeamEstimate
from drslamd.slam.range_model import LINKTRACK, RangeNoise
from drslamd.slam.relative_pose.estimate import PairNoise
from drslamd.slam.relative_pose.solver import solve
from drslamd.slam.relative_pose.window import Window

SENSORS = PairNoise(RangeNoise(0.10, 0.30), NOISE, NOISE)
KNOWN = PairCalibration(Learned(-0.4, 0.01), Learned(0.15, 0.001), Learned(-0.05, 0.001))


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


def test_what_was_never_measured_changes_nothing() -> None:
    window, _ = uncalibrated(3)
    same, noise = calibrated_window(window, SENSORS, PairCalibration.of(None, 0, 1))
    assert np.array_equal(same.ranges, window.ranges)
    assert np.array_equal(same.a_poses, window.a_poses)
    assert noise.ranges.bias_sigma == pytest.approx(0.30)
    assert noise.a.scale == pytest.approx(NOISE.scale)


def test_what_is_left_is_never_below_what_no_constant_describes() -> None:
    _, noise = calibrated_window(uncalibrated(4)[0], SENSORS, KNOWN)
    assert noise.ranges.bias_sigma == pytest.approx(1 / math.hypot(1 / 0.3, 1 / 0.0539), rel=1e-3)
    assert noise.ranges.bias_sigma > 0.98 * LINKTRACK.least_bias_m
    assert 0.9 * LEAST_SCALE < noise.b.scale < NOISE.scale
    assert noise.a.yaw_rad_per_m == NOISE.yaw_rad_per_m


@pytest.mark.parametrize("scatter", [0.5, 1.0, 1.3])
def test_ranges_that_scatter_less_have_taught_more(scatter: float) -> None:
    window, _ = uncalibrated(5)
    learned = PairCalibration(Learned(0.1, 0.08), Learned(0.05, 0.02), Learned(0.0, 0.01), scatter)
    same, noise = calibrated_window(window, SENSORS, learned)
    assert np.allclose(same.ranges, window.ranges - 0.1)
    # weights are those that the configuration asks for, claims those of what was learned
    assert noise.ranges.sigma == SENSORS.ranges.sigma
    assert noise.ranges.scatter == scatter
    spread = math.hypot(2 * scatter * 0.08, 0.05)
    assert noise.ranges.bias_sigma**-2 == pytest.approx(0.3**-2 + spread**-2)
    spread = math.hypot(2 * scatter * 0.02, 0.01)
    assert noise.a.scale**-2 == pytest.approx(NOISE.scale**-2 + spread**-2)
    spread = math.hypot(2 * scatter * 0.01, 0.01)
    assert noise.b.scale**-2 == pytest.approx(NOISE.scale**-2 + spread**-2)


@pytest.mark.parametrize("sigma", [0.01, 0.1, 10.0])
def test_knowledge_adds_up_as_information(sigma: float) -> None:
    left = remaining(Learned(0.2, sigma), before=0.3, least=0.0, widened=2.0)
    assert left**-2 == pytest.approx(0.3**-2 + (2.0 * sigma) ** -2)


def test_what_strong_signals_do_is_taken_out_of_near_ranges_alone() -> None:
    window, _ = uncalibrated(5)
    window = replace(window, ranges=np.linspace(-0.2, 30.0, len(window.ranges)))
    better, _ = calibrated_window(window, SENSORS, PairCalibration(near_bias=Learned(-0.2, 0.02)))
    added = better.ranges - window.ranges
    assert added[0] == pytest.approx(0.2)
    assert np.interp(3.0, window.ranges, added) == pytest.approx(0.2 / math.e, abs=0.003)
    assert added[-1] == pytest.approx(0.0, abs=1e-4)


def test_a_pair_is_found_whoever_owns_it() -> None:
    estimate = TeamEstimate(
        Segment(0, 1, 0),
        {},
        bias_m={(1, 2): Learned(0.3, 0.02)},
        scale={2: Learned(0.1, 0.01)},
        scatter={(1, 2): 0.7},
    )
    sensors = PairCalibration.of(replace(estimate, near_bias_m=Learned(-0.1, 0.03)), 2, 1)
    assert sensors.bias.value == 0.3
    assert sensors.scatter == 0.7
    assert PairCalibration.of(estimate, 0, 1).scatter == 1.0
    assert sensors.near_bias == (-0.1, 0.03)
    assert sensors.scale_a.value == 0.1
    assert math.isinf(sensors.scale_b.sigma)
    # where module 3 has not come to an end, nothing has been learned
    assert PairCalibration.of(replace(estimate, converged=False), 2, 1) == PairCalibration()
