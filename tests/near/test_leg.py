"""A way step by step is what `pose_now` makes of it at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, wander

from drslamd.near.leg import Leg
from drslamd.near.packed import added_up, moved
from drslamd.slam import se2
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.pose_now import carried

START = np.array([5.0, -3.0, 2.0])
WAY = wander(np.random.default_rng(2), 60, 0.05)
KNOWN = np.array([[0.04, 0.01, 0.004], [0.01, 0.09, -0.006], [0.004, -0.006, 0.0025]])


@pytest.mark.parametrize("correction", [Correction(), Correction(0.03, 0.02, -0.1)])
def test_it_ends_where_the_corrected_way_leads_as_uncertain_as_that(
    correction: Correction,
) -> None:
    leg = Leg(START, NOISE, 2.0, correction)
    leg.along(WAY)
    step = se2.between(WAY[:1], correction.path(WAY))
    end = se2.compose(START, step[-1])
    assert np.allclose(leg.end[:2], end[:2], atol=1e-9)
    assert abs(float(se2.wrap(leg.end[2] - end[2]))) < 1e-9
    found = added_up(moved(se2.packed(KNOWN), *leg.lever), leg.added)
    assert np.allclose(found, se2.packed(carried(KNOWN, 2.0, step, NOISE, 2.0)), atol=1e-12)


def test_where_a_gyro_gives_the_heading_the_way_is_as_uncertain_as_its_time() -> None:
    gyro = GyroNoise(0.01, 0.002, 100)
    noise = replace(NOISE, yaw_rad_per_sqrt_m=0.0, yaw_rad_per_m=0.0, gyro=gyro)
    way = np.concatenate([WAY, WAY[-1:], WAY[-1:]])  # in the end it stands
    leg = Leg(START, noise, 2.0, Correction())
    leg.along(way)
    step = se2.between(way[:1], way)
    expected = carried(np.zeros((3, 3)), 2.0, step, noise, 2.0, 100)
    assert np.allclose(leg.added, se2.packed(expected), atol=1e-12)
    # on a way without samples its steps say how long they took
    one = Leg(START, noise, 1.0, Correction())
    one.go((0.0, 0.0, 0.0), (0.0, 0.0, 0.5), 2.5)
    assert one.added[5] == pytest.approx(0.01**2 * 2.5 + (0.002 * 2.5) ** 2)


def test_who_did_not_go_is_where_it_was_and_as_sure() -> None:
    leg = Leg(START, NOISE, 1.0, Correction())
    assert leg.end == tuple(START)
    assert leg.lever == (0.0, 0.0)
    assert leg.added == (0.0,) * 6
