"""Where modules stand whose coordinates somebody has measured: the frame of a site."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import matrix, product

from drslamd.conventions import FIRST_NODE, Chain, Segment
from drslamd.slam.graph.estimate import PoseNow, TeamEstimate, Trajectory
from drslamd.slam.points.site import LEAST_APART_M, Site, Survey, metres_per_degree, site_of
from drslamd.slam.se2 import Array

SITE_T_W = np.array([20.0, -5.0, 2.0])
PLACES = {1: (0.0, 0.0), 2: (12.0, 0.0), 3: (5.0, 9.0), 4: (-3.0, 6.0)}
SURVEY = Survey({uwb_id: np.array(place) for uwb_id, place in PLACES.items()})
ROBOT = Trajectory(Chain(0, 1), np.array([0]), np.zeros((1, 3)))


def estimate(
    *known: int, moved: dict[int, tuple[float, float]] | None = None, sigma: float = 0.05
) -> TeamEstimate:
    """A solution in which modules stand where they were surveyed, or were moved from there."""
    nodes = {}
    for uwb_id in known:
        place = np.array(PLACES[uwb_id]) + (moved or {}).get(uwb_id, (0.0, 0.0))
        w = np.linalg.inv(matrix(SITE_T_W)) @ [*place, 1.0]
        chain = Chain(FIRST_NODE + uwb_id, 1)
        nodes[chain.robot] = Trajectory(chain, np.array([0]), np.array([[w[0], w[1], 0.0]]))
    joint = sigma**2 * np.eye(3 + 3 * len(known))
    return TeamEstimate(Segment(0, 1, 0), {0: ROBOT}, joint, nodes=nodes)


def found(team: TeamEstimate, survey: Survey = SURVEY) -> Site:
    site = site_of(team, survey)
    assert isinstance(site, Site), site
    return site


@pytest.mark.parametrize("known", [(1, 2), (2, 3), (1, 2, 3), (1, 2, 3, 4)])
def test_two_modules_or_more_make_the_frame(known: tuple[int, ...]) -> None:
    site = found(estimate(*known))
    assert site.site_T_w == pytest.approx(SITE_T_W, abs=1e-6)
    assert site.used == known
    assert site.off_m == pytest.approx(0.0, abs=1e-9)


def test_its_angle_is_as_uncertain_as_two_places_are_over_their_distance() -> None:
    site = found(replace(estimate(1, 2, sigma=0.05)))
    sigma = math.hypot(0.05, 0.03) * math.sqrt(2) / 12.0
    assert math.sqrt(site.covariance[2, 2]) == pytest.approx(sigma, rel=1e-3)
    one = math.hypot(0.05, 0.03) / math.sqrt(2)
    assert np.sqrt(np.diag(site.covariance)[:2]) == pytest.approx([one, one], rel=1e-3)


def test_a_pose_is_carried_into_it_with_its_doubt() -> None:
    site = found(estimate(1, 2))
    now = PoseNow(0, np.array([3.0, 4.0, 1.0]), np.diag([0.01, 0.04, 0.001]))
    pose, covariance = site.pose(now)
    assert pose == pytest.approx(product(SITE_T_W, now.pose))
    arm = np.hypot(*(now.pose[:2] - site.middle))
    turn = site.covariance[2, 2]
    assert covariance[2, 2] == pytest.approx(0.001 + turn)
    assert np.trace(covariance[:2, :2]) == pytest.approx(
        0.05 + 2 * site.covariance[0, 0] + turn * arm**2
    )


@pytest.mark.parametrize("known", [(), (1,)])
def test_one_module_makes_no_frame(known: tuple[int, ...]) -> None:
    said = site_of(estimate(*known), SURVEY)
    assert isinstance(said, str)
    assert f"{len(known)} of its modules known" in said
    assert isinstance(site_of(None, SURVEY), str)


@pytest.mark.parametrize(
    ("apart", "is_frame"), [(LEAST_APART_M - 0.01, False), (LEAST_APART_M, True)]
)
def test_two_in_one_place_make_no_frame(apart: float, is_frame: bool) -> None:
    places = {1: np.zeros(2), 2: np.array([apart, 0.0])}
    team = estimate(1, 2, moved={2: (apart - 12.0, 0.0)})
    assert isinstance(site_of(team, Survey(places)), Site) is is_frame


def test_a_module_that_was_moved_is_left_out_where_there_are_enough_others() -> None:
    site = found(estimate(1, 2, 3, 4, moved={3: (2.0, 0.0)}))
    assert (site.used, site.left_out) == ((1, 2, 4), (3,))
    assert site.site_T_w == pytest.approx(SITE_T_W, abs=1e-6)


def test_of_two_nobody_can_tell_which_was_moved() -> None:
    said = site_of(estimate(1, 2, moved={2: (2.0, 0.0)}), SURVEY)
    assert isinstance(said, str)
    assert "modules 1, 2 do not stand" in said


def test_a_degree_is_as_long_as_on_the_ellipsoid() -> None:
    """Lengths of a degree from the tables of WGS 84."""
    assert metres_per_degree(0.0) == pytest.approx((111_320, 110_574), abs=1)
    assert metres_per_degree(45.0) == pytest.approx((78_847, 111_132), abs=1)
    assert metres_per_degree(60.0) == pytest.approx((55_800, 111_412), abs=1)


def test_degrees_become_metres_and_back() -> None:
    survey = Survey.of_degrees({7: (48.0, 11.0), 8: (48.001, 11.002)})
    assert survey.places[7] == pytest.approx([0.0, 0.0])
    east, north = survey.places[8]
    assert (east, north) == pytest.approx((149.3, 111.2), abs=0.2)
    assert survey.degrees(np.array([east, north])) == pytest.approx((48.001, 11.002))


def test_of_places_in_metres_nobody_knows_where_on_earth_they_are() -> None:
    assert SURVEY.origin is None
    where: Array = SURVEY.places[2]
    assert where.tolist() == [12.0, 0.0]
