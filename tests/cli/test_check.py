"""``drslamd check``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drslamd import cli
from drslamd.cli import exit_codes
from drslamd.config import parse

NO_KEY = 'insecure = true\ntrust_everyone_on = "239.255.76.67"'


def test_it_ends_with_a_verdict_and_a_warning_leaves_the_exit_code_of_a_run(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["check", "-c", str(config)]) == exit_codes.OK
    *warnings, verdict = capsys.readouterr().out.splitlines()
    assert warnings[0].startswith(f"{config}: warning: uwb: missing: /dev/none: ")
    assert all(line.startswith(f"{config}: warning: ") for line in warnings)
    assert verdict.startswith("verdict: run starts, and waits or goes without (")


def test_a_configuration_that_cannot_be_used_is_a_finding_like_others(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config.write_text(config.read_text().replace("id = 3", "id = 999").replace("0.4", "-4"))
    assert cli.main(["check", "-c", str(config)]) == exit_codes.BAD_CONFIG == 78
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith(f"{config}: robot.id = 999: ")
    assert said[1].startswith(f"{config}: wheels.track_m = -4: ")
    assert said[2:] == ["verdict: run refuses to start, exit code 78"]


def test_what_a_program_reads_says_the_same(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config.write_text(config.read_text().replace(NO_KEY, 'key_file = "no.key"'))
    assert cli.main(["check", "-c", str(config), "--json"]) == exit_codes.BAD_CONFIG
    answer = json.loads(capsys.readouterr().out)
    assert answer["exit_code"] == exit_codes.BAD_CONFIG
    assert answer["verdict"] == "verdict: run refuses to start, exit code 78"
    first = answer["findings"][0]
    assert (first["check"], first["severity"]) == ("team key", "error")
    assert first["cause"].startswith("team.key_file = ")
    assert "drslamd keygen" in first["remedy"]


def test_config_only_prints_the_effective_configuration_as_it_could_stand_in_the_file(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["check", "-c", str(config), "--config-only"]) == 0
    printed = capsys.readouterr().out
    assert "tau = 50" in printed
    assert parse(printed) == parse(config.read_text()).model_copy(
        update={"uwb": parse(printed).uwb}
    )
    assert parse(printed).uwb.id == 3


def test_the_effective_configuration_speaks_json(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["check", "-c", str(config), "--config-only", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["optimizer"]["rank"] == 5


def test_config_only_refuses_what_cannot_be_used_on_its_standard_error(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config.write_text(config.read_text().replace("id = 3", "id = 999"))
    assert cli.main(["check", "-c", str(config), "--config-only"]) == exit_codes.BAD_CONFIG
    assert capsys.readouterr().err.startswith(f"{config}: robot.id = 999: ")


def test_a_missing_file_ends_with_78(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", "-c", "/nowhere/3.toml"]) == 78
    first, verdict = capsys.readouterr().out.splitlines()
    assert first.startswith("/nowhere/3.toml: No such file or directory; ")
    assert verdict == "verdict: run refuses to start, exit code 78"
