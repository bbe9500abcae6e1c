"""Which motion decides: held against arithmetic of another kind, and against module 1 itself."""

from __future__ import annotations

import cmath
import itertools
import math

import numpy as np
import pytest
from slam_scenes import NOISE, Array

from drslamd.slam import se2
from drslamd.slam.hypotheses.deciding_motion import (
    END_M,
    NO_TURN,
    TURNS,
    WAYS_M,
    DecidingMotion,
    deciding_motion,
    most_left,
)
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose import solver
from drslamd.slam.relative_pose.estimate import PairNoise, RelativePoseEstimate
from drslamd.slam.relative_pose.window import Window

SIGMA = 0.1
POINT = 1e-12 * np.eye(2)
MIRRORED = np.array([[3.0, 2.0], [3.0, -2.0]])
"""On both sides of the way that was driven, which leads along x."""


def found(places: Array, sigma_m: float = 0.0, range_sigma: float = SIGMA) -> DecidingMotion | None:
    covariances = np.tile(POINT + sigma_m**2 * np.eye(2), (len(places), 1, 1))
    return deciding_motion(2, 1, places, covariances, range_sigma)


def change(place: Array, end: complex) -> float:
    """Of the range to a place, by complex numbers."""
    return abs(complex(*place) - end) - abs(complex(*place))


def sigma_of_change(place: Array, covariance: Array, end: complex) -> float:
    """By drawing: of the range that is told after the way, less the one before it."""
    rng = np.random.default_rng(7)
    drawn = rng.multivariate_normal(place, covariance, 4000) @ [1, 1j]
    return float(np.std(np.abs(drawn - end) - np.abs(drawn)))


def test_places_are_told_apart_as_drawn_places_are() -> None:
    rng = np.random.default_rng(5)
    for _ in range(6):
        places = rng.uniform(2.0, 6.0, (3, 2)) * rng.choice([-1, 1], (3, 2))
        shapes = rng.normal(0, 0.15, (3, 2, 2))
        covariances = shapes @ shapes.transpose(0, 2, 1)
        turn, way = int(rng.integers(len(TURNS))), int(rng.integers(len(WAYS_M)))
        end = cmath.rect(WAYS_M[way] - END_M, TURNS[turn])
        changes = [change(place, end) for place in places]
        sigmas = [
            sigma_of_change(place, covariance, end)
            for place, covariance in zip(places, covariances, strict=True)
        ]
        left = [1, 1, 1]
        for i, j in itertools.permutations(range(3), 2):
            variance = SIGMA**2 + sigmas[i] ** 2 + sigmas[j] ** 2
            apart = (changes[i] - changes[j]) ** 2 / variance
            assert not 18 < apart < 22.5, "too near to the threshold for what was drawn"
            left[i] += apart < 20
        assert most_left(places, covariances, SIGMA)[turn, way] == max(left)


def test_straight_on_tells_nothing_from_its_mirror_image_and_both_sides_are_alike() -> None:
    motion = found(MIRRORED)
    assert motion is not None
    assert motion.leaves == 1
    assert motion.left == motion.right
    assert 0 < motion.left[0] < math.radians(90) < motion.left[1] < math.pi
    left = most_left(MIRRORED, np.tile(POINT, (2, 1, 1)), SIGMA)
    assert (left[TURNS == 0] == 2).all()
    assert (left[np.abs(TURNS) == math.pi] == 2).all()


def deciding_turns(way_m: float) -> list[int]:
    """To the left, in steps of five degrees, of the two places that are known exactly."""
    out = []
    for degrees in range(0, 181, 5):
        one, other = (change(p, cmath.rect(way_m - END_M, math.radians(degrees))) for p in MIRRORED)
        if (one - other) ** 2 >= 20 * SIGMA**2:
            out.append(degrees)
    return out


def test_the_shortest_way_is_named_that_thirty_degrees_of_turns_go_with() -> None:
    motion = found(MIRRORED)
    assert motion is not None
    ways = WAYS_M.tolist()
    turns = {way_m: deciding_turns(way_m) for way_m in ways}
    wide = [way_m for way_m in ways if turns[way_m] and turns[way_m][-1] - turns[way_m][0] >= 30]
    assert motion.way_m == wide[0] < ways[-1]
    decide = turns[motion.way_m]
    assert decide == list(range(decide[0], decide[-1] + 1, 5))
    assert motion.left == pytest.approx((math.radians(decide[0]), math.radians(decide[-1])))


@pytest.mark.parametrize(("range_sigma", "way_m"), [(0.05, 0.5), (0.2, 1.5), (0.4, 2.0)])
def test_the_worse_ranges_are_the_longer_is_the_way(range_sigma: float, way_m: float) -> None:
    motion = found(MIRRORED, range_sigma=range_sigma)
    assert motion is not None
    assert motion.way_m == way_m


def test_places_that_are_known_badly_take_a_longer_way() -> None:
    well, badly = found(MIRRORED), found(MIRRORED, sigma_m=0.7)
    assert well is not None
    assert badly is not None
    assert badly.way_m > well.way_m


def test_straight_on_tells_what_lies_ahead_from_what_lies_behind() -> None:
    ahead = found(np.array([[3.0, 0.0], [-3.0, 0.0]]))
    assert ahead is not None
    assert ahead.left[0] == ahead.right[0] == 0.0


def test_only_one_side_may_decide() -> None:
    """Of two places at the same bearing, one far, ranges differ only where one is passed."""
    motion = found(np.array([[0.5, 1.5], [1.5, 4.5]]), sigma_m=0.02)
    assert motion is not None
    assert motion.right == NO_TURN
    assert motion.left[1] > motion.left[0] > 0


def test_four_places_of_two_straight_ways_take_two_motions() -> None:
    """Turned about by the first, two that are alike before and after it are left."""
    places = np.array([[3.0, 2.0], [3.0, -2.0], [-3.0, 2.0], [-3.0, -2.0]])
    motion = found(places, sigma_m=0.3)
    assert motion is not None
    assert motion.leaves == 2


def test_no_motion_is_named_where_none_decides() -> None:
    assert found(np.array([[3.0, 2.0], [3.05, 2.0]])) is None
    assert found(MIRRORED, range_sigma=5.0) is None


# module 1 itself


def driven(start: tuple[float, float, float], *legs: tuple[float, float]) -> Array:
    """(n, 3) poses, 5 cm or 0.1 rad apart: of each leg first the turn, then the way."""
    poses = [start]
    for turn, way_m in legs:
        for _ in range(round(abs(turn) / 0.1)):
            x, y, theta = poses[-1]
            poses.append((x, y, theta + math.copysign(0.1, turn)))
        for _ in range(round(way_m / 0.05)):
            x, y, theta = poses[-1]
            poses.append((x + 0.05 * math.cos(theta), y + 0.05 * math.sin(theta), theta))
    return np.array(poses)


def solved(a: Array, b: Array, seed: int) -> RelativePoseEstimate:
    """What module 1 says; who has arrived earlier waits."""
    n = max(len(a), len(b))
    a, b = (np.concatenate([way, np.repeat(way[-1:], n - len(way), axis=0)]) for way in (a, b))
    ranges = np.hypot(*(a - b)[:, :2].T) + np.random.default_rng(seed).normal(0, 0.03, n)
    at = np.arange(n - 1, -1, -5)[::-1]
    a_poses, b_poses = (se2.between(way[-1], way[at]) for way in (a, b))
    window = Window((at - at[-1]) / 10, ranges[at], a_poses, b_poses, np.zeros(2), np.zeros(2))
    return solver.solve(window, PairNoise(RangeNoise(0.1, 0.1), NOISE, NOISE), 0.2)


def asked_and_left(seed: int) -> list[tuple[int, int, int]]:
    """Both drive 4 m straight from anywhere; then the peer stands and we do what is advised.

    Returns:
        for each side to which a turn is advised: how many places were foretold at most, how many
        there are, and how many there are after the same way straight on.
    """
    rng = np.random.default_rng(seed)
    straight = (0.0, 4.0)
    peer = driven((rng.uniform(-4, 4), rng.uniform(1, 5), rng.uniform(-3, 3)), straight)
    estimate = solved(driven((0, 0, 0), straight), peer, seed)
    if len(estimate.hypotheses) < 2:
        return []
    places = np.array([h.a_T_b[:2] for h in estimate.hypotheses])
    known = np.array([h.covariance[:2, :2] for h in estimate.hypotheses])
    motion = deciding_motion(1, 0, places, known, SIGMA)
    if motion is None:
        return []
    ahead = solved(driven((0, 0, 0), straight, (0.0, motion.way_m)), peer, seed + 1000)
    out = []
    for side, sector in ((1, motion.left), (-1, motion.right)):
        if sector != NO_TURN:
            turn = side * (sector[0] + sector[1]) / 2
            way = driven((0, 0, 0), straight, (turn, motion.way_m))
            left = len(solved(way, peer, seed + 1000).hypotheses)
            out.append((motion.leaves, left, len(ahead.hypotheses)))
    return out


def test_module_1_is_left_with_as_few_places_as_were_foretold() -> None:
    found = [row for seed in range(60) for row in asked_and_left(seed)]
    assert len(found) > 20
    right = sum(1 <= left <= foretold for foretold, left, _ in found)
    assert right >= 0.9 * len(found)
    assert all(ahead > 1 for *_, ahead in found)
