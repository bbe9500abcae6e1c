"""``drslamd check``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drslamd import cli
from drslamd.config import parse


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


def test_a_missing_file_ends_with_78(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", "-c", "/nowhere/3.toml"]) == 78
    assert capsys.readouterr().err == "/nowhere/3.toml: No such file or directory\n"
