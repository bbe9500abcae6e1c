"""Trajectories as evo reads them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drslamd.export.tum_files import write


def test_tum_files_have_eight_columns_and_rising_times(tmp_path: Path) -> None:
    answer = {
        "frame": 0,
        "robots": {
            "0": {"utime": [1_000_000, 1_100_000], "poses": [[1, 2, 0], [3, 4, 3.14159265]]}
        },
    }
    (path,) = write(tmp_path / "out", json.loads(json.dumps(answer)))
    rows = [[float(v) for v in line.split()] for line in path.read_text().splitlines()]
    assert path.name == "robot0.txt"
    assert rows[0] == [1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    assert rows[1][:3] == [1.1, 3.0, 4.0]
    assert rows[1][6] == pytest.approx(1.0)
    assert rows[1][7] == pytest.approx(0.0, abs=1e-6)


def test_every_robot_has_its_file_and_a_team_without_poses_none(tmp_path: Path) -> None:
    path = {"utime": [0], "poses": [[0.0, 0.0, 0.0]]}
    written = write(tmp_path, {"frame": 0, "robots": {"4": path, "10": path}})
    assert sorted(p.name for p in written) == ["robot10.txt", "robot4.txt"]
    assert write(tmp_path / "none", {"frame": None, "robots": {}}) == []
    assert (tmp_path / "none").is_dir()


def test_times_and_poses_that_do_not_fit_each_other_are_a_bug(tmp_path: Path) -> None:
    with pytest.raises(ValueError):
        write(tmp_path, {"robots": {"0": {"utime": [0, 1], "poses": [[0.0, 0.0, 0.0]]}}})
