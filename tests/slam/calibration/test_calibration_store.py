"""What outlives a restart of what was learned, and what is made of it."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import pytest
from slam_scenes import NOISE, config

from drslamd.config import RelativePoseSection
from drslamd.conventions import Segment
from drslamd.sensors.samples import Motion
from drslamd.slam.calibration.calibration_store import CalibrationStore
from drslamd.slam.calibration.sensor_calibration import (
    CHANGED_BIAS_M,
    CHANGED_SCALE,
    MOST_BIAS_M,
    MOST_SCALE_ERROR,
    NOTHING,
    SensorCalibration,
    is_sound,
)
from drslamd.slam.graph.estimate import Learned, TeamEstimate
from drslamd.slam.settings import closure_method

KEPT = SensorCalibration(Learned(0.15, 0.005), Learned(-0.002, 0.0004), {2: Learned(-0.4, 0.03)})
OFF = config(extra="[relative_pose]\nself_calibration = false\n").relative_pose
PAPER = config(extra='[relative_pose]\nalgorithm = "paper"\n').relative_pose


def estimate(
    scale: Learned = NOTHING, bias: Learned = NOTHING, yaw: Learned = NOTHING
) -> TeamEstimate:
    frame = Segment(0, 1, 0)
    return TeamEstimate(frame, {}, bias_m={(2, 5): bias}, scale={5: scale}, yaw={5: yaw})


def after(memory: CalibrationStore, **learned: Learned) -> SensorCalibration:
    memory.update(estimate(**learned), 5, [2])
    return memory.latest


@pytest.mark.parametrize("converged", [True, False])
def test_only_a_solution_that_came_to_an_end_is_kept(converged: bool) -> None:
    memory = CalibrationStore(SensorCalibration(), True)
    memory.update(replace(estimate(scale=Learned(0.15, 0.005)), converged=converged), 5, [2])
    assert (memory.latest.scale.value == pytest.approx(0.15)) is converged


def test_what_is_written_is_read_back() -> None:
    for constants in (KEPT, SensorCalibration()):
        state = json.loads(json.dumps(constants.state()))
        assert is_sound(state)
        assert SensorCalibration.of_state(state) == constants


@pytest.mark.parametrize(
    "damage",
    [
        [],
        {"scale": 0.1},
        {"scale": [0.1]},
        {"scale": [0.1, 0.01, 0.0]},
        {"scale": [0.1, "0.01"]},
        {"scale": [True, 0.01]},
        {"scale": [float("nan"), 0.01]},
        {"scale": [0.1, float("nan")]},
        {"scale": [0.1, float("inf")]},
        {"scale": [0.1, 0.0]},
        {"scale": [10**400, 0.01]},
        {"scale": [1.01 * MOST_SCALE_ERROR, 0.01]},
        {"yaw_rad_per_m": [1.0, 0.01]},
        {"bias_m": [[0.1, 0.01]]},
        {"bias_m": {"two": [0.1, 0.01]}},
        {"bias_m": {"-2": [0.1, 0.01]}},
        {"bias_m": {"255": [0.1, 0.01]}},
        {"bias_m": {"2": [-1.01 * MOST_BIAS_M, 0.01]}},
        {"bias_m": {str(n).zfill(k): [0.1, 0.01] for n in range(200) for k in (1, 4)}},
    ],
)
def test_what_nobody_can_have_learned_is_refused(damage: Any) -> None:
    assert not is_sound(damage)


def test_values_at_their_bounds_are_believed() -> None:
    assert is_sound({"scale": [-MOST_SCALE_ERROR, 0.01], "bias_m": {"254": [MOST_BIAS_M, 0.01]}})
    assert is_sound({"bias_m": {str(n): [0, 1] for n in range(254)}})


def test_known_errors_of_the_wheels_are_taken_out() -> None:
    back = KEPT.corrected(Motion(7, -2.0, 0.1))
    assert back.distance_m == pytest.approx(-2.0 * 0.85)
    assert back.turn_rad == pytest.approx(0.1 + 0.002 * 2.0)
    assert (back.utime, back.gap) == (7, False)


def test_sigmas_come_back_wider_than_they_were_kept_and_narrower_than_configured() -> None:
    assert KEPT.narrowed(NOISE).scale < NOISE.scale
    wide = replace(NOISE, scale=0.5)
    assert CHANGED_SCALE < KEPT.narrowed(wide).scale < 1.1 * CHANGED_SCALE
    assert CHANGED_BIAS_M < KEPT.bias_sigma(2, 5.0) < 1.1 * CHANGED_BIAS_M
    assert KEPT.bias_sigma(3, 0.3) == pytest.approx(0.3)
    assert SensorCalibration().narrowed(NOISE) == NOISE


def test_what_is_left_adds_to_what_was_taken_out() -> None:
    latest = after(
        CalibrationStore(KEPT, True),
        scale=Learned(0.02, 0.004),
        bias=Learned(0.1, 0.02),
        yaw=Learned(0.001, 0.0002),
    )
    assert 1 - latest.scale.value == pytest.approx(0.85 * 0.98)
    assert latest.yaw.value == pytest.approx(-0.001)
    assert latest.bias[2] == pytest.approx(Learned(-0.3, 0.02))


@pytest.mark.parametrize("section", [OFF, PAPER])
def test_nothing_is_taken_out_where_it_is_not_wanted_but_it_is_still_learned(
    section: RelativePoseSection,
) -> None:
    memory = CalibrationStore(KEPT, closure_method(section).uses_calibration)
    assert memory.used == SensorCalibration()
    assert after(memory, bias=Learned(0.1, 0.02)).bias == {2: Learned(0.1, 0.02)}


def test_a_start_that_learns_less_keeps_what_there_was() -> None:
    widened = math.hypot(2 * 0.03, CHANGED_BIAS_M)
    less, more = (Learned(0.1, factor * widened / 2) for factor in (1.01, 0.99))
    assert after(CalibrationStore(KEPT, True), bias=less) == KEPT
    assert after(CalibrationStore(KEPT, True), bias=more).bias[2].value == pytest.approx(-0.3)
    memory = CalibrationStore(KEPT, True)
    memory.update(None, 5, [2])
    assert memory.latest == KEPT


def test_a_value_that_could_not_be_read_back_is_not_kept() -> None:
    absurd = after(CalibrationStore(SensorCalibration(), True), scale=Learned(0.6, 0.001))
    assert absurd == SensorCalibration(bias={})


def test_only_pairs_that_we_own_are_kept() -> None:
    memory = CalibrationStore(SensorCalibration(), True)
    memory.update(estimate(bias=Learned(0.1, 0.02)), 5, [])
    assert not memory.latest.bias


@pytest.mark.parametrize(
    ("scale", "bias", "is_news"),
    [
        (Learned(0.0, 0.005), Learned(0.0, 0.03), False),
        (Learned(0.009, 0.005), Learned(0.04, 0.025), False),
        (Learned(0.013, 0.005), Learned(0.0, 0.03), True),
        (Learned(0.0, 0.003), Learned(0.0, 0.03), True),
        (Learned(0.0, 0.005), Learned(0.06, 0.03), True),
        (Learned(0.0, 0.005), Learned(0.0, 0.02), True),
    ],
)
def test_the_disk_is_written_when_something_changed(
    scale: Learned, bias: Learned, is_news: bool
) -> None:
    memory = CalibrationStore(KEPT, True)
    after(memory, scale=scale, bias=bias)
    assert memory.is_news() == is_news
    memory.on_saved()
    assert not memory.is_news()
