"""Where something stands, by ranges from a robot that drives past."""

from __future__ import annotations

import numpy as np
import pytest
from slam_scenes import NOISE, inverted, matrix, product, straight, wander

from drslamd.slam.points.point_search import (
    FEWEST,
    MAX_SIGMA_M,
    MOST_OFF,
    Passing,
    PlaceFound,
    search,
)
from drslamd.slam.range_model import LINKTRACK, RangeNoise
from drslamd.slam.se2 import Array

RANGES = RangeNoise(0.1, 0.3)
STEP_S = 0.5


def passed(way: Array, node: Array, antenna: tuple[float, float] = (0.0, 0.0)) -> Passing:
    """Exact ranges to a node (2,) from each pose of a way (k, 3)."""
    last = inverted(way[-1])
    points = np.array([(matrix(pose) @ [*antenna, 1.0])[:2] for pose in way])
    return Passing(
        t=STEP_S * (np.arange(len(way)) - len(way) + 1),
        range_m=np.hypot(*(points - node).T),
        doubt_m=np.zeros(len(way)),
        poses=np.array([product(last, pose) for pose in way]),
        antenna=np.array(antenna),
    )


def found(seen: Passing) -> PlaceFound:
    return search(seen, NOISE, RANGES, LINKTRACK)


def seen_from(pose: Array, node: Array) -> Array:
    return np.asarray((np.linalg.inv(matrix(pose)) @ [*node, 1.0])[:2])


@pytest.mark.parametrize("antenna", [(0.0, 0.0), (0.3, -0.2)])
@pytest.mark.parametrize("seed", [1, 2])
def test_who_drives_curves_knows_the_only_place(seed: int, antenna: tuple[float, float]) -> None:
    way, node = wander(np.random.default_rng(seed), 60, 0.25), np.array([4.0, -3.0])
    answer = found(passed(way, node, antenna))
    assert answer.verdict == ""
    (one,) = answer.candidates
    assert np.hypot(*(one.place - seen_from(way[-1], node))) < 0.05
    assert one.sigma_m < MAX_SIGMA_M


def test_who_drives_straight_knows_two_places_left_and_right_of_its_way() -> None:
    way, node = straight((0.0, 0.0, 0.5), 40, 0.25), np.array([3.0, 6.0])
    answer = found(passed(way, node))
    assert answer.verdict == "ambiguous"
    one, other = (candidate.place for candidate in answer.candidates)
    assert np.allclose(one * [1, -1], other, atol=0.1)
    there = seen_from(way[-1], node)
    assert min(np.hypot(*(place - there)) for place in (one, other)) < 0.1


def test_who_stands_knows_no_place() -> None:
    way = np.zeros((40, 3))
    answer = found(passed(way, np.array([3.0, 6.0])))
    assert answer.verdict in ("ambiguous", "not enough motion")


def test_what_drives_itself_has_no_place() -> None:
    rng = np.random.default_rng(4)
    way, other = wander(rng, 60, 0.25), wander(rng, 60, 0.25)
    seen = passed(way, np.array([4.0, -3.0]))
    range_m = np.hypot(*(way - other)[:, :2].T)
    answer = found(Passing(seen.t, range_m, seen.doubt_m, seen.poses, seen.antenna))
    assert answer.candidates == ()
    assert "moves" in answer.verdict


@pytest.mark.parametrize(("count", "is_enough"), [(FEWEST - 1, False), (FEWEST, True)])
def test_few_ranges_say_nothing(count: int, is_enough: bool) -> None:
    way = wander(np.random.default_rng(1), count, 0.6)
    answer = found(passed(way, np.array([4.0, -3.0])))
    assert (answer.verdict != "too few ranges") is is_enough


@pytest.mark.parametrize(("share", "fits"), [(MOST_OFF - 0.05, True), (MOST_OFF + 0.05, False)])
def test_bursts_are_left_out_while_they_are_few(share: float, fits: bool) -> None:
    rng = np.random.default_rng(5)
    way, node = wander(rng, 60, 0.25), np.array([4.0, -3.0])
    seen = passed(way, node)
    range_m = seen.range_m.copy()
    range_m[rng.choice(60, round(60 * share), replace=False)] += 2.0
    answer = found(Passing(seen.t, range_m, seen.doubt_m, seen.poses, seen.antenna))
    assert bool(answer.candidates) is fits
    if fits:
        assert np.hypot(*(answer.candidates[0].place - seen_from(way[-1], node))) < 0.3


def test_a_place_is_as_uncertain_as_it_turns_out_to_be() -> None:
    """Mean squared error in units of the claimed covariance, of noise as it is claimed."""
    squares = []
    for seed in range(16):
        rng = np.random.default_rng(seed)
        way, node = wander(rng, 60, 0.25), np.array([4.0, -3.0])
        seen = passed(way, node)
        of_ranges = LINKTRACK.covariance(seen.t, seen.range_m, RANGES.sigma, RANGES.bias_sigma)
        noise = np.linalg.cholesky(of_ranges)
        range_m = seen.range_m + noise @ rng.normal(size=60)
        answer = found(Passing(seen.t, range_m, seen.doubt_m, seen.poses, seen.antenna))
        if answer.verdict == "":
            one = answer.candidates[0]
            off = one.place - seen_from(way[-1], node)
            squares.append(off @ np.linalg.solve(one.covariance, off) / 2)
    assert len(squares) > 8
    assert 0.3 < np.mean(squares) < 1.3
