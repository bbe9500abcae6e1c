"""The graph as tables: keys that fit each other, residuals that are true, bounds that hold."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import team_answers
from robot_scenes import RobotScene

from drslamd.conventions import Chain, Segment
from drslamd.history import pose_history
from drslamd.reports import graph_report
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory


def table(answer: dict[str, Any], name: str) -> dict[str, Any]:
    told = answer[name]
    rows = np.array(told["rows"], dtype=float).reshape(-1, len(told["columns"]))
    return dict(zip(told["columns"], rows.T, strict=True))


def test_a_robot_in_no_group_tells_its_clock_and_no_graph() -> None:
    told = json.loads(json.dumps(graph_report.graph(RobotScene(robot=3).robot, 5)))
    assert told == {
        "robot": 3,
        "epoch": 1,
        "utime": 5,
        "frame": None,
        "poses": {"3": {"columns": list(pose_history.COLUMNS), "rows": [], "left_out": 0}},
        "clocks": {"3": {"source": "own", "readings": [[5, 0, 0]]}},
    }


def test_an_estimate_whose_closures_were_withdrawn_leaves_no_tables() -> None:
    scene = RobotScene()
    scene.drive(1)
    scene.localise()
    told = graph_report.graph(scene.robot, scene.utime)
    assert told["frame"] == 0
    assert "keyframes" not in told


def test_a_trajectory_of_a_robot_that_is_gone_has_a_clock_that_nobody_knows() -> None:
    scene = RobotScene()
    gone = Trajectory(Chain(5, 2), np.array([3]), np.zeros((1, 3)))
    scene.robot.back.on_solution(TeamEstimate(Segment(0, 1, 0), {5: gone}))
    told = graph_report.graph(scene.robot, scene.utime)
    assert told["clocks"]["5"] == {"source": "unknown", "readings": []}


def test_keyframes_are_where_the_estimate_has_them() -> None:
    answer = team_answers.answers()["graph"]
    keyframes = table(answer, "keyframes")
    assert keyframes["key"].tolist() == list(range(len(keyframes["key"])))
    assert set(keyframes["robot"]) == {0, 1, 2}
    estimate = team_answers.team().member(team_answers.ASKED).robot.back.estimate
    assert estimate is not None
    for robot, solved in estimate.trajectories.items():
        mine = keyframes["robot"] == robot
        known = np.isin(keyframes["utime"][mine], solved.n * 100_000)
        assert known.sum() == len(solved.n)
        xy = np.stack([keyframes["x_m"], keyframes["y_m"]], axis=-1)[mine][known]
        assert xy == pytest.approx(solved.poses[:, :2], abs=1e-6)


def test_a_residual_is_what_is_predicted_minus_what_was_measured() -> None:
    """From antenna to antenna, a pair after the other out of what was said; the near-range bias
    is some centimetres at most and not in it."""
    answer = team_answers.answers()["graph"]
    keyframes, ranges = table(answer, "keyframes"), table(answer, "ranges")
    i, j = ranges["i"].astype(int), ranges["j"].astype(int)
    assert (keyframes["robot"][i] == ranges["a"]).all()
    assert (keyframes["robot"][j] == ranges["b"]).all()
    view = team_answers.team().member(team_answers.ASKED).robot.back.graph.view
    for pair in view.pairs:
        mine = (ranges["a"] == pair.a.robot) & (ranges["b"] == pair.b.robot)
        said = pair.ranges
        assert np.sort(ranges["range_m"][mine]) == pytest.approx(np.sort(said.range_m), abs=1e-5)
        for a_n, b_n, q_a, q_b, r in zip(
            said.a_n, said.b_n, said.q_a, said.q_b, said.range_m, strict=True
        ):
            ends = []
            for robot, n, q in ((pair.a.robot, a_n, q_a), (pair.b.robot, b_n, q_b)):
                here = (keyframes["robot"] == robot) & (keyframes["utime"] == n * 100_000)
                x, y, th = (keyframes[c][here][0] for c in ("x_m", "y_m", "theta_rad"))
                cos, sin = np.cos(th), np.sin(th)
                ends.append(np.array([x + cos * q[0] - sin * q[1], y + sin * q[0] + cos * q[1]]))
            (row,) = np.flatnonzero(mine & (np.abs(ranges["range_m"] - r) < 1e-5))[:1]
            predicted = np.hypot(*(ends[1] - ends[0])) - r + ranges["bias_m"][row]
            assert predicted == pytest.approx(ranges["residual_m"][row], abs=0.06)
    assert np.sqrt(np.mean(ranges["residual_m"] ** 2)) < 0.06


def test_odometry_and_closures_join_keyframes_and_fit_the_poses() -> None:
    answer = team_answers.answers()["graph"]
    keyframes = table(answer, "keyframes")
    poses = np.stack([keyframes["x_m"], keyframes["y_m"]], axis=-1)
    for name, most in (("odometry", 0.02), ("closures", 0.5)):
        edges = table(answer, name)
        i, j = edges["i"].astype(int), edges["j"].astype(int)
        same = keyframes["robot"][i] == keyframes["robot"][j]
        assert same.all() if name == "odometry" else not same.any()
        length = np.hypot(edges["x_m"], edges["y_m"])
        off = np.hypot(*(poses[j] - poses[i]).T) - length
        assert np.median(np.abs(off)) < most


def test_the_newest_rows_stay_when_there_are_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    member = team_answers.team().member(team_answers.ASKED)
    whole = graph_report.graph(member.robot, 0)
    monkeypatch.setattr(graph_report, "MOST_ROWS", 20)
    told = graph_report.graph(member.robot, 0)
    for name in ("keyframes", "odometry", "ranges"):
        assert len(told[name]["rows"]) == 20
        assert told[name]["left_out"] == len(whole[name]["rows"]) - 20
        assert told[name]["rows"] == whole[name]["rows"][-20:]
    assert min(max(row[0], row[1]) for row in told["odometry"]["rows"]) > 0.7 * len(
        whole["keyframes"]["rows"]
    )


def test_published_poses_come_with_their_covariance() -> None:
    answer = team_answers.answers()["graph"]
    for robot in ("0", "1", "2"):
        poses = table(answer["poses"], robot)
        assert len(poses["utime"]) > 5
        assert set(poses["state"]) <= {1, 2, 3}
        assert (poses["xx_m2"] > 0).all()
        assert (poses["xx_m2"] * poses["yy_m2"] > poses["xy_m2"] ** 2).all()
