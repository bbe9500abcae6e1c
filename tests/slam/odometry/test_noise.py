"""How the uncertainty of dead reckoning grows, against thousands of noisy drives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, Array, wander

from drslamd.slam import se2
from drslamd.slam.odometry.noise import (
    OdometryNoise,
    covariance_between,
    growth,
    link_covariance,
    step_sums,
)

QUIET = OdometryNoise(1e-12, 1e-12, 1e-12, 1e-12)
PARTS = {
    "scale": replace(QUIET, scale=0.03),
    "yaw": replace(QUIET, yaw_rad_per_m=math.radians(0.15)),
    "random translation": replace(QUIET, translation_per_sqrt_m=0.01),
    "random yaw": replace(QUIET, yaw_rad_per_sqrt_m=math.radians(0.5)),
    "everything": NOISE,
}


def noisy_twists(
    rng: np.random.Generator, path: Array, noise: OdometryNoise, i: int, k: int, drives: int
) -> Array:
    """(drives, 3) left twists in frame o between the true and the noisy motion from i to k.

    A brute-force drive: every step of the path by itself, its noise in the middle of the step.
    """
    step = se2.between(path[:-1], path[1:])
    length = np.hypot(step[:, 0], step[:, 1])
    scale = 1 + rng.normal(0, noise.scale, drives)
    bend = rng.normal(0, noise.yaw_rad_per_m, drives)
    wrong = np.tile(path[i], (drives, 1))
    for m in range(i, k):
        root = math.sqrt(length[m])
        turn = bend * length[m] + rng.normal(0, noise.yaw_rad_per_sqrt_m * root, drives)
        shift = rng.normal(0, noise.translation_per_sqrt_m * root, (drives, 2))
        half = np.column_stack([scale[:, None] * step[m, :2] / 2, np.full(drives, step[m, 2] / 2)])
        nudge = np.column_stack([shift, turn])
        for part in (half, nudge):
            wrong = se2.compose(wrong, part)
        # second half of the arc: what is left of the true step after its first half
        rest = se2.between(
            np.array([*step[m, :2] / 2, step[m, 2] / 2]), np.array([*step[m, :2], step[m, 2]])
        )
        wrong = se2.compose(
            wrong, np.column_stack([scale[:, None] * rest[:2], np.full(drives, rest[2])])
        )
    return se2.log(se2.compose(wrong, se2.inverse(path[k])))


@pytest.mark.parametrize("part", PARTS)
def test_the_growth_of_uncertainty_is_that_of_noisy_drives(part: str) -> None:
    noise = PARTS[part]
    rng = np.random.default_rng(7)
    path = wander(rng, 200, 0.1)
    poses, sums = path, growth(path)
    drives = 4000
    for i, k in ((0, 199), (60, 150)):
        predicted = covariance_between(noise, poses, sums, i, k)
        twists = noisy_twists(rng, path, noise, i, k, drives)
        seen = twists.T @ twists / drives
        scale = np.sqrt(np.diag(predicted) + 1e-14)
        # sampling: a variance is known to sqrt(2 / drives) = 2.2 %, four of those and 4 % for
        # what is not linear
        assert np.abs((seen - predicted) / np.outer(scale, scale)).max() < 0.13, (i, k)


def test_it_is_the_same_forwards_and_backwards() -> None:
    rng = np.random.default_rng(8)
    path = wander(rng, 50)
    sums = growth(path)
    one = covariance_between(NOISE, path, sums, np.arange(50), 20)
    other = covariance_between(NOISE, path, sums, 20, np.arange(50))
    assert np.allclose(one, other, atol=1e-18)
    assert np.all(one[20] == 0)


def test_random_parts_add_up_along_the_way() -> None:
    path = wander(np.random.default_rng(9), 80)
    noise, sums = replace(NOISE, scale=0.0, yaw_rad_per_m=0.0), growth(path)
    whole = covariance_between(noise, path, sums, 0, 79)
    parts = [covariance_between(noise, path, sums, *ends) for ends in ((0, 30), (30, 79))]
    assert np.allclose(whole, sum(parts))


def test_a_straight_line_has_a_closed_form() -> None:
    """Along x from the origin, s metres: yaw swings the end by s / 2 each, sideways s^3 / 3."""
    s, count = 8.0, 401
    x = np.linspace(0, s, count)
    path = np.stack([x, 0 * x, 0 * x], axis=-1)
    sums = growth(path)
    shift, turn = NOISE.translation_per_sqrt_m**2, NOISE.yaw_rad_per_sqrt_m**2
    scale, bend = NOISE.scale**2, NOISE.yaw_rad_per_m**2
    expected = np.array(
        [
            [shift * s + scale * s * s, 0, 0],
            [0, shift * s + turn * s**3 / 3 + bend * s**4 / 4, -turn * s**2 / 2 - bend * s**3 / 2],
            [0, -turn * s**2 / 2 - bend * s**3 / 2, turn * s + bend * s * s],
        ]
    )
    assert np.allclose(covariance_between(NOISE, path, sums, 0, count - 1), expected, rtol=1e-5)


def test_a_path_of_one_pose_has_grown_nothing() -> None:
    assert np.array_equal(growth(np.ones((1, 3))), np.zeros((1, 6)))


def test_a_link_alone_is_as_uncertain_as_in_its_chain() -> None:
    rng = np.random.default_rng(10)
    path = wander(rng, 30, 0.4)
    sums = growth(path)
    index = np.arange(29)
    in_chain = covariance_between(NOISE, path, sums, index, index + 1)
    move = se2.adjoint(se2.inverse(path[:-1]))
    expected = move @ in_chain @ np.swapaxes(move, 1, 2)
    link = se2.between(path[:-1], path[1:])
    alone = link_covariance(NOISE, link, step_sums(link[:, :2], link[:, :2] / 2))
    assert np.allclose(alone, expected, atol=1e-12)


def test_a_link_far_from_the_origin_keeps_its_digits() -> None:
    """200 km away, where the sums of a chain are 1e16."""
    far = np.array([[2e5, -2e5, 1.0], [2e5 + 0.3, -2e5 + 0.4, 1.2]])
    near = far - [2e5, -2e5, 0]
    links = (se2.between(p[:1], p[1:]) for p in (far, near))
    one, other = (link_covariance(NOISE, i, step_sums(i[:, :2], i[:, :2] / 2)) for i in links)
    assert np.allclose(one, other, rtol=1e-6)
    assert np.linalg.eigvalsh(one[0])[0] > 0


@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("scale", 0.5),
        ("yaw_rad_per_m", math.radians(20)),
        ("translation_per_sqrt_m", 1.0),
        ("yaw_rad_per_sqrt_m", math.radians(20)),
    ],
)
def test_noise_is_plausible_up_to_what_a_configuration_may_say(name: str, most: float) -> None:
    assert replace(NOISE, **{name: most}).is_plausible()
    assert not replace(NOISE, **{name: 1.002 * most}).is_plausible()
    assert not replace(NOISE, **{name: 0.0}).is_plausible()
    assert not replace(NOISE, **{name: math.nan}).is_plausible()
