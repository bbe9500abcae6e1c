"""``drslamd keygen``."""

from __future__ import annotations

from pathlib import Path

import pytest

from drslamd import cli
from drslamd.cli import exit_codes


def test_keygen_makes_a_key_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "team.key"
    assert cli.main(["keygen", str(path)]) == 0
    assert len(path.read_text().strip()) == 64
    assert "copy it to every robot" in capsys.readouterr().out
    assert cli.main(["keygen", str(path)]) == exit_codes.CANNOT_CREATE == 73
    there = f"{path}: File exists; it is not written over: name another one\n"
    assert capsys.readouterr().err == there
    deep = tmp_path / "no" / "team.key"
    assert cli.main(["keygen", str(deep)]) == 73
    assert f"make its folder first: mkdir -p {deep.parent}" in capsys.readouterr().err
