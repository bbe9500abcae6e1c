"""How the uncertainty of dead reckoning grows, against thousands of noisy drives."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from slam_scenes import NOISE, Array, wander

from drslamd.slam import se2
from drslamd.slam.odometry.gyro_noise import OPEN, GyroNoise
from drslamd.slam.odometry.noise import (
    ACROSS,
    OTHER_PATH_M,
    OTHER_S,
    PATH,
    WHEELS,
    OdometryNoise,
    by_yaw_rate,
    covariance_between,
    growth,
    link_covariance,
    seen_from,
    step_sums,
)
from drslamd.slam.odometry.noise import (
    GYRO as BY_TIME,
)

QUIET = OdometryNoise(1e-12, 1e-12, 1e-12, 1e-12)
PARTS = {
    "scale": replace(QUIET, scale=0.03),
    "yaw": replace(QUIET, yaw_rad_per_m=math.radians(0.15)),
    "random translation": replace(QUIET, translation_per_sqrt_m=0.01),
    "random yaw": replace(QUIET, yaw_rad_per_sqrt_m=math.radians(0.5)),
    "everything": NOISE,
}
GYRO = GyroNoise(math.radians(0.4), math.radians(0.3), 0)
BY_GYRO = {
    "random yaw of a gyro": replace(QUIET, gyro=replace(GYRO, yaw_rad_per_s=1e-12)),
    "rate of a gyro": replace(QUIET, gyro=replace(GYRO, yaw_rad_per_sqrt_s=1e-12)),
    "a gyro and wheels": replace(NOISE, gyro=GYRO),
}
SECONDS = 0.5
"""Of each step."""


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
    rate = rng.normal(0, noise.gyro.yaw_rad_per_s if noise.gyro else 1.0, drives)
    wrong = np.tile(path[i], (drives, 1))
    for m in range(i, k):
        root = math.sqrt(length[m])
        if noise.gyro:
            sigma = noise.gyro.yaw_rad_per_sqrt_s * math.sqrt(SECONDS)
            turn = rate * SECONDS + rng.normal(0, sigma, drives)
        else:
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


@pytest.mark.parametrize("part", [*PARTS, *BY_GYRO])
def test_the_growth_of_uncertainty_is_that_of_noisy_drives(part: str) -> None:
    noise = (PARTS | BY_GYRO)[part]
    rng = np.random.default_rng(7)
    path = wander(rng, 200, 0.1)
    seconds = np.full(199, SECONDS) if noise.gyro else None
    poses, sums = path, growth(path, seconds)
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
    assert np.array_equal(growth(np.ones((1, 3))), np.zeros((1, 13)))


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


def under_gyro(way: Array) -> tuple[Array, Array]:
    """(3, 3) of a way (k, 2) from the origin under a gyro that errs by nothing, and what random
    translation along each step, and `ACROSS` of it across, adds up to in x and y (2, 2)."""
    noise = replace(QUIET, translation_per_sqrt_m=0.01, gyro=GyroNoise(1e-12, 1e-12, 0))
    steps = np.diff(way, axis=0)
    sums = step_sums(steps, (way[1:] + way[:-1]) / 2, np.ones(len(steps))).sum(axis=0)
    link = np.array([[*way[-1], 0.0]])
    length = np.hypot(*steps.T)
    along = steps / length[:, None]
    across = along[:, ::-1] * [-1, 1]
    expected = 1e-4 * (
        np.einsum("k,ki,kj->ij", length, along, along)
        + ACROSS**2 * np.einsum("k,ki,kj->ij", length, across, across)
    )
    backwards = link_covariance(noise, link, -sums[None])[0]
    assert np.allclose(backwards, link_covariance(noise, link, sums[None])[0], atol=1e-18)
    return backwards, expected


def arc(angle: float, metres: float = 2.0) -> Array:
    """(k, 2) of a circle, and turned by 0.6 rad."""
    s = np.linspace(0, angle, 400)
    way = np.stack([np.sin(s), 1 - np.cos(s)], axis=-1) / angle * metres
    return np.asarray(se2.rotate(0.6, way))


@pytest.mark.parametrize("angle", [1e-3, 0.5, 1.0])
def test_under_a_gyro_a_robot_slips_along_its_way_and_little_across(angle: float) -> None:
    found, expected = under_gyro(arc(angle))
    # nothing is taken away along the chord, where an arc has a little less
    chord = arc(angle)[-1] / np.hypot(*arc(angle)[-1])
    side = chord[::-1] * [-1, 1]
    assert side @ found[:2, :2] @ side == pytest.approx(side @ expected @ side, rel=0.05)
    assert chord @ found[:2, :2] @ chord == pytest.approx(2e-4, rel=1e-6)
    assert np.linalg.eigvalsh(found[:2, :2] - expected)[0] > -0.05 * side @ expected @ side


@pytest.mark.parametrize(("share", "is_held"), [(0.49, False), (0.51, True)])
def test_of_a_way_that_leads_back_nothing_is_taken_away(share: float, is_held: bool) -> None:
    """Driven a metre there and back, and so far away in the end."""
    ends = np.array([0, (1 + share) / 2, share])
    found, _ = under_gyro(np.stack([ends, 0 * ends], axis=-1))
    assert found[0, 0] == pytest.approx(1e-4)
    assert (found[1, 1] < 0.999e-4) == is_held


def test_the_wheels_own_heading_leaves_a_way_as_uncertain_across_as_along() -> None:
    noise = replace(QUIET, translation_per_sqrt_m=0.01)
    way = np.array([[1.2, 1.6, 0.0]])
    found = link_covariance(noise, way, step_sums(way[:, :2], way[:, :2] / 2))
    assert np.allclose(found[0, :2, :2], 2e-4 * np.eye(2), atol=1e-12)


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
    def noise(value: float) -> OdometryNoise:
        changed: dict[str, Any] = {name: value}
        return replace(NOISE, **changed)

    assert noise(most).is_plausible()
    assert not noise(1.002 * most).is_plausible()
    assert not noise(0.0).is_plausible()
    assert not noise(math.nan).is_plausible()


def test_where_a_gyro_gave_the_heading_the_path_adds_to_translation_only() -> None:
    path = wander(np.random.default_rng(11), 21, 0.3)
    seconds = np.where(np.arange(20) < 8, 0.0, 0.7)
    whole, by_wheels = growth(path, seconds), growth(path[:9])
    assert whole[-1, WHEELS] == pytest.approx(by_wheels[-1, WHEELS])
    assert whole[-1, PATH] == pytest.approx(growth(path)[-1, PATH])
    assert whole[-1, BY_TIME.start] == pytest.approx(12 * 0.7)


def test_sums_of_a_gyro_are_seen_from_elsewhere_as_those_of_wheels_are() -> None:
    path, a_T_b = wander(np.random.default_rng(12), 30, 0.3), np.array([2.0, -3.0, 0.8])
    moved = se2.compose(a_T_b, path)
    seconds = np.linspace(0, 1, 29)
    there = seen_from(growth(path, seconds)[-1:], a_T_b[None])
    assert there[0] == pytest.approx(growth(moved, seconds)[-1])


def test_a_pose_moves_with_the_rate_that_is_learned() -> None:
    """Driven anew with a rate of the gyro, or of the wheels where those give the heading."""
    path = wander(np.random.default_rng(13), 30, 0.3)
    path = se2.between(path[0], path)
    step, seconds, small = se2.between(path[:-1], path[1:]), np.linspace(0.2, 1, 29), 1e-6
    length = np.hypot(step[:, 0], step[:, 1])
    for noise, by, along in (
        (replace(NOISE, gyro=GYRO), seconds, growth(path, seconds)),
        (NOISE, length, growth(path)),
    ):
        end = np.zeros(3)
        for part, turn in zip(step, small * by, strict=True):
            half = np.array([0.0, 0.0, turn / 2])
            for move in (half, part, half):
                end = se2.compose(end, move)
        moves = by_yaw_rate(along[-1:], path[-1:, :2], noise)[0]
        assert (end - path[-1]) / small == pytest.approx(moves, rel=0.02, abs=0.05)


def test_of_two_yaw_rates_the_one_that_is_not_learned_counts_as_random() -> None:
    used = replace(NOISE, gyro=GYRO).random_part()
    assert used.gyro == replace(GYRO, yaw_rad_per_s=0.0)
    assert (used.scale, used.yaw_rad_per_m) == (0.0, 0.0)
    by_path = NOISE.yaw_rad_per_sqrt_m**2 + NOISE.yaw_rad_per_m**2 * OTHER_PATH_M
    assert used.yaw_rad_per_sqrt_m**2 == pytest.approx(by_path)
    gone = replace(NOISE, gyro=replace(GYRO, until=7)).random_part()
    assert gone.gyro is not None
    assert gone.yaw_rad_per_sqrt_m == NOISE.yaw_rad_per_sqrt_m
    by_time = GYRO.yaw_rad_per_sqrt_s**2 + GYRO.yaw_rad_per_s**2 * OTHER_S
    assert gone.gyro.yaw_rad_per_sqrt_s**2 == pytest.approx(by_time)


def test_a_gyro_that_no_source_may_state_makes_noise_implausible() -> None:
    assert replace(NOISE, gyro=GYRO).is_plausible()
    assert not replace(NOISE, gyro=replace(GYRO, yaw_rad_per_s=0.0)).is_plausible()
    assert replace(NOISE, gyro=GYRO).learns_gyro
    assert not replace(NOISE, gyro=replace(GYRO, until=OPEN - 1)).learns_gyro
    assert not NOISE.learns_gyro
