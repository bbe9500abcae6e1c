"""The noise of a window, against the residuals of many noisy windows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, Array, seen_from_last, wander

from drslamd.slam import se2
from drslamd.slam.odometry import OdometryNoise
from drslamd.slam.window_noise import (
    SLOW_SHARE,
    SLOW_TIME_S,
    RangeNoise,
    near_bias,
    odometry_covariance,
    range_covariance,
)

QUIET = OdometryNoise(1e-12, 1e-12, 1e-12, 1e-12)
PARTS = {
    "scale": replace(QUIET, scale=0.03),
    "yaw": replace(QUIET, yaw_rad_per_m=math.radians(0.15)),
    "random translation": replace(QUIET, translation_per_sqrt_m=0.01),
    "random yaw": replace(QUIET, yaw_rad_per_sqrt_m=math.radians(0.5)),
    "everything": NOISE,
}

FAR = np.full(4, 50.0)
"""Where the bias of short ranges is none."""


def noisy_windows(
    rng: np.random.Generator, path: Array, noise: OdometryNoise, drives: int, reference: int
) -> Array:
    """(drives, n, 3) a path as noisy odometry has it, each seen from its own pose `reference`."""
    step = se2.between(path[:-1], path[1:])
    length = np.hypot(step[:, 0], step[:, 1])
    scale = 1 + rng.normal(0, noise.scale, drives)
    bend = rng.normal(0, noise.yaw_rad_per_m, drives)
    poses = [np.zeros((drives, 3))]
    for m in range(len(step)):
        root = math.sqrt(length[m])
        turn = bend * length[m] + rng.normal(0, noise.yaw_rad_per_sqrt_m * root, drives)
        shift = rng.normal(0, noise.translation_per_sqrt_m * root, (drives, 2))
        nothing = np.zeros(drives)
        half_turn = np.column_stack([nothing, nothing, turn / 2])
        move = np.column_stack([scale[:, None] * step[m, :2] + shift, nothing + step[m, 2]])
        pose = poses[-1]
        for part in (half_turn, move, half_turn):
            pose = se2.compose(pose, part)
        poses.append(pose)
    stack = np.stack(poses, axis=1)
    return se2.between(stack[:, reference, None], stack)


@pytest.mark.parametrize("reference", [39, 30])
@pytest.mark.parametrize("part", PARTS)
def test_what_odometry_does_to_residuals_is_what_noisy_drives_do(part: str, reference: int) -> None:
    noise, rng, drives = PARTS[part], np.random.default_rng(11), 6000
    path = wander(rng, 40, 0.25)
    true = se2.between(path[reference], path)
    antenna = np.array([0.15, -0.1])
    points = se2.transform(true, antenna)
    target = np.array([3.0, 5.0])
    sight = target - points
    directions = sight / np.hypot(*sight.T)[:, None]
    wrong = se2.transform(noisy_windows(rng, path, noise, drives, reference), antenna)
    # first order: the range changes by the error along the line of sight
    residuals = -np.sum((wrong - points) * directions, axis=2)
    seen = residuals.T @ residuals / drives
    predicted = odometry_covariance(points, true[:, :2], directions, noise, reference + 1)
    sigma = np.sqrt(np.diag(predicted) + 1e-6)  # of less than a millimetre nothing is claimed
    assert np.abs((seen - predicted) / np.outer(sigma, sigma)).max() < 0.13
    assert sigma[0] > 2 * sigma[reference - 4]


def test_the_measurement_at_the_reference_time_is_not_touched_by_odometry() -> None:
    path = seen_from_last(wander(np.random.default_rng(12), 20, 0.25))
    directions = np.tile([0.6, 0.8], (20, 1))
    covariance = odometry_covariance(path[:, :2], path[:, :2], directions, NOISE)
    assert np.abs(covariance[-1]).max() < 1e-15


def test_one_measurement_has_no_odometry_in_it() -> None:
    one = np.zeros((1, 2))
    assert odometry_covariance(one, one, np.array([[1.0, 0.0]]), NOISE).tolist() == [[0.0]]


def test_ranges_share_a_bias_and_a_slow_part() -> None:
    noise = RangeNoise(0.1, 0.3)
    t = np.array([-9.0, -8.0, -3.0, 0.0])
    rng, count = np.random.default_rng(13), 200_000
    slow = np.empty((count, 4))
    slow[:, 0] = rng.normal(size=count)
    for k, gap in enumerate(np.diff(t)):
        keep = math.exp(-gap / SLOW_TIME_S)
        slow[:, k + 1] = keep * slow[:, k] + math.sqrt(1 - keep**2) * rng.normal(size=count)
    white = math.sqrt(1 - SLOW_SHARE**2)
    errors = 0.1 * (SLOW_SHARE * slow + white * rng.normal(size=(count, 4)))
    errors += 0.3 * rng.normal(size=(count, 1))
    seen = errors.T @ errors / count
    assert np.allclose(range_covariance(t, FAR, noise, np.ones(4)), seen, atol=1e-3)


def test_an_outlier_that_weighs_a_quarter_is_twice_as_uncertain() -> None:
    noise, t = RangeNoise(0.1, 0.3), np.array([-1.0, 0.0])
    plain = range_covariance(t, FAR[:2], noise, np.ones(2))
    thinned = range_covariance(t, FAR[:2], noise, np.array([1.0, 0.25]))
    assert plain[0, 0] == pytest.approx(0.1**2 + 0.3**2)
    assert np.allclose(thinned - plain, np.diag([0, 3 * 0.1**2]))
    assert thinned[1, 1] == pytest.approx(0.2**2 + 0.3**2)


def test_short_ranges_share_a_bias_of_their_own() -> None:
    """As LinkTrack modules were measured: 0.13 m more at 0.5 m, 0.07 m at 1.5 m, none beyond."""
    assert near_bias(np.array([0.5, 1.5, 8.0])) == pytest.approx([0.14, 0.07, 0.0], abs=0.01)
    assert near_bias(-0.3) == near_bias(0.0)
    t, noise = np.array([-100.0, 0.0]), RangeNoise(0.1, 0.3)
    near = range_covariance(t, np.array([0.5, 1.5]), noise, np.ones(2))
    far = range_covariance(t, FAR[:2], noise, np.ones(2))
    # at one short range as at the other, so their errors add to each other's covariance
    assert near[0, 1] - far[0, 1] == pytest.approx(0.143 * 0.074, abs=1e-3)
    assert near[1, 1] - far[1, 1] == pytest.approx(0.074**2, abs=1e-3)
