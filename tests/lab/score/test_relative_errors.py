"""Errors of relative poses, on outcomes whose errors are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lab.recordings.recording import Array, Recording, Trail
from lab.score import metrics, relative_errors
from lab.score.outcome import Closure, Outcome, Path

T = np.arange(0, 20, 0.1)


def straight(robot: int, y: float, speed: float) -> Trail:
    truth = np.column_stack([speed * T, np.full(len(T), y), np.zeros(len(T))])
    return Trail(robot, T, truth - truth[0], truth)


RECORDING = Recording(
    "made", {0: straight(0, 0.0, 0.2), 1: straight(1, 3.0, 0.01)}, np.empty((0, 4))
)


def closure(t: float, off: Array, sigma: float, verdict: str = "unique") -> Closure:
    true = relative_errors.true_relative(RECORDING, 0, 1, np.array([t]))[0]
    return Closure(t, 0, 1, verdict, (true + off)[None], sigma**2 * np.eye(3)[None], True)


def test_windows_are_scored_where_module_1_named_one_pose() -> None:
    off = np.array([0.3, 0.4, math.radians(5)])
    found = relative_errors.of_windows(
        RECORDING,
        Outcome(closures=[closure(5.0, off, 0.1), closure(6.0, 9 * off, 0.1, "ambiguous")]),
    )
    assert found.median == pytest.approx((0.5, 5.0))


def test_squared_errors_are_those_of_the_claimed_covariance() -> None:
    off = np.array([0.3, 0.4, 0.0])
    value = relative_errors.squared_mahalanobis(RECORDING, closure(5.0, off, 0.1))
    assert value == pytest.approx(25.0)


def test_published_poses_are_compared_at_one_time_whenever_they_were_published() -> None:
    """Both in a frame that is turned and shifted; robot 1 publishes 0.7 s later."""
    frame = np.array([[1.0, -2.0, 0.5]])
    live = {}
    for robot, when in ((0, np.array([4.0, 5.0])), (1, np.array([4.7, 5.7]))):
        trail = RECORDING.trails[robot]
        poses = metrics.compose(frame, metrics.at_times(trail.t, trail.truth, when))
        live[robot] = Path(when, poses, np.zeros(2))
    found = relative_errors.published(RECORDING, Outcome(live=live))
    assert len(found.t) == 2
    assert found.metres == pytest.approx(0.0, abs=1e-9)
    live[1] = Path(live[1].t, live[1].poses, np.ones(2))
    assert not len(relative_errors.published(RECORDING, Outcome(live=live)).t)


def test_a_robot_below_five_centimetres_a_second_stands() -> None:
    when = np.array([5.0, 6.0])
    assert relative_errors.moving(RECORDING.trails[0], when).all()
    assert not relative_errors.moving(RECORDING.trails[1], when).any()


def test_of_nothing_found_the_median_is_infinite() -> None:
    nothing = relative_errors.of_windows(RECORDING, Outcome())
    assert nothing.median == (math.inf, math.inf)
