"""How robots lie to each other where what they have in common is exact."""

from __future__ import annotations

import numpy as np
import pytest
from passing_scene import SENSORS
from slam_scenes import NOISE, angle_between, inverted, matrix, product

from drslamd.slam.graph.tables import KeyframeTable
from drslamd.slam.points.joining import MAX_SIGMA_M, Common, Joined, joined
from drslamd.slam.se2 import Array

A_T_B = np.array([3.0, -2.0, 2.5])
THINGS = np.array([[4.0, 1.0], [-2.0, 5.0]])


def keyframes(*n: int) -> KeyframeTable:
    """It drives 1 m along its x from one to the next."""
    return KeyframeTable(np.array([[k, 0, x, 0.0, 0.0] for x, k in enumerate(n)], dtype=float))


def common(count: int, sigma: float = 0.05, moved: float = 0.0) -> Common:
    """Things seen by both, one of them moved between."""
    b_T_a = np.linalg.inv(matrix(A_T_B))
    there = np.array([(b_T_a @ [*thing, 1.0])[:2] for thing in THINGS[:count]])
    there[0] += moved
    spread = np.tile(sigma**2 * np.eye(2), (count, 1, 1))
    none = np.zeros(0)
    return Common(
        THINGS[:count], there, spread, spread, none, none, np.zeros((2, 0, 3)), np.zeros((2, 0))
    )


def found(given: Common) -> Joined | str:
    return joined(given, (NOISE, NOISE), (keyframes(5, 15), keyframes(7, 17)), SENSORS)


def test_two_places_determine_a_pose_and_how_sure_it_is() -> None:
    answer = found(common(2))
    assert isinstance(answer, Joined)
    assert answer.a_T_b[:2] == pytest.approx(A_T_B[:2], abs=1e-6)
    assert angle_between(answer.a_T_b[2], A_T_B[2]) == pytest.approx(0.0, abs=1e-6)
    apart = np.hypot(*(THINGS[1] - THINGS[0]))
    assert np.sqrt(answer.covariance[2, 2]) == pytest.approx(0.05 * np.sqrt(2 * 2) / apart)
    assert (answer.a_n, answer.b_n) == (15, 17)


def test_places_that_are_vague_say_nothing() -> None:
    assert found(common(2, sigma=2 * MAX_SIGMA_M)) == "not enough motion"


def test_what_was_moved_between_does_not_fit() -> None:
    assert found(common(2, moved=1.5)) == "they do not fit each other"


def test_an_answer_says_what_it_means_for_earlier_keyframes() -> None:
    answer = found(common(2))
    assert isinstance(answer, Joined)
    before = answer._replace(a=keyframes(5), b=keyframes(7))
    step = np.array([-1.0, 0.0, 0.0])
    expected: Array = product(inverted(step), A_T_B, step)
    assert answer.earlier(before)[:2] == pytest.approx(expected[:2])
    gone = answer._replace(a=keyframes(3), b=keyframes(7))
    assert answer.earlier(gone) == pytest.approx(answer.a_T_b)
