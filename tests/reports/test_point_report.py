"""What a robot says of things that stand around it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from passing_scene import OWN, SENSORS, PassingScene
from slam_scenes import config

from drslamd.conventions import Chain, node_chain
from drslamd.gossip.seal import team_key
from drslamd.reports import point_report
from drslamd.robot import Robot
from drslamd.slam.odometry.track import RESOLUTION
from drslamd.slam.points.point_tracker import PointTracker, Target

NODE = node_chain(77)
PLACE = np.array([3.0, -2.0])


def a_robot() -> Robot:
    return Robot(config(OWN.robot), team_key(None), 1, {})


def test_a_module_has_a_place_with_a_sigma_in_the_frame_of_the_team() -> None:
    robot, scene = a_robot(), PassingScene(PLACE)
    assert point_report.modules(robot) == {}
    scene.drive(2)
    robot.back.estimate = scene.estimate(NODE.robot, PLACE)
    (found,) = point_report.modules(robot).items()
    uwb_id, module = found
    assert (uwb_id, module["x_m"], module["y_m"]) == ("77", 3.0, -2.0)
    assert module["sigma_m"] == pytest.approx(0.0316)
    assert module["covariance_m2"] == pytest.approx([1e-3, 0.0, 1e-3])


def test_candidates_are_told_while_there_are_several() -> None:
    robot, scene = a_robot(), PassingScene(PLACE)
    trackers = robot.front.points.trackers
    trackers[77] = PointTracker(Target(NODE), SENSORS)
    trackers[50] = PointTracker(Target(Chain(5, 1), 3), SENSORS)
    scene.path = np.column_stack([np.arange(500) * 0.05, np.zeros((500, 2))])
    scene.drive(10)
    run = trackers[77].look(scene.own, scene.ranges, scene.utime)
    assert run is not None
    found, when = run()
    assert not trackers[77].is_certain(found, scene.own, when)
    points = point_report.points(robot)
    assert points["50"] == {
        "robot": 5,
        "told": False,
        "verdict": "no search yet",
        "candidates": [],
    }
    assert (points["77"]["robot"], points["77"]["verdict"]) == (None, "ambiguous")
    assert len(points["77"]["candidates"]) == 2


BEACONS = """
[[beacon]]
uwb_id = 77
x_m = 10.0
y_m = 0.0
[[beacon]]
uwb_id = 78
x_m = 10.0
y_m = 4.0
"""


@pytest.mark.parametrize("is_point", [False, True])
def test_a_robot_has_a_pose_in_the_frame_of_the_site(is_point: bool) -> None:
    robot, scene = Robot(config(OWN.robot, BEACONS), team_key(None), 1, {}), PassingScene(PLACE)
    scene.drive(2)
    assert point_report.site(robot, scene.utime) == {
        "why_not": "no module of the site is known yet"
    }
    estimate = scene.estimate(NODE.robot, PLACE)
    other = replace(estimate.nodes[NODE.robot], poses=np.array([[*(PLACE + [0.0, 4.0]), 0.0]]))
    robot.back.estimate = replace(
        estimate,
        nodes={**estimate.nodes, NODE.robot + 1: other},
        joint=1e-4 * np.eye(9),
        points=frozenset([OWN.robot] if is_point else []),
    )
    for n, pose in enumerate(scene.path[:20]):
        robot.front.reckoning.track.append(1_000 + n, np.round(pose / RESOLUTION))
    site = point_report.site(robot, scene.utime)
    assert site is not None
    assert site["modules"] == [77, 78]
    assert site["site_T_team"] == pytest.approx([7.0, 2.0, 0.0], abs=1e-6)
    assert ("theta_deg" in site) is not is_point
    last = scene.path[19]
    assert (site["x_m"], site["y_m"]) == pytest.approx((last[0] + 7, last[1] + 2), abs=0.1)


def test_without_coordinates_there_is_no_site() -> None:
    assert point_report.site(a_robot(), 0) is None
