"""What outlives a restart of what was learned, and what is made of it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from slam_scenes import config

from drslamd.config import RelativePoseSection
from drslamd.conventions import Segment
from drslamd.slam.calibration.calibration_store import CalibrationStore
from drslamd.slam.calibration.sensor_calibration import (
    CHANGED_BIAS_M,
    NOTHING,
    SensorCalibration,
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


TAPED = SensorCalibration(scale=Learned(0.3, 0.006), turn=Learned(-0.3, 0.01))


@pytest.mark.parametrize(("section", "yaw"), [(None, -0.002), (OFF, 0.0), (PAPER, 0.0)])
def test_what_was_taped_is_taken_out_even_where_nothing_that_was_learned_is(
    section: RelativePoseSection | None, yaw: float
) -> None:
    is_used = section is None or closure_method(section).uses_calibration
    memory = CalibrationStore(KEPT, is_used, TAPED)
    assert (memory.used.scale, memory.used.turn) == (TAPED.scale, TAPED.turn)
    assert memory.used.yaw.value == yaw


def test_what_is_left_of_a_taped_scale_is_learned_beside_it() -> None:
    memory = CalibrationStore(SensorCalibration(), True, TAPED)
    assert not memory.is_news()
    latest = after(memory, scale=Learned(0.02, 0.004))
    assert 1 - latest.scale.value == pytest.approx(0.7 * 0.98)
    # it agrees with the tape and is sharper, so the next start begins with it
    assert CalibrationStore(latest, True, TAPED).used.scale == latest.scale


def test_a_start_that_learns_less_keeps_what_there_was() -> None:
    kept = math.hypot(0.03, CHANGED_BIAS_M)
    less, more = (Learned(0.1, factor * kept) for factor in (1.01, 0.99))
    assert after(CalibrationStore(KEPT, True), bias=less) == KEPT
    assert after(CalibrationStore(KEPT, True), bias=more).bias[2].value == pytest.approx(-0.3)
    memory = CalibrationStore(KEPT, True)
    memory.update(None, 5, [2])
    assert memory.latest == KEPT


def test_a_value_that_could_not_be_read_back_is_not_kept() -> None:
    absurd = after(CalibrationStore(SensorCalibration(), True), scale=Learned(1.6, 0.001))
    assert absurd == SensorCalibration(bias={})
    said = replace(
        estimate(),
        turn={5: Learned(1.6, 0.001)},
        antenna_m={5: (Learned(0.1, 0.001), Learned(2.1, 0.001))},
    )
    memory = CalibrationStore(SensorCalibration(), True)
    memory.update(said, 5, [2])
    # of an antenna both coordinates are kept, or none
    assert memory.latest == SensorCalibration(bias={})


def test_turns_multiply_and_places_of_an_antenna_add_to_what_was_taken_out() -> None:
    kept = replace(
        KEPT,
        turn=Learned(0.2, 0.02),
        antenna_x=Learned(0.1, 0.02),
        antenna_y=Learned(-0.3, 0.02),
    )
    memory = CalibrationStore(kept, True)
    said = replace(
        estimate(),
        turn={5: Learned(0.1, 0.01)},
        antenna_m={5: (Learned(0.05, 0.01), Learned(0.02, 0.01))},
    )
    assert not memory.is_news()
    memory.update(said, 5, [2])
    assert memory.latest.turn == pytest.approx(Learned(0.32, 0.01))
    assert memory.latest.antenna_x == pytest.approx(Learned(0.15, 0.01))
    assert memory.latest.antenna_y == pytest.approx(Learned(-0.28, 0.01))
    assert memory.is_news()


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


@pytest.mark.parametrize(("turn", "is_kept"), [(-0.5, True), (-2.0, False)])
def test_of_wheels_that_turn_the_other_way_nothing_is_kept(turn: float, is_kept: bool) -> None:
    """It is of the mirror image, and they will be set right before the next start."""
    memory = CalibrationStore(SensorCalibration(), True)
    learned = estimate(scale=Learned(0.15, 0.005), yaw=Learned(0.01, 1e-4))
    memory.update(replace(learned, turn={5: Learned(turn, 0.02)}), 5, [2])
    assert (memory.latest != SensorCalibration()) is is_kept
