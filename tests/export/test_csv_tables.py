"""Tables as CSV: as many rows as were told, UNIX time in front, units in the names."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import team_answers

from drslamd.export.csv_tables import STATES, write
from drslamd.gossip.message_types import PoseState
from drslamd.report import state_name


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_table_has_its_file_with_its_rows(tmp_path: Path) -> None:
    answer = team_answers.answers()["graph"]
    names = {path.name for path in write(tmp_path, answer)}
    tables = ("keyframes", "odometry", "closures", "ranges")
    assert names == {f"{name}.csv" for name in (*tables, "windows", "poses")}
    for name in tables:
        assert len(rows(tmp_path / f"{name}.csv")) == len(answer[name]["rows"]) > 0
    poses = rows(tmp_path / "poses.csv")
    assert len(poses) == sum(len(table["rows"]) for table in answer["poses"].values())
    hypotheses = sum(max(1, len(window["poses"])) for window in answer["windows"])
    assert len(rows(tmp_path / "windows.csv")) == hypotheses > 20


def test_times_are_those_of_the_recording(tmp_path: Path) -> None:
    write(tmp_path, team_answers.answers()["graph"])
    for name in ("keyframes", "ranges", "windows", "poses"):
        t = np.array([float(row["t_unix_s"]) for row in rows(tmp_path / f"{name}.csv")])
        seconds = t - team_answers.BEGAN_US / 1e6
        assert -0.1 <= seconds.min() < seconds.max() < 43


def test_a_range_is_near_the_true_distance_at_its_time(tmp_path: Path) -> None:
    """Its keyframe is up to 0.6 s from it, and robots drive at half a metre a second."""
    write(tmp_path, team_answers.answers()["graph"])
    trails = team_answers.recording().trails
    off = []
    for row in rows(tmp_path / "ranges.csv"):
        t = float(row["t_unix_s"]) - team_answers.BEGAN_US / 1e6
        ends = [
            [
                np.interp(t, trails[int(row[end])].t, trails[int(row[end])].truth[:, k])
                for k in (0, 1)
            ]
            for end in ("a", "b")
        ]
        off.append(
            np.hypot(ends[0][0] - ends[1][0], ends[0][1] - ends[1][1]) - float(row["range_m"])
        )
    assert np.median(np.abs(off)) < 0.4


def test_a_window_that_names_a_pose_has_its_sigmas_and_one_that_does_not_has_none(
    tmp_path: Path,
) -> None:
    answer = team_answers.answers()["graph"]
    write(tmp_path, answer)
    told = rows(tmp_path / "windows.csv")
    assert {row["verdict"] for row in told} >= {"unique", "not enough motion"}
    for row in told:
        assert (row["hypothesis"] == "") == (row["x_m"] == "") == (row["tt_rad2"] == "")
    kept = sum(window["kept"] for window in answer["windows"])
    assert sum(row["kept"] == "1" and row["hypothesis"] == "0" for row in told) == kept > 0


def test_a_robot_in_no_group_has_windows_and_poses_alone(tmp_path: Path) -> None:
    found = write(tmp_path, team_answers.unlocalised()["graph"])
    assert [path.name for path in found] == ["windows.csv", "poses.csv"]


def test_cells_are_empty_where_a_clock_is_not_known(tmp_path: Path) -> None:
    answer = team_answers.answers()["graph"]
    answer["clocks"]["0"] = {"source": "unknown", "readings": []}
    write(tmp_path, answer)
    for name in ("poses", "keyframes"):
        for row in rows(tmp_path / f"{name}.csv"):
            assert (row["t_unix_s"] == "") == (row["robot"] == "0")


@pytest.mark.parametrize("state", list(PoseState))
def test_states_have_the_words_of_the_status(state: PoseState) -> None:
    assert STATES[state] == state_name(state)
