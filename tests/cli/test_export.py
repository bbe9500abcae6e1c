"""`drslamd export`: what it asks, what it writes, what it ends with."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import team_answers
from status_answers import WITHOUT_DEVICES, answering_all

from drslamd import cli
from drslamd.cli.exit_codes import CANNOT_CREATE, OK, UNAVAILABLE, USAGE


@pytest.fixture
def socket() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as short:
        yield Path(short) / "s"


def export(socket: Path, to: Path, answers: dict[str, Any], *formats: str) -> int:
    config = to.parent / "1.toml"
    config.write_text(WITHOUT_DEVICES.format(robot=1, socket=socket))
    with answering_all(socket, answers):
        return cli.main(["export", "-c", str(config), "--to", str(to), "--format", *formats])


@pytest.mark.slow
def test_all_formats_at_once_print_each_file_once(
    socket: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    to = tmp_path / "new" / "out"
    to.parent.mkdir()
    told = team_answers.answers()
    assert export(socket, to, told, "tum", "g2o", "pyfg", "csv", "mcap", "csv") == OK
    said = capsys.readouterr()
    assert said.err == ""
    printed = [Path(line) for line in said.out.splitlines()]
    assert {path.name for path in printed} == {
        *(f"robot{robot}.txt" for robot in (0, 1, 2)),
        *("graph.g2o", "graph.pyfg", "team.mcap"),
        *(f"{t}.csv" for t in ("keyframes", "odometry", "closures", "ranges", "windows", "poses")),
    }
    assert set(to.iterdir()) == set(printed)


def test_a_format_that_cannot_be_written_keeps_no_other_from_being_written_and_named(
    socket: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    to = tmp_path / "out"  # no place of this team is known by longitude and latitude
    code = export(socket, to, team_answers.answers(), "g2o", "geojson", "tum")
    said = capsys.readouterr()
    assert code == UNAVAILABLE
    assert {path.name for path in to.iterdir()} == {Path(line).name for line in said.out.split()}
    assert {"graph.g2o", "robot1.txt"} <= {path.name for path in to.iterdir()}
    assert len(said.err.splitlines()) == 1
    assert "[[beacon]]" in said.err


@pytest.mark.slow
def test_a_wall_clock_that_nobody_sets_is_said_and_what_to_do(
    socket: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = team_answers.answers()
    told["graph"]["wall"]["uncertainty_us"] = None
    assert export(socket, tmp_path / "out", told, "g2o") == OK
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith("nobody sets this host's wall clock")
    assert "chrony" in said


def test_only_what_a_format_needs_is_asked(socket: Path, tmp_path: Path) -> None:
    told = team_answers.answers()
    assert export(socket, tmp_path / "out", {"trajectory": told["trajectory"]}, "tum") == OK


def test_a_robot_that_is_not_localised_says_so_and_spoils_nothing(
    socket: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert export(socket, out, team_answers.answers(), "tum", "g2o") == OK
    before = {path: path.read_bytes() for path in out.iterdir()}
    capsys.readouterr()
    assert export(socket, out, team_answers.unlocalised(), "tum", "g2o") == OK
    said = capsys.readouterr()
    assert said.err == "this robot is not localised: there are no paths and no graph yet\n"
    assert said.out == ""
    assert {path: path.read_bytes() for path in out.iterdir()} == before


def test_a_daemon_that_does_not_know_the_question_is_an_older_one(
    socket: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export(socket, tmp_path / "out", {"status": {}}, "csv") == UNAVAILABLE
    assert "older version" in capsys.readouterr().err


def test_no_daemon_and_no_folder_are_sentences(
    socket: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "1.toml"
    config.write_text(WITHOUT_DEVICES.format(robot=1, socket=socket))
    arguments = ["export", "-c", str(config), "--to", str(tmp_path), "--format", "csv"]
    assert cli.main(arguments) == UNAVAILABLE
    assert "no daemon answers" in capsys.readouterr().err
    (tmp_path / "file").write_text("")
    code = export(socket, tmp_path / "file", team_answers.answers(), "csv")
    assert code == CANNOT_CREATE
    said = capsys.readouterr().err
    assert said == f"{tmp_path}/file: File exists; it is not written over: name another one\n"


def test_an_unknown_format_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(["export", "-c", "x", "--to", "y", "--format", "bag"])
    assert ended.value.code == USAGE
    assert "invalid choice: 'bag'" in capsys.readouterr().err
