"""Asking a daemon that does not run."""

from __future__ import annotations

from pathlib import Path

import pytest

from drslamd import cli
from drslamd.cli import exit_codes


@pytest.mark.parametrize("verb", ["status", "trajectory"])
def test_asking_when_no_daemon_runs_ends_with_69(
    verb: str, config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([verb, "-c", str(config)]) == exit_codes.UNAVAILABLE == 69
    assert "no daemon answers at" in capsys.readouterr().err
