"""The paper's experiment made anew: windows, pose times, calibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.recordings import world
from lab.reproduce import experiment
from lab.reproduce.experiment import GRID_S, PAIRS, POSE_TIMES, SCENE, Trial
from lab.score import metrics

from drslamd.slam.relative_pose import algorithm_1

PERFECT = replace(
    SCENE,
    ranges=world.RangeModel(bias=0.0, slow=0.0, slow_s=2.5, white=0.0, burst_share=0.0, lost=0.0),
    odometry=world.OdometryModel(0.0, 0.0, 0.0, 0.0),
)


@pytest.fixture(scope="module")
def perfect() -> Trial:
    return experiment.trial(3, PERFECT)


@pytest.mark.parametrize("tau", [10, 100])
@pytest.mark.parametrize("points", [None, 60])
def test_without_noise_the_true_pose_explains_every_range(
    perfect: Trial, tau: int, points: int | None
) -> None:
    for pair in PAIRS:
        truth = perfect.true_pairs(*pair)
        for k in (0, 100, 332):
            window = perfect.window(pair, k, tau, points=points)
            assert window is not None
            error = algorithm_1.window_residuals(
                truth[k][None], window.a_points, window.b_points, window.ranges
            )
            # positions between samples of the odometry are cut short in curves by millimetres
            assert np.abs(error).max() < 0.004


def test_a_window_holds_tau_and_one_samples_up_to_the_pose_time(perfect: Trial) -> None:
    window = perfect.window((0, 2), 50, 25)
    assert window is not None
    assert window.t == pytest.approx(np.arange(-25, 1) * GRID_S, abs=1e-6)
    assert window.a_poses[-1] == pytest.approx(np.zeros(3), abs=1e-9)
    assert window.b_poses[-1] == pytest.approx(np.zeros(3), abs=1e-9)


def test_thinning_leaves_about_as_many_samples_as_asked_for(perfect: Trial) -> None:
    window = perfect.window((0, 1), 50, 180, points=60)
    assert window is not None
    assert 60 <= len(window) <= 62


def test_a_range_beyond_the_limit_counts_as_not_measured(perfect: Trial) -> None:
    window = perfect.window((0, 1), 50, 100)
    assert window is not None
    last = window.ranges[-1]
    assert perfect.window((0, 1), 50, 100, farthest=last - 1e-6) is None
    near = perfect.window((0, 1), 50, 100, farthest=last)
    assert near is not None
    assert (near.ranges <= last).all()
    assert len(near) == np.sum(window.ranges <= last)


def test_perfect_odometry_has_no_error(perfect: Trial) -> None:
    metres, degrees = experiment.odometry_errors(perfect.recording)
    assert len(metres) == len(PAIRS) * len(POSE_TIMES)
    assert metres.max() < 1e-2
    assert degrees.max() < 1e-6


def test_three_robots_drive_about_sixty_metres_each_inside_the_room(perfect: Trial) -> None:
    for trail in perfect.recording.trails.values():
        step = np.hypot(*np.diff(trail.truth[:, :2], axis=0).T)
        assert step.sum() == pytest.approx(60, rel=0.1)
        assert step.max() <= 0.2 * GRID_S * 1.001
        assert (trail.truth[:, :2] > 0).all()
        assert (trail.truth[:, :2] < [SCENE.width, SCENE.height]).all()


def test_a_heading_error_is_counted_across_the_half_turn() -> None:
    found = np.array([[1.0, 2.0, np.radians(179.0)]])
    truth = np.array([[4.0, 6.0, np.radians(-179.0)]])
    metres, degrees = experiment.pose_errors(found, truth)
    assert metres == pytest.approx([5.0])
    assert degrees == pytest.approx([2.0])


def test_true_pairs_are_poses_of_the_second_in_the_first(perfect: Trial) -> None:
    truth = perfect.true_pairs(0, 1)
    joined = metrics.compose(perfect.truth[0], truth)
    assert joined[:, :2] == pytest.approx(perfect.truth[1][:, :2])


@pytest.mark.slow
def test_odometry_alone_is_as_wrong_as_the_papers_over_twenty_seeds() -> None:
    errors = [experiment.odometry_errors(experiment.trial(seed).recording) for seed in range(20)]
    metres = np.concatenate([e[0] for e in errors]).mean()
    degrees = np.concatenate([e[1] for e in errors]).mean()
    assert metres == pytest.approx(0.85, rel=0.15)
    assert degrees == pytest.approx(8.99, rel=0.15)
