"""How far a long run is."""

from __future__ import annotations

import pytest
from lab import progress


def test_progress_is_a_bar_on_a_terminal_and_few_lines_elsewhere(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    quiet = progress.Progress("2 robots", 80.0)
    for second in range(81):
        quiet(float(second))
    quiet.end()
    assert capsys.readouterr().err == "2 robots 0/80 s\n"
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    bar = progress.Progress("2 robots", 80.0)
    bar(40.0)
    bar(90.0)
    bar.end()
    half, full = capsys.readouterr().err.split("\r")[1:]
    assert half == f"[{'#' * 15}{'.' * 15}] 2 robots 40/80 s"
    assert full == f"[{'#' * 30}] 2 robots 90/80 s\n"
