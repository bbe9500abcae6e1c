"""Paths and closures, as a robot says them when it is asked."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from message_builders import SECOND
from pair_scenes import BESIDE, MIRRORED, OwnedPair, asked_at, estimate_of
from robot_scenes import T0, RobotScene
from slam_scenes import product

from drslamd import report
from drslamd.conventions import GRID_US, Chain, Segment
from drslamd.slam.closure_method import AGREEMENT
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory


def test_without_an_estimate_there_are_no_paths() -> None:
    assert report.trajectories(RobotScene().robot, T0) == {
        "frame": None,
        "robots": {},
        "modules": {},
        "site": None,
    }


def test_our_path_is_said_at_ten_hertz_and_those_of_others_at_their_keyframes() -> None:
    """Ours goes along x of a frame that is turned by a quarter."""
    scene = RobotScene(robot=2)
    scene.drive(3)
    first = T0 // GRID_US + 1
    ends = np.array([first, first + 29])
    way = 0.05 * (ends - first)
    turned = np.array([[5.0, 1.0 + metres, math.pi / 2] for metres in way])
    own = Trajectory(scene.robot.own, ends, turned)
    other = Trajectory(Chain(1, 8), np.array([40, 50]), np.array([[1, 2, 3], [4, 5, 6.0]]))
    scene.robot.back.on_solution(TeamEstimate(Segment(1, 8, 0), {2: own, 1: other}))
    told = json.loads(json.dumps(report.trajectories(scene.robot, scene.utime)))
    assert (told["frame"], list(told["robots"])) == (1, ["1", "2"])
    assert told["robots"]["1"] == {
        "epoch": 8,
        "utime": [4 * SECOND, 5 * SECOND],
        "poses": [[1, 2, 3], [4, 5, 6]],
        "has_heading": True,
        "clock": {"source": "unknown", "readings": []},
    }
    ours = told["robots"]["2"]
    assert ours["utime"] == [(first + k) * GRID_US for k in range(30)]
    expected = [product((5, 1, math.pi / 2), (0.05 * k, 0, 0)) for k in range(30)]
    assert np.allclose(ours["poses"], expected, atol=1e-4)


def test_our_path_also_goes_where_keyframes_were_thinned_out() -> None:
    """A keyframe that the last solution no longer has is remembered beside the one before it."""
    scene = RobotScene()
    scene.drive(3)
    first = T0 // GRID_US + 1
    own, frame = scene.robot.own, Segment(0, 1, 0)
    bent = np.array([[0.0, 0, 0], [0.5, 0.2, 0], [1.45, 0, 0]])
    whole = Trajectory(own, first + np.array([0, 10, 29]), bent)
    scene.robot.back.on_solution(TeamEstimate(frame, {0: whole}))
    thinned = Trajectory(own, whole.n[[0, 2]], bent[[0, 2]])
    scene.robot.back.on_solution(TeamEstimate(frame, {0: thinned}))
    poses = report.trajectories(scene.robot, scene.utime)["robots"]["0"]["poses"]
    assert poses[10] == pytest.approx([0.5, 0.2, 0.0], abs=1e-6)


def test_every_window_is_said_with_its_poses_and_whether_it_was_kept() -> None:
    scene, pair = RobotScene(), OwnedPair(AGREEMENT)
    pair.answer(10)
    pair.see(MIRRORED, 1)
    pair.see(BESIDE, 5, first=20)
    scene.robot.front.pairs[1] = pair.tracker
    told = json.loads(json.dumps(report.closures(scene.robot)))["closures"]
    assert [(c["verdict"], len(c["poses"]), c["kept"]) for c in told] == [
        ("not enough motion", 0, False),
        ("unique", 1, False),
        *[("unique", 1, True)] * 5,
    ]
    assert {(c["a"], c["b"]) for c in told} == {(0, 1)}
    last = told[-1]
    assert last["utime"] == 60 * GRID_US
    assert last["poses"] == [list(BESIDE)]
    assert np.allclose(last["covariances"][0], 0.05**2 * np.eye(3))


def test_a_window_that_said_nothing_is_not_kept_though_the_next_closure_has_its_number() -> None:
    scene = RobotScene()
    pair = scene.own_pair(1)
    pair.on_estimate(asked_at(10), estimate_of())
    pair.on_estimate(asked_at(20), estimate_of(BESIDE, MIRRORED))
    pair.kept = ()
    pair._kept_before = {0}
    told = report.closures(scene.robot)["closures"]
    assert [(c["verdict"], c["kept"]) for c in told] == [
        ("not enough motion", False),
        ("ambiguous", True),
    ]
