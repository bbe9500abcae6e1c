"""The noise of a window, against the residuals of many noisy windows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, Array, seen_from_last, wander
from window_scenes import noise_of

from drslamd.slam import se2
from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.range_model import LINKTRACK, RangeNoise
from drslamd.slam.relative_pose.window import NO_GYRO, Window
from drslamd.slam.relative_pose.window_noise import (
    gyro_seconds,
    moments,
    odometry_covariance,
    way_twists,
)
from drslamd.slam.relative_pose.window_stack import WindowStack

QUIET = OdometryNoise(1e-12, 1e-12, 1e-12, 1e-12)
BOTH = np.zeros(2, dtype=np.int64)
"""Two poses of the only window."""
ANTENNA = 0.03
"""m; of each robot, by x and y, see `RangeModel.antenna_sigma_m`."""
PARTS = {
    "scale": replace(QUIET, scale=0.03),
    "yaw": replace(QUIET, yaw_rad_per_m=math.radians(0.15)),
    "random translation": replace(QUIET, translation_per_sqrt_m=0.01),
    "random yaw": replace(QUIET, yaw_rad_per_sqrt_m=math.radians(0.5)),
    "everything": NOISE,
}


def from_lower(lower: Array) -> Array:
    """The whole of a symmetric matrix."""
    return np.asarray(np.tril(lower) + np.tril(lower, -1).T)


def of_one_robot(
    points: Array,
    path: Array,
    directions: Array,
    noise: OdometryNoise,
    before: int,
    antenna_sigma: float = 0.0,
    seconds: Array | None = None,
) -> Array:
    moment = moments(points @ [1, 1j], directions @ [1, 1j])
    split = np.array([before])
    twist = way_twists(path[None], [noise], split, antenna_sigma, seconds)
    return from_lower(odometry_covariance(twist[None], moment[None, None], split)[0])


def noisy_windows(
    rng: np.random.Generator,
    path: Array,
    noise: OdometryNoise,
    drives: int,
    reference: int,
    seconds: float = 0.0,
) -> Array:
    """(drives, n, 3) a path as noisy odometry has it, each seen from its own pose `reference`."""
    step = se2.between(path[:-1], path[1:])
    length = np.hypot(step[:, 0], step[:, 1])
    scale = 1 + rng.normal(0, noise.scale, drives)
    bend = rng.normal(0, noise.yaw_rad_per_m, drives)
    rate = rng.normal(0, noise.gyro.yaw_rad_per_s if noise.gyro else 1.0, drives)
    poses = [np.zeros((drives, 3))]
    for m in range(len(step)):
        root = math.sqrt(length[m])
        turn = bend * length[m] + rng.normal(0, noise.yaw_rad_per_sqrt_m * root, drives)
        if noise.gyro:
            sigma = noise.gyro.yaw_rad_per_sqrt_s * math.sqrt(seconds)
            turn = rate * seconds + rng.normal(0, sigma, drives)
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
    predicted = of_one_robot(points, true, directions, noise, reference + 1)
    sigma = np.sqrt(np.diag(predicted) + 1e-6)  # of less than a millimetre nothing is claimed
    assert np.abs((seen - predicted) / np.outer(sigma, sigma)).max() < 0.13
    assert sigma[0] > 2 * sigma[reference - 4]


@pytest.mark.parametrize("reference", [39, 30])
def test_where_a_gyro_gives_the_heading_residuals_are_as_wrong_as_its_time(reference: int) -> None:
    rng, drives, each = np.random.default_rng(21), 6000, 0.8
    noise = replace(NOISE, gyro=GyroNoise(math.radians(0.4), math.radians(0.2), 0))
    path = wander(rng, 40, 0.25)
    true = se2.between(path[reference], path)
    points, seconds = true[:, :2], np.full((1, 40), each)
    seconds[0, reference if reference < 39 else -1] = 0.0  # between the measurement and itself
    directions = np.tile([0.6, 0.8], (40, 1))
    wrong = noisy_windows(rng, path, noise, drives, reference, each)[..., :2]
    residuals = -np.sum((wrong - points) * directions, axis=2)
    seen = residuals.T @ residuals / drives
    predicted = of_one_robot(points, true, directions, noise, reference + 1, seconds=seconds)
    sigma = np.sqrt(np.diag(predicted) + 1e-6)
    assert np.abs((seen - predicted) / np.outer(sigma, sigma)).max() < 0.13


def test_seconds_under_a_gyro_are_those_of_the_window_that_lie_in_its_span() -> None:
    """From 2 s before to 1 s after the reference; b has no gyro."""
    t = np.array([-3.0, -2.0, -1.5, 0.5, 1.5])
    ahead = np.stack([t, 0 * t, 0 * t], axis=-1)
    window = Window(t, t + 9, ahead, ahead, np.zeros(2), np.zeros(2), a_gyro=(-2.0, 1.0))
    assert gyro_seconds(WindowStack.of([window])).tolist() == [[0.0, 0.5, 1.5, 0.5, 0.0], [0.0] * 5]


def test_windows_of_several_lengths_have_the_seconds_that_each_has_alone() -> None:
    rng = np.random.default_rng(23)
    windows = []
    for count, span in ((9, (-3.0, 0.4)), (5, NO_GYRO), (7, (-1.0, math.inf))):
        t = np.linspace(-4.0, 1.0, count)
        path = wander(rng, count, 0.3)
        windows.append(Window(t, t + 9, path, path, np.zeros(2), np.zeros(2), b_gyro=span))
    together = gyro_seconds(WindowStack.of(windows)).reshape(2, 3, 9)
    for k, window in enumerate(windows):
        alone = gyro_seconds(WindowStack.of([window])).reshape(2, -1)
        assert together[:, k, : len(window)] == pytest.approx(alone)


def test_the_measurement_at_the_reference_time_is_not_touched_by_odometry() -> None:
    path = seen_from_last(wander(np.random.default_rng(12), 20, 0.25))
    directions = np.tile([0.6, 0.8], (20, 1))
    covariance = of_one_robot(path[:, :2], path, directions, NOISE, 20)
    assert np.abs(covariance[-1]).max() < 1e-15


def test_one_measurement_has_no_odometry_in_it() -> None:
    one = np.zeros((1, 2))
    still = np.zeros((1, 3))
    assert of_one_robot(one, still, np.array([[1.0, 0.0]]), NOISE, 1).tolist() == [[0.0]]


@pytest.mark.parametrize("reference", [39, 30])
def test_an_antenna_that_is_beside_its_place_moves_all_ranges_by_where_it_is_then(
    reference: int,
) -> None:
    """Drawn 4 cm beside it in many windows: the error turns with the robot."""
    rng = np.random.default_rng(17)
    path = wander(rng, 40, 0.25)
    true = se2.between(path[reference], path)
    directions = rng.normal(size=(40, 2))
    directions /= np.hypot(*directions.T)[:, None]
    beside = rng.normal(0, 0.04, (20_000, 2))
    cos, sin = np.cos(true[:, 2]), np.sin(true[:, 2])
    moved_x = beside[:, :1] * cos - beside[:, 1:] * sin
    moved_y = beside[:, :1] * sin + beside[:, 1:] * cos
    residuals = moved_x * directions[:, 0] + moved_y * directions[:, 1]
    seen = residuals.T @ residuals / len(residuals)
    found = of_one_robot(true[:, :2], true, directions, QUIET, reference + 1, 0.04)
    assert np.abs(found - seen).max() < 0.04 * 0.04**2
    assert np.allclose(np.diag(found), 0.04**2)
    assert of_one_robot(true[:, :2], true, directions, QUIET, reference + 1).max() < 1e-12


def drive(reference: int) -> tuple[Window, Array, Array]:
    """A window of 40 measurements, and the antennas of both robots (complex)."""
    rng = np.random.default_rng(14)
    a, b = (wander(rng, 40, 0.25) for _ in range(2))
    a, b = se2.between(a[reference], a), se2.between(b[reference], b)
    t = 0.5 * (np.arange(40.0) - reference)
    antennas = np.array([0.15, -0.1]), np.array([-0.2, 0.3])
    window = Window(t, np.full(40, 50.0), a, b, *antennas)
    return window, window.a_points, window.b_points


@pytest.mark.parametrize("reference", [39, 30, 0])
def test_the_noise_of_a_window_is_that_of_its_ranges_and_both_robots(reference: int) -> None:
    window, a, b = drive(reference)
    ranges, of_b = RangeNoise(0.1, 0.3), replace(NOISE, scale=0.06)
    heading = np.array([0.7, -2.0])
    u = np.exp(1j * np.random.default_rng(15).uniform(-0.5, 0.5, (2, 40)))
    covariance = noise_of(window, ranges, NOISE, of_b).covariance(
        BOTH, u, np.exp(1j * heading), np.ones((2, 40))
    )
    for k in range(2):
        in_a = np.stack([u[k].real, u[k].imag], axis=-1)
        in_b = se2.rotate(-heading[k], in_a)
        expected = (
            LINKTRACK.covariance(window.t, window.ranges, 0.1, 0.3)
            + of_one_robot(a, window.a_poses, in_a, NOISE, reference + 1, ANTENNA)
            + of_one_robot(b, window.b_poses, in_b, of_b, reference + 1, ANTENNA)
        )
        assert np.allclose(from_lower(covariance[k]), expected, rtol=0, atol=1e-12)
        assert np.linalg.eigvalsh(expected)[0] > 0


def test_an_outlier_that_weighs_a_quarter_is_twice_as_uncertain() -> None:
    window, _, _ = drive(39)
    noise = noise_of(window, RangeNoise(0.1, 0.3), QUIET, QUIET)
    weights = np.ones((2, 40))
    weights[1, 7] = 0.25
    plain, thinned = noise.covariance(BOTH, np.ones((2, 40)) + 0j, np.ones(2) + 0j, weights)
    assert plain[7, 7] == pytest.approx(0.1**2 + 0.3**2 + 2 * ANTENNA**2)
    assert thinned[7, 7] == pytest.approx(0.2**2 + 0.3**2 + 2 * ANTENNA**2)
    assert np.count_nonzero(np.tril(thinned - plain)) == 1


@pytest.mark.parametrize(
    ("said_so", "truly"),
    [
        (RangeNoise(0.1, 0.3, 0.6), RangeNoise(0.06, 0.3)),
        (RangeNoise(0.1, 0.3, 1.5), RangeNoise(0.15, 0.3)),
        (RangeNoise(0.1, 0.3, bias_beyond=0.4), RangeNoise(0.1, 0.5)),
        (RangeNoise(0.1, 0.05, 1.5, bias_beyond=0.12), RangeNoise(0.15, 0.13)),
    ],
)
def test_what_follows_ranges_is_as_wrong_as_they_scatter_and_as_their_bias(
    said_so: RangeNoise, truly: RangeNoise
) -> None:
    window, _, _ = drive(30)
    said, true = (noise_of(window, ranges, NOISE, NOISE) for ranges in (said_so, truly))
    rng = np.random.default_rng(16)
    u, heading, ones = np.exp(1j * rng.uniform(size=(2, 40))), np.ones(2) + 0j, np.ones((2, 40))
    gain = rng.normal(size=(2, 3, 40))
    for k, excess in enumerate(said.excess(BOTH, gain)):
        covariances = [from_lower(n.covariance(BOTH, u, heading, ones)[k]) for n in (said, true)]
        wrong, right = (gain[k] @ c @ gain[k].T for c in covariances)
        assert np.allclose(wrong + excess, right, rtol=0, atol=1e-9)
        assert np.abs(excess).max() > 0.01
