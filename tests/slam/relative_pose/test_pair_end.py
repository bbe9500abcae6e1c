"""One robot of a pair: heights of antennas, and the way from a body to its keyframe."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slam_scenes import NOISE, model_of

from drslamd.slam.relative_pose.pair_end import Anchor, at_keyframes, level


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
