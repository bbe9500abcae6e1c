"""The command line: help with examples, sentences, exit codes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from drslamd import cli
from drslamd.cli import exit_codes


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
    assert ended.value.code == exit_codes.USAGE == 64
    assert "drslamd" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["run", "status", "trajectory", "calibrate"])
def test_a_bad_configuration_ends_with_78_and_one_sentence_per_fault(
    verb: str, config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config.write_text(config.read_text().replace("id = 3", "id = 999").replace("0.4", "-4"))
    assert cli.main([verb, "-c", str(config)]) == exit_codes.BAD_CONFIG == 78
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 2
    assert said[0].startswith(f"{config}: robot.id = 999: ")
    assert said[1].startswith(f"{config}: wheels.track_m = -4: ")


def test_an_output_that_takes_no_more_ends_with_73(config: Path) -> None:
    program = [sys.executable, "-m", "drslamd", "check", "--config-only", "-c", str(config)]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(program, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == exit_codes.CANNOT_CREATE == 73
    assert len(done.stderr.splitlines()) == 1


def test_the_module_can_be_run() -> None:
    answer = subprocess.run(
        [sys.executable, "-m", "drslamd", "--version"], capture_output=True, text=True, check=True
    )
    assert answer.stdout.startswith("drslamd ")
