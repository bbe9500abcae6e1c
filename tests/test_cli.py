"""The command line: help with examples, sentences, exit codes, JSON."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from drslamd import cli
from drslamd.config import parse

TOML = """
[robot]
id = 3
[team]
insecure = true
[uwb]
port = "/dev/none"
[wheels]
source = "roboteq"
port = "/dev/none"
counts_per_metre = 1000
track_m = 0.4
[daemon]
state_dir = "STATE"
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "3.toml"
    path.write_text(TOML.replace("STATE", str(tmp_path / "state")))
    return path


def test_help_has_examples_and_the_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(["--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    for word in ("examples:", "drslamd run -c", "keygen", "exit codes:", "78"):
        assert word in text


@pytest.mark.parametrize("arguments", [[], ["fly"], ["run"], ["status", "--jsn"]])
def test_wrong_usage_ends_with_64_and_says_what_is_wrong(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(arguments)
    assert ended.value.code == cli.USAGE == 64
    assert "drslamd" in capsys.readouterr().err


def test_check_prints_the_effective_configuration_as_it_could_stand_in_the_file(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["check", "-c", str(config)]) == 0
    printed = capsys.readouterr().out
    assert "tau = 50" in printed
    assert parse(printed) == parse(config.read_text()).model_copy(
        update={"uwb": parse(printed).uwb}
    )
    assert parse(printed).uwb.id == 3


def test_check_speaks_json(config: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", "-c", str(config), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["optimizer"]["rank"] == 5


@pytest.mark.parametrize("verb", ["run", "check", "status", "trajectory"])
def test_a_bad_configuration_ends_with_78_and_one_sentence_per_fault(
    verb: str, config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config.write_text(config.read_text().replace("id = 3", "id = 999").replace("0.4", "-4"))
    assert cli.main([verb, "-c", str(config)]) == cli.BAD_CONFIG == 78
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 2
    assert said[0].startswith(f"{config}: robot.id = 999: ")
    assert said[1].startswith(f"{config}: wheels.track_m = -4: ")


def test_a_missing_file_ends_with_78(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", "-c", "/nowhere/3.toml"]) == 78
    assert capsys.readouterr().err == "/nowhere/3.toml: No such file or directory\n"


@pytest.mark.parametrize("verb", ["status", "trajectory"])
def test_asking_when_no_daemon_runs_ends_with_69(
    verb: str, config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([verb, "-c", str(config)]) == cli.UNAVAILABLE == 69
    assert "no daemon answers at" in capsys.readouterr().err


def test_keygen_makes_a_key_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "team.key"
    assert cli.main(["keygen", str(path)]) == 0
    assert len(path.read_text().strip()) == 64
    assert "copy it to every robot" in capsys.readouterr().out
    assert cli.main(["keygen", str(path)]) == cli.CANNOT_CREATE == 73
    assert "never overwritten" in capsys.readouterr().err


def test_the_module_can_be_run() -> None:
    answer = subprocess.run(
        [sys.executable, "-m", "drslamd", "--version"], capture_output=True, text=True, check=True
    )
    assert answer.stdout.startswith("drslamd ")
