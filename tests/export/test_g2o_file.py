"""The graph in g2o's text, as GTSAM and our own reader read it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import team_answers
from lab.recordings import g2o

from drslamd.export import csv_tables
from drslamd.export.g2o_file import write


def test_gtsam_reads_every_pose_and_every_edge(tmp_path: Path) -> None:
    gtsam = pytest.importorskip("gtsam", reason="no gtsam for this Python")
    answer = team_answers.answers()["graph"]
    path, _ = write(tmp_path, answer)
    graph, values = gtsam.readG2o(str(path), False)
    edges = len(answer["odometry"]["rows"]) + len(answer["closures"]["rows"])
    assert values.size() == len(answer["keyframes"]["rows"]) > 90
    assert graph.size() == edges > 90
    for key, _, _, x, y, theta, *_ in answer["keyframes"]["rows"]:
        pose = values.atPose2(key)
        assert [pose.x(), pose.y()] == pytest.approx([x, y], abs=1e-6)
        assert np.cos(pose.theta() - theta) == pytest.approx(1, abs=1e-9)
    # the estimate is a good solution of what it was made of: half of chi-squared, 3 per edge
    assert graph.error(values) < 1.5 * edges


def test_a_covariance_becomes_the_information_of_the_same_edge(tmp_path: Path) -> None:
    answer = team_answers.answers()["graph"]
    read = g2o.read(write(tmp_path, answer)[0])
    first = answer["odometry"]["rows"][0]
    packed = np.array(first[5:])
    covariance = packed[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
    assert [read.ids[read.i[0]], read.ids[read.j[0]]] == first[:2]
    assert read.measured[0] == pytest.approx(first[2:5])
    assert read.information[0] @ covariance == pytest.approx(np.eye(3), abs=1e-6)


def test_whose_keyframe_a_key_is_stands_beside_it(tmp_path: Path) -> None:
    answer = team_answers.answers()["graph"]
    _, beside = write(tmp_path, answer)
    assert beside.name == "keyframes.csv"
    assert beside.read_text() == csv_tables.keyframe_rows(answer)
