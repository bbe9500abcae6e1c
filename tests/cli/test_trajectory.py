"""`drslamd trajectory` asks a robot that has driven, and its files are what evo reads."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lab.recordings import world
from lab.score import metrics
from scipy.spatial.transform import Rotation
from status_answers import WITHOUT_DEVICES, answering
from teams import EASY, VirtualTeam

from drslamd import cli, report

SCENE = world.Scene(
    robots=2, seconds=40.0, ranges=EASY.ranges, odometry=EASY.odometry, odometry_hz=20, range_hz=10
)


@pytest.fixture(scope="module")
def team() -> VirtualTeam:
    team = VirtualTeam(SCENE, seed=3)
    team.run(SCENE.seconds + 3.0)
    return team


@pytest.fixture
def config(tmp_path: Path) -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as short:
        path = tmp_path / "1.toml"
        path.write_text(WITHOUT_DEVICES.format(robot=1, socket=Path(short) / "s"))
        yield path


def told(team: VirtualTeam) -> Any:
    """By robot 1, whose host's wall clock shows the time of the recording."""
    member, now = team.member(1), team.simulator.now
    utime = member.clock.local(now)
    wall = {"utc_minus_clock_us": now - utime, "uncertainty_us": 0}
    return {**report.trajectories(member.robot, utime), "wall": wall}


def ask(config: Path, answer: Any, *arguments: str) -> int:
    socket = Path(config.read_text().rpartition("status_socket = ")[2].strip().strip('"'))
    with answering(socket, answer):
        return cli.main(["trajectory", "-c", str(config), *arguments])


def test_it_prints_everybodys_path_as_json(
    team: VirtualTeam, config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = told(team)
    assert ask(config, answer) == 0
    assert json.loads(capsys.readouterr().out) == answer
    assert answer["frame"] == 0
    assert set(answer["robots"]) == {"0", "1"}


def test_tum_files_hold_the_paths_in_one_frame(
    team: VirtualTeam, config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Read as other tools read them; own path at 10 Hz; one SE(2) brings both onto the truth."""
    out = tmp_path / "new" / "tum"
    assert ask(config, told(team), "--tum", str(out)) == 0
    files = {robot: out / f"robot{robot}.txt" for robot in (0, 1)}
    assert capsys.readouterr().out.split() == [str(path) for path in files.values()]
    found, true = {}, {}
    for robot, path in files.items():
        table = np.loadtxt(path)
        assert table.shape[1] == 8
        assert (np.diff(table[:, 0]) > 0).all()
        yaw = Rotation.from_quat(table[:, 4:]).as_euler("zyx")
        assert np.abs(np.column_stack([table[:, 3], yaw[:, 1:]])).max() < 1e-6
        trail, t = team.recording.trails[robot], table[:, 0]
        found[robot] = np.column_stack([table[:, 1:3], yaw[:, 0]])
        true[robot] = metrics.at_times(trail.t, trail.truth, t)
        if robot == 1:
            assert np.diff(t) == pytest.approx(0.1, abs=1e-6)
            assert t[-1] > 39.0
    same = {robot: np.zeros(len(poses)) for robot, poses in found.items()}
    errors = metrics.team_errors(metrics.aligned(found, true, same), true)["team"]
    assert errors["ate_rmse_m"] < 0.1
    assert errors["rot_mean_deg"] < 3.0


def test_who_is_not_localised_yet_has_no_files(
    config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lonely = VirtualTeam(SCENE, on=(1,))
    lonely.run(1.0)
    answer = told(lonely)
    assert (answer["frame"], answer["robots"]) == (None, {})
    assert ask(config, answer, "--tum", str(tmp_path / "tum")) == 0
    assert capsys.readouterr().out == ""


def test_a_folder_that_cannot_be_made_ends_with_73(
    team: VirtualTeam, config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    answer = told(team)
    assert ask(config, answer, "--tum", str(tmp_path / "file" / "tum")) == 73
    assert "Not a directory; a file stands where a folder should be" in capsys.readouterr().err
