"""One robot of a pair: heights of antennas, and the way from a body to its keyframe."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, model_of

from drslamd.conventions import Chain
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.odometry.gyro_noise import OPEN, GyroNoise
from drslamd.slam.odometry.track import Track
from drslamd.slam.relative_pose.pair_end import Anchor, PairEnd, at_keyframes, level
from drslamd.slam.relative_pose.window import NO_GYRO


@pytest.mark.parametrize(
    ("measured", "from_above"),
    [(5.0, 4.0), (3.0001, math.sqrt(3.0001**2 - 9)), (2.9, 2.9), (-0.3, -0.3)],
)
def test_ranges_between_antennas_of_different_heights_are_seen_from_above(
    measured: float, from_above: float
) -> None:
    low, high = model_of(NOISE, height=0.5), model_of(NOISE, height=3.5)
    for a, b in ((low, high), (high, low)):
        assert level(np.array([measured]), a, b)[0] == pytest.approx(from_above)
    assert level(np.array([measured]), low, low)[0] == pytest.approx(measured)


def matrix(pose: tuple[float, float, float]) -> np.ndarray:
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])


A = (0.4, -0.3, 2.8)
B = (-0.2, 0.5, -2.9)
MEASURED = (3.0, 1.0, 1.2)


@pytest.mark.row("M4")
def test_a_pose_of_bodies_becomes_one_of_keyframes() -> None:
    """keyframe a to body a, to body b, and back to keyframe b."""
    ends = (Anchor(1, 0, np.array(A)), Anchor(2, 0, np.array(B)))
    found, _ = at_keyframes(np.array(MEASURED), np.eye(3), *ends)
    expected = matrix(A) @ matrix(MEASURED) @ np.linalg.inv(matrix(B))
    assert found[:2] == pytest.approx(expected[:2, 2])
    assert matrix((0, 0, found[2]))[:2, :2] == pytest.approx(expected[:2, :2])


@pytest.mark.row("O12")
def test_the_heading_between_keyframes_stays_within_half_a_turn() -> None:
    """Both bodies turned far since their keyframes: 2.8 + 1.2 + 2.9 is more than a whole turn."""
    ends = (Anchor(1, 0, np.array(A)), Anchor(2, 0, np.array(B)))
    found, _ = at_keyframes(np.array(MEASURED), np.eye(3), *ends)
    assert found[2] == pytest.approx(2.8 + 1.2 + 2.9 - 2 * math.pi)


def test_the_covariance_at_keyframes_is_that_of_small_errors_at_the_bodies() -> None:
    ends = (Anchor(1, 0, np.array(A)), Anchor(2, 0, np.array(B)))
    cov = np.array([[0.04, 0.01, 0.0], [0.01, 0.09, 0.02], [0.0, 0.02, 0.01]])
    pose, found = at_keyframes(np.array(MEASURED), cov, *ends)
    steps = []
    for k in range(3):
        moved = np.array(MEASURED)
        moved[k] += 1e-6
        steps.append((at_keyframes(moved, cov, *ends)[0] - pose) / 1e-6)
    jacobian = np.array(steps).T
    assert found == pytest.approx(jacobian @ cov @ jacobian.T, abs=1e-5)


def test_the_span_of_a_gyro_is_told_in_seconds_of_our_clock() -> None:
    """Its clock is 2 s ahead of ours; sample 1000 is 100 s there, 98 s here."""
    data = ChainData(Chain(3, 1))
    end = PairEnd(Track(10), data, ahead_us=2_000_000)
    assert end.gyro_span(90_000_000) == NO_GYRO
    gyro = GyroNoise(0.01, 0.001, 1000, 1205)
    data.take_model(0, model_of(replace(NOISE, gyro=gyro)))
    assert end.gyro_span(90_000_000) == pytest.approx((8.0, 28.5))
    data.take_model(1, model_of(replace(NOISE, gyro=replace(gyro, until=OPEN))))
    assert end.gyro_span(90_000_000)[1] > 1e8
