"""Tracks without their known errors, against wheels that are simulated with those errors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slam_problems import straight_by_turn, straight_by_yaw
from slam_scenes import Array, inverted, product, same_pose, wander

from drslamd.slam.odometry.correction import Correction
from drslamd.slam.optimizer.factor_errors import corrected
from drslamd.slam.optimizer.problem import OdometryFactors
from drslamd.slam.optimizer.sensor_priors import Calibration


def driven(
    start: Array, speed: Array, rate: Array, scale: float, yaw: float, turn: float, every: int = 100
) -> Array:
    """A drive in tiny steps, as wheels with these errors measure it; its poses are kept rarely.

    Args:
        speed, rate: (k,) true way and turn of each tiny step, m and rad.
        scale: ways are measured as 1 / (1 - scale) of what they are.
        yaw: so many rad are measured for each metre that is measured and were not there.
        turn: turns are measured as 1 / (1 + turn) of what they are, after that.
    """
    x, y, theta = start
    out = [start]
    for k, (way, bend) in enumerate(zip(speed / (1 - scale), rate, strict=True)):
        measured = (bend + yaw * way) / (1 + turn)
        x += way * math.cos(theta + measured / 2)
        y += way * math.sin(theta + measured / 2)
        theta += measured
        if (k + 1) % every == 0:
            out.append(np.array([x, y, theta]))
    return np.array(out)


SPEED = np.full(3000, 0.004)
RATE = 0.001 * np.sin(np.arange(3000) / 400)
START = np.array([3.0, -2.0, 2.5])


@pytest.mark.parametrize(
    ("scale", "yaw", "turn"),
    [(0.1, 0.0, 0.0), (-0.2, 0.0, 0.0), (0.0, 0.05, 0.0), (0.0, 0.0, 0.4), (0.0, 0.0, -0.3)],
)
def test_a_track_becomes_the_way_that_was_driven(scale: float, yaw: float, turn: float) -> None:
    """12 m of curves; half of a step's turn acts over its way, which is true to a centimetre."""
    true = driven(START, SPEED, RATE, 0, 0, 0)
    measured = driven(START, SPEED, RATE, scale, yaw, turn)
    better = Correction(scale, yaw, turn).path(measured)
    assert np.hypot(*(measured - true)[:, :2].T).max() > 0.5
    assert np.hypot(*(better - true)[:, :2].T).max() < 0.01
    # ways are chords there, which are a little shorter
    assert better[:, 2] == pytest.approx(true[:, 2], abs=2e-4)
    assert np.array_equal(better[0], START)


def test_all_errors_together_are_taken_out_too() -> None:
    true = driven(START, SPEED, RATE, 0, 0, 0)
    measured = driven(START, SPEED, RATE, 0.1, 0.02, 0.3)
    # where turns are too short as well, what the yaw rate added was divided by 1.3 with them
    better = Correction(0.1, 0.02, 0.3).path(measured)
    assert np.hypot(*(better - true)[:, :2].T).max() < 0.02


def test_turns_on_the_spot_grow_without_moving() -> None:
    spot = np.column_stack([np.full(5, 1.0), np.full(5, -2.0), [0.1, 1.1, 2.1, 3.1, 4.1]])
    better = Correction(turn=0.5).path(spot)
    assert better[:, :2] == pytest.approx(spot[:, :2])
    assert better[:, 2] == pytest.approx([0.1, 1.6, 3.1, 4.6, 6.1])


def test_a_heading_that_was_wrapped_is_no_turn() -> None:
    """From 3.1 to -3.1 rad it turned by 0.08, and half as much again."""
    poses = np.array([[0.0, 0.0, 3.1], [0.0, 0.0, -3.1]])
    better = Correction(turn=0.5).path(poses)
    assert better[1, 2] == pytest.approx(3.1 + 1.5 * (2 * math.pi - 6.2))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_where_there_is_nothing_to_correct_the_track_is_what_it_was(count: int) -> None:
    poses = wander(np.random.default_rng(1), 2, 0.3)[:count]
    assert Correction().path(poses) is poses
    better = Correction(0.1, 0.02, 0.3).path(poses)
    assert len(better) == count
    assert (better is poses) is (count < 2)


def test_it_is_what_module_3_makes_of_links_to_first_order() -> None:
    """A link of its own is corrected there by the same three constants."""
    rng, one = np.random.default_rng(2), np.zeros(30, dtype=int)
    links = rng.normal(0, [0.4, 0.1, 0.2], (30, 3))
    factors = OdometryFactors(
        one,
        one,
        links,
        np.zeros((30, 3, 3)),
        robot=one,
        by_yaw=straight_by_yaw(links),
        by_turn=straight_by_turn(links),
    )
    small = 1e-4
    for name in ("scale", "yaw", "turn"):
        known = Calibration.zero(0, 1)
        getattr(known, name)[0] = small
        theirs = corrected(factors, known)
        for link, expected in zip(links, theirs, strict=True):
            ours = Correction(**{name: small}).path(np.stack([np.zeros(3), link]))[1]
            assert ours == pytest.approx(expected, abs=2e-8)
            assert np.abs(ours - link).max() > 1e-7


def test_each_piece_of_a_corrected_track_is_the_piece_corrected() -> None:
    """So that what begins anywhere fits to what came before."""
    poses = wander(np.random.default_rng(3), 20, 0.3)
    known = Correction(0.05, 0.01, 0.2)
    whole, rest = known.path(poses)[8:], known.path(poses[8:])
    back_there, back = inverted(whole[0]), inverted(rest[0])
    for there, here in zip(whole, rest, strict=True):
        assert same_pose(product(back_there, there), product(back, here), 1e-9)


@pytest.mark.parametrize(("turn", "is_mirrored"), [(-0.99, False), (-1.01, True)])
def test_who_turns_the_other_way_tells_the_mirror_image(turn: float, is_mirrored: bool) -> None:
    known = Correction(turn=turn)
    assert known.is_mirrored is is_mirrored
    # a turn of 0.5 rad is one of 0.5 (1 + turn), by either of the two
    sign = -1 if is_mirrored else 1
    assert sign * (1 + known.longer) * 0.5 == pytest.approx((1 + turn) * 0.5)


def test_the_mirror_image_is_exact_however_rarely_a_way_was_told() -> None:
    """Sharp bends between two poses, which are no arcs."""
    path = wander(np.random.default_rng(4), 30, 0.8)
    path[:, 2] += np.random.default_rng(5).normal(0, 0.5, 30)
    told = Correction(turn=-2.0).path(path)
    first = inverted(path[0])
    for pose, seen in zip(path, told, strict=True):
        x, y, theta = product(first, pose)
        assert same_pose(seen, product(path[0], (x, -y, -theta)))


def test_what_else_was_learned_is_of_the_mirror_image() -> None:
    true = driven(START, SPEED, RATE, 0, 0, 0)
    measured = driven(START, SPEED, RATE, 0.1, 0.03, 0.2)
    odd = Correction(turn=-2.0).path(measured)
    better = Correction(0.1, 0.03, -2.2).path(odd)
    assert np.hypot(*(better - true)[:, :2].T).max() < 0.02
