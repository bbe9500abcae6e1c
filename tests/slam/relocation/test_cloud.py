"""A cloud of places: what ranges say of a robot whose wheels are silent."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.relocation.cloud import NEAR_M, STEP_S, Cloud
from drslamd.slam.relocation.sightings import Sightings

SPEED = 0.5
BEACONS = np.array([[0.0, 0.0], [6.0, 0.0]])


def seen_from(place: tuple[float, float], beacons: np.ndarray = BEACONS) -> Sightings:
    """Exact ranges to beacons."""
    k = len(beacons)
    metres = np.hypot(*(beacons - place).T)
    return Sightings(np.zeros(k), beacons, metres, np.full(k, 0.05), np.full(k, 0.05), np.arange(k))


def test_without_ranges_it_grows_no_faster_than_the_robot_drives() -> None:
    cloud = Cloud(np.zeros(2), 0.01 * np.eye(2), SPEED)
    for _ in range(20):
        cloud.carry(STEP_S)
    mean, covariance = cloud.moments()
    assert np.hypot(*mean) < 0.1
    seconds = 20 * STEP_S
    sigma = np.sqrt(np.trace(covariance))
    assert 0.3 * SPEED * seconds < sigma < SPEED * seconds


def test_it_follows_a_robot_that_two_peers_see() -> None:
    cloud = Cloud(np.array([2.0, 4.0]), 0.01 * np.eye(2), SPEED)
    for step in range(1, 41):
        place = (2.0 + 0.4 * STEP_S * step, 4.0)
        cloud.carry(STEP_S)
        cloud.weigh(seen_from(place), LINKTRACK, 0.0)
    mean, covariance = cloud.moments()
    assert np.hypot(*(mean - place)) < 0.2
    assert np.sqrt(np.trace(covariance)) < 0.6


def test_the_same_ranges_give_the_same_cloud() -> None:
    found = []
    for _ in range(2):
        cloud = Cloud(np.array([2.0, 4.0]), 0.01 * np.eye(2), SPEED)
        for _ in range(5):
            cloud.carry(STEP_S)
            cloud.weigh(seen_from((2.0, 4.0)), LINKTRACK, 0.0)
        found.append(cloud.moments())
    assert np.array_equal(found[0][0], found[1][0])
    assert np.array_equal(found[0][1], found[1][1])


@pytest.mark.parametrize(
    ("beacons", "y", "is_sure"),
    [
        (BEACONS, 0.5 * NEAR_M, False),
        (BEACONS, 4.0, True),
        (np.vstack([BEACONS, [3.0, 5.0]]), 0.5 * NEAR_M, True),
    ],
    ids=["near the line", "far from it", "a third peer"],
)
def test_who_came_near_the_line_between_two_peers_may_be_on_either_side(
    beacons: np.ndarray, y: float, is_sure: bool
) -> None:
    """It goes on to 3 m above that line; as far below is all the rest of the claim."""
    cloud = Cloud(np.array([2.0, y]), 0.001 * np.eye(2), 1.0)
    ways = np.linspace(y, 3.0, 30)
    for way in ways.tolist():
        cloud.carry(STEP_S)
        cloud.weigh(seen_from((2.0, way), beacons), LINKTRACK, 0.0)
    _, covariance = cloud.moments()
    assert bool(np.sqrt(covariance[1, 1]) < 1.0) is is_sure
    if not is_sure:
        assert np.sqrt(covariance[1, 1]) > 2.5
