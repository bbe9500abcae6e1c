"""``drslamd feed``: what it says when it cannot."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from drslamd import cli


def test_without_a_daemon_it_says_so(config: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    assert cli.main(["feed", "mavlink", "-c", str(config)]) == 69
    assert "is drslamd running for this configuration?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("kind", "module"),
    [("mavlink", "pymavlink"), ("foxglove", "foxglove"), ("dimos", "dimos_lcm")],
)
def test_without_its_package_it_names_it(
    config: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
    module: str,
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    for name in [name for name in sys.modules if name.startswith(f"{module}.")]:
        monkeypatch.setitem(sys.modules, name, None)
    assert cli.main(["feed", kind, "-c", str(config)]) == 69
    assert f'pip install "drslamd[{kind}]"' in capsys.readouterr().err


@pytest.mark.parametrize("to", ["nowhere", ":14550", "host:0", "host:65536", "host:x"])
def test_a_place_that_is_none_is_wrong_usage(
    config: Path, capsys: pytest.CaptureFixture[str], to: str
) -> None:
    assert cli.main(["feed", "mavlink", "-c", str(config), "--to", to]) == 64
    assert f"--to {to}: must be HOST:PORT" in capsys.readouterr().err


def test_a_file_that_cannot_be_made_is_one_sentence(
    config: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pytest.importorskip("mcap", reason="mcap is not installed")
    there = str(tmp_path / "no" / "run.mcap")
    assert cli.main(["feed", "ros2", "-c", str(config), "--mcap", there]) == 73
    assert "No such file" in capsys.readouterr().err
