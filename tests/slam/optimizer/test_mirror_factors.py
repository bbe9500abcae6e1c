"""Factors of a robot whose odometry is the mirror image of its way, against those of its twin whose
wheels are right: by the same errors at the same poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_problems import straight_by_turn, straight_by_yaw
from slam_scenes import Array

from drslamd.slam.optimizer.factor_errors import corrected, range_errors
from drslamd.slam.optimizer.mirror_factors import (
    mirrored_between,
    mirrored_odometry,
    mirrored_ranges,
)
from drslamd.slam.optimizer.problem import (
    BetweenFactors,
    CarriedEnds,
    OdometryFactors,
    RangeFactors,
)
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.range_model import LINKTRACK

FLIP = np.diag([1.0, -1.0, -1.0])
RNG = np.random.default_rng(7)
ANTENNA = np.array([0.3, 0.12])


def covariances(count: int) -> Array:
    root = RNG.normal(size=(count, 3, 3))
    return root @ np.swapaxes(root, 1, 2)


def test_the_covariance_of_what_was_measured_is_mirrored_with_it() -> None:
    at, measured, spread = np.arange(3), RNG.normal(size=(3, 3)), covariances(3)
    found = mirrored_between(
        BetweenFactors(at, at + 1, measured, spread), np.array([True, False, True])
    )
    for k, is_odd in enumerate((True, False, True)):
        flip = FLIP if is_odd else np.eye(3)
        assert np.allclose(found.measured[k], flip @ measured[k])
        assert np.allclose(found.covariance[k], flip @ spread[k] @ flip)


def test_what_is_learned_of_odometry_moves_the_mirror_image_as_it_moves_any_way() -> None:
    """Links of one robot beside the mirror images of the same links of another."""
    at, links = np.zeros(20, dtype=int), RNG.normal(0, [0.4, 0.1, 0.2], (20, 3))
    spread = covariances(20)
    parts = (at, at, links, spread, at, straight_by_yaw(links), straight_by_turn(links))
    right = OdometryFactors(*parts)
    told = links @ FLIP
    odd = replace(
        right,
        measured=told,
        covariance=FLIP @ spread @ FLIP,
        by_yaw=straight_by_yaw(told),
        by_turn=straight_by_turn(told),
    )
    found = mirrored_odometry(odd, np.ones(20, dtype=bool))
    assert np.allclose(found.covariance, spread)
    known = Calibration.zero(0, 1)
    known.scale[0], known.yaw[0], known.turn[0] = 0.1, 0.03, 0.2
    assert corrected(found, known) == pytest.approx(corrected(right, known))


@pytest.mark.parametrize("end", [0, 1])
def test_a_range_is_to_the_antenna_where_it_is_whichever_way_wheels_turn(end: int) -> None:
    """Bodies 1 m beside their keyframes, turned; the antenna is off the axle. The robot's odometry
    has a body on the other side of its keyframe, turned the other way."""
    moves = RNG.normal(0, 0.3, (1, 2, 2, 2))
    body, turn = np.array([0.8, 0.6]), 0.7

    def ranges(sign: float) -> RangeFactors:
        cos, sin = np.cos(sign * turn), np.sin(sign * turn)
        q = body * [1, sign] + np.array([[cos, -sin], [sin, cos]]) @ ANTENNA
        other = np.array([0.2, -0.1])
        ends, turned, moved = [other, other], [0.1, 0.1], moves.copy()
        ends[end], turned[end] = q, sign * turn
        if sign < 0:
            # (by the yaw rate, then by the scale)
            moved[0, end] = moved[0, end] @ np.diag([1, -1])
            moved[0, end, 0] *= -1
        return RangeFactors(
            i=np.array([0]),
            j=np.array([1]),
            q_i=ends[0][None],
            q_j=ends[1][None],
            measured=np.array([5.0]),
            sigma=np.array([0.1]),
            pair=np.array([0]),
            robots=np.array([[0, 1]]),
            turned=np.array([turned]),
            carried=CarriedEnds(np.array([0]), moved),
        )

    poses = np.array([[1.0, 2.0, 0.4], [5.0, -1.0, 2.0]])
    known = Calibration.zero(1, 2)
    known.scale[:], known.yaw[:], known.antenna[:] = 0.1, 0.2, [0.05, -0.1]
    right = range_errors(poses, ranges(1.0), known, LINKTRACK).error
    found = mirrored_ranges(ranges(-1.0), end, ANTENNA)
    assert range_errors(poses, found, known, LINKTRACK).error == pytest.approx(right)
    assert range_errors(poses, ranges(-1.0), known, LINKTRACK).error != pytest.approx(right)
