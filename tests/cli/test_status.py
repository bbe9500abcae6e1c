"""``drslamd status``."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from status_answers import answering

from drslamd import cli


@pytest.fixture
def short_socket(config: Path) -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as short:
        path = Path(short) / "s"
        config.write_text(config.read_text() + f'status_socket = "{path}"\n')
        yield path


def test_it_says_first_why_there_is_no_pose(
    short_socket: Path, config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = {"problems": ["no other robot is heard"]}
    with answering(short_socket, answer, "status"):
        assert cli.main(["status", "-c", str(config), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == answer
