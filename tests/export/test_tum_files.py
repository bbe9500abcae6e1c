"""Trajectories as evo reads them: in UNIX time, whatever the robots' own clocks say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import team_answers
from evo.core import metrics as evo_metrics
from evo.core import sync
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface
from lab.score import metrics

from drslamd.export.tum_files import write

OWN = {"source": "own", "readings": [[5_000_000, 0, 0]]}
WALL = {"utc_minus_clock_us": 1_700_000_000_123_456, "uncertainty_us": 2_000}


def answer(robots: dict[str, Any]) -> dict[str, Any]:
    return {"frame": 0, "robots": robots, "wall": WALL}


def test_tum_files_have_eight_columns_and_unix_time_to_the_microsecond(tmp_path: Path) -> None:
    robots = {
        "0": {
            "utime": [1_000_000, 1_100_001],
            "poses": [[1, 2, 0], [3, 4, 3.14159265]],
            "clock": OWN,
        }
    }
    (path,) = write(tmp_path / "out", answer(robots))
    comment, *lines = path.read_text().splitlines()
    assert path.name == "robot0.txt"
    assert comment == "# robot 0: UNIX time, +-0.002 s; in the odometry frame of robot 0"
    assert lines[0].split() == ["1700000001.123456", *["1.000000", "2.000000", "0", "0", "0"]] + [
        "0.000000000",
        "1.000000000",
    ]
    assert lines[1].split()[0] == "1700000001.223457"
    last = [float(value) for value in lines[1].split()]
    assert last[1:6] == [3.0, 4.0, 0.0, 0.0, 0.0]
    assert last[6:] == pytest.approx([1.0, 0.0], abs=1e-6)


def test_every_robot_has_its_file_and_a_team_without_poses_none(tmp_path: Path) -> None:
    path = {"utime": [0], "poses": [[0.0, 0.0, 0.0]], "clock": OWN}
    written = write(tmp_path, answer({"4": path, "10": path}))
    assert sorted(p.name for p in written) == ["robot10.txt", "robot4.txt"]
    assert write(tmp_path / "none", answer({})) == []
    assert (tmp_path / "none").is_dir()


def test_a_robot_whose_clock_nobody_knows_has_none(tmp_path: Path) -> None:
    unknown = {"source": "unknown", "readings": []}
    path = {"utime": [0], "poses": [[0.0, 0.0, 0.0]], "clock": unknown}
    assert write(tmp_path, answer({"4": path})) == []
    assert list(tmp_path.iterdir()) == []


def test_times_and_poses_that_do_not_fit_each_other_are_a_bug(tmp_path: Path) -> None:
    path = {"utime": [0, 1], "poses": [[0.0, 0.0, 0.0]], "clock": OWN}
    with pytest.raises(ValueError):
        write(tmp_path, answer({"0": path}))


def evo_truth(robot: int) -> PoseTrajectory3D:
    """As a motion capture of 500 Hz records it, whose clock shows UNIX time; evo takes the nearest
    of its poses for each of ours."""
    trail = team_answers.recording().trails[robot]
    t = np.arange(trail.t[0], trail.t[-1], 0.002)
    poses = metrics.at_times(trail.t, trail.truth, t)
    half = poses[:, 2] / 2
    nothing = np.zeros(len(half))
    return PoseTrajectory3D(
        positions_xyz=np.column_stack([poses[:, :2], nothing]),
        orientations_quat_wxyz=np.column_stack([np.cos(half), nothing, nothing, np.sin(half)]),
        timestamps=team_answers.BEGAN_US / 1e6 + t,
    )


@pytest.mark.parametrize("robot", [0, 1, 2])
def test_evo_finds_the_error_that_we_find(robot: int, tmp_path: Path) -> None:
    """Clocks of these robots are hours from UNIX time and drift by tens of ppm; ours is computed
    with the clocks that the simulator gave them."""
    told = team_answers.answers()["trajectory"]
    write(tmp_path, told)
    found = file_interface.read_tum_trajectory_file(tmp_path / f"robot{robot}.txt")
    assert found.num_poses == len(told["robots"][str(robot)]["utime"]) > 30
    truth, matched = sync.associate_trajectories(evo_truth(robot), found, max_diff=0.002)
    assert matched.num_poses > 0.9 * found.num_poses
    matched.align(truth)
    ape = evo_metrics.APE(evo_metrics.PoseRelation.translation_part)
    ape.process_data((truth, matched))
    by_evo = ape.get_statistic(evo_metrics.StatisticsType.rmse)

    clock = team_answers.team().member(robot).clock
    trail = team_answers.recording().trails[robot]
    path = told["robots"][str(robot)]
    t = np.array([clock.world(utime) / 1e6 for utime in path["utime"]])
    poses = np.array(path["poses"])
    true = metrics.at_times(trail.t, trail.truth, t)
    same = {robot: np.zeros(len(t))}
    aligned = metrics.aligned({robot: poses}, {robot: true}, same)
    by_us = metrics.errors(aligned, {robot: true}, robot)["ate_rmse_m"]
    assert 0.01 < by_us < 0.2
    assert by_evo == pytest.approx(by_us, abs=1e-3)
