"""The graph with its ranges in the text of PyFactorGraph, as the reader of the lab reads it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import team_answers
from lab.recordings.readers import read

from drslamd.export import pyfg_file
from drslamd.export.pyfg_file import TooManyRobots, write


def lines(path: Path, kind: str) -> list[list[str]]:
    words = [line.split() for line in path.read_text().splitlines()]
    return [w for w in words if w[0] == kind]


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    """Odometry as it was corrected, poses as they were solved, ranges between keyframes."""
    answer = team_answers.answers()["graph"]
    (path,) = write(tmp_path, answer)
    found = read(path)
    assert sorted(found.trails) == [0, 1, 2]
    assert len(found.ranges) == len(answer["ranges"]["rows"])
    rows = answer["keyframes"]["rows"]
    for robot, trail in found.trails.items():
        solved = np.array([row[3:6] for row in rows if row[1] == robot])
        assert trail.truth == pytest.approx(solved, abs=1e-6)
        assert np.diff(trail.t) == pytest.approx(
            np.diff([row[2] for row in rows if row[1] == robot]) / 1e6, abs=2e-3
        )


def test_a_range_has_the_residual_that_it_had_in_the_graph(tmp_path: Path) -> None:
    answer = team_answers.answers()["graph"]
    (path,) = write(tmp_path, answer)
    where = {w[2]: np.array([float(w[3]), float(w[4])]) for w in lines(path, "VERTEX_SE2")}
    told = answer["ranges"]["rows"]
    for words, row in zip(lines(path, "EDGE_RANGE"), told, strict=True):
        apart = math.hypot(*(where[words[3]] - where[words[2]]))
        assert apart - float(words[4]) == pytest.approx(row[7], abs=2e-6)
        assert float(words[5]) == pytest.approx(row[5] ** 2)


def of_robots(count: int) -> dict[str, Any]:
    clock = {"source": "own", "readings": [[0, 0, 0]]}
    return {
        "frame": 0,
        "wall": {"utc_minus_clock_us": 0, "uncertainty_us": 0},
        "clocks": {str(3 * k): clock for k in range(count)},
        "keyframes": {
            "columns": ["key", "robot", "utime", "x_m", "y_m", "theta_rad"],
            "rows": [[k, 3 * k, 1_000_000, 0.0, 0.0, 0.0] for k in range(count)],
        },
        "odometry": {"columns": ["i", "j", "x_m", "y_m", "theta_rad", *"abcdef"], "rows": []},
        "closures": {"columns": ["i", "j", "x_m", "y_m", "theta_rad", *"abcdef"], "rows": []},
        "ranges": {"columns": ["i", "j", "sigma_m", "residual_m"], "rows": []},
    }


def test_as_many_robots_as_there_are_letters_have_one_each(tmp_path: Path) -> None:
    most = len(pyfg_file.LETTERS)
    (path,) = write(tmp_path, of_robots(most))
    keys = [words[2] for words in lines(path, "VERTEX_SE2")]
    assert len(set(keys)) == most == 51
    assert "L0" not in keys
    with pytest.raises(TooManyRobots, match="52 robots, and pyfg has letters for 51"):
        write(tmp_path, of_robots(most + 1))


def test_keyframes_without_a_time_are_left_out_with_what_hangs_on_them(tmp_path: Path) -> None:
    answer = team_answers.answers()["graph"]
    answer["clocks"]["0"] = {"source": "unknown", "readings": []}
    (path,) = write(tmp_path, answer)
    assert not [w for w in lines(path, "VERTEX_SE2") if w[2].startswith("A")]
    assert not [w for w in lines(path, "EDGE_RANGE") if "A" in w[2][0] + w[3][0]]
    assert lines(path, "EDGE_RANGE")
