"""What all verbs have in common."""

from __future__ import annotations

from pathlib import Path

import pytest

from drslamd.cli.parser import Parser, configured_verb, load, verb
from drslamd.config import ConfigError


def parser() -> Parser:
    made = Parser(prog="drslamd")
    verbs = made.add_subparsers(required=True)
    verb(verbs, "fly", lambda _: 5, "take off", "  drslamd fly")
    configured_verb(verbs, "land", lambda _: 6, "come down")
    return made


def test_a_verb_knows_its_action() -> None:
    options = parser().parse_args(["fly"])
    assert options.verb(options) == 5


def test_the_help_of_a_verb_ends_with_its_examples(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parser().parse_args(["fly", "--help"])
    said = capsys.readouterr().out
    assert "Take off." in said
    assert said.endswith("examples:\n  drslamd fly\n")


def test_a_configured_verb_cannot_do_without_its_file(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        parser().parse_args(["land"])
    assert ended.value.code == 64
    assert "--config" in capsys.readouterr().err
    assert parser().parse_args(["land", "-c", "x"]).config == "x"


def test_a_file_that_is_no_text_is_a_fault_of_the_configuration(tmp_path: Path) -> None:
    path = tmp_path / "3.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="not a text file"):
        load(str(path))
