"""``drslamd init`` in a process of its own, with devices that speak on pseudo-terminals."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from places import REPOSITORY
from speaking_ports import SpeakingPort, kobuki, linktrack, roboteq, while_speaking

from drslamd import cli
from drslamd.cli.exit_codes import CANNOT_CREATE, OK, USAGE
from drslamd.config import parse


class Said(NamedTuple):
    code: int
    out: str
    err: str


def init(ports: list[SpeakingPort], *flags: str) -> Said:
    """What it says of these ports alone."""
    look_at = [word for port in ports for word in ("--port", port.path)]

    async def run() -> Said:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "drslamd", "init", *look_at, *flags),
            cwd=REPOSITORY,
            env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        out, err = await process.communicate()
        assert process.returncode is not None
        return Said(process.returncode, out.decode(), err.decode())

    return while_speaking(ports, run)


def both(folder: Path) -> list[SpeakingPort]:
    return [linktrack(folder / "uwb", 7, 460_800), kobuki(folder / "base")]


@pytest.mark.slow
def test_what_is_plugged_in_becomes_a_file_that_check_takes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, key = tmp_path / "7.toml", tmp_path / "team.key"
    ports = both(tmp_path)
    said = init(ports, "-c", str(file), "--new-key", str(key), "--interface", "lo")
    assert said.code == OK, said.err
    assert f"next: drslamd check -c {file}" in said.out
    config = parse(file.read_text())
    assert (config.robot.id, config.uwb.port, config.uwb.baud) == (7, ports[0].path, 460_800)
    assert config.wheels.source == "kobuki"
    assert config.wheels.port == ports[1].path
    assert config.team.key_file == str(key)
    assert all(port.written == b"" for port in ports)
    assert cli.main(["check", "-c", str(file)]) == OK
    capsys.readouterr()


@pytest.mark.slow
def test_a_program_is_told_what_was_found_and_nothing_is_written(tmp_path: Path) -> None:
    file = tmp_path / "7.toml"
    flags = ("--json", "--dry-run", "--insecure", "--interface", "lo", "-c", str(file))
    said = init(both(tmp_path), *flags)
    answer = json.loads(said.out)
    assert said.code == OK
    uwb, wheels = answer["ports"]
    assert (uwb["device"], uwb["uwb_id"], uwb["baud"]) == ("linktrack", 7, 460_800)
    assert wheels["base"] == "kobuki"
    assert not answer["written"]
    assert parse(answer["toml"]).robot.id == 7
    assert not file.exists()


@pytest.mark.slow
def test_a_silent_base_needs_leave_to_be_asked_and_its_keys(tmp_path: Path) -> None:
    flags = ("--dry-run", "--insecure", "--interface", "lo")
    ports = [linktrack(tmp_path / "a", 7), roboteq(tmp_path / "b")]
    said = init(ports, *flags)
    assert said.code == USAGE
    assert "no base speaks at" in said.err
    assert ports[1].written == b""
    ports = [linktrack(tmp_path / "c", 7), roboteq(tmp_path / "d")]
    said = init(ports, *flags, "--base", "roboteq", "--allow-write", "--wheel", "track_m=0.5")
    assert said.code == USAGE
    assert said.err.splitlines()[-1] == (
        "drslamd init: a roboteq base needs counts_per_metre; "
        "say it with --wheel counts_per_metre=VALUE"
    )
    assert ports[0].written == b""
    assert b"?C" in ports[1].written


def flagged(*flags: str) -> list[str]:
    """With no port to listen to for long."""
    return ["init", "--port", "/dev/none", "--uwb-port", "/dev/none", "--interface", "lo", *flags]


BASE = ("--base", "kobuki", "--wheels-port", "/dev/none2")


def test_a_file_is_not_overwritten_unasked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "3.toml"
    file.write_text("mine")
    flags = flagged("--id", "3", *BASE, "--insecure", "-c", str(file))
    assert cli.main(flags) == CANNOT_CREATE
    said = capsys.readouterr().err.splitlines()[-1]
    assert said == f"drslamd init: {file}: it exists; overwrite it with --force"
    assert file.read_text() == "mine"
    assert cli.main([*flags, "--force"]) == OK
    assert parse(file.read_text()).robot.id == 3


@pytest.mark.parametrize(
    ("flags", "sentence"),
    [
        (("--id", "255"), "--id 255: 0 to 254"),
        (("--wheel", "track_m"), "--wheel track_m: KEY=VALUE, such as track_m=0.5"),
        (("--id", "3", *BASE, "--key", "/none/team.key"), "'/none/team.key'"),
        (("--id", "3", *BASE, "--new-key", "/etc/hostname"), "it exists; name it with --key"),
        (
            ("--id", "3", *BASE, "--insecure", "--wheel", "track_m=-1"),
            "wheels.track_m = -1: a numb",
        ),
        (("--id", "3", *BASE, "--insecure", "--wheel", "trak_m=1"), "did you mean track_m?"),
        ((*BASE, "--insecure"), "which robot of the team this is nobody can see; say it with --id"),
        (("--id", "3", *BASE), "--key FILE, --new-key FILE or --insecure"),
        (("--id", "3", "--insecure"), "--base (kobuki, roboteq"),
    ],
)
def test_what_cannot_be_meant_or_is_missing_is_one_sentence(
    flags: tuple[str, ...], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "3.toml"
    assert cli.main(flagged(*flags, "-c", str(file))) == USAGE
    said = capsys.readouterr()
    assert sentence in said.err.splitlines()[-1]
    assert said.out == ""
    assert not file.exists()
