"""The command line of tools/reproduce: it goes on where it stopped, and says what is missed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from lab.reproduce import __main__ as command
from lab.reproduce import pictures, plan
from lab.reproduce.tally import Tally
from reproduce_totals import good


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> Callable[[Tally], list[str]]:
    """Makes the command do one small piece of work; the list tells how often it did."""
    done: list[str] = []

    def install(tally: Tally) -> list[str]:
        def run() -> Tally:
            done.append("piece")
            return tally

        monkeypatch.setattr(plan, "quick", lambda: [plan.Piece("piece", 1.0, run)])
        monkeypatch.setattr(pictures, "draw", lambda total, folder: [])
        return done

    return install


def test_the_command_goes_on_where_it_stopped(
    small: Callable[[Tally], list[str]], tmp_path: Path
) -> None:
    done = small(good())
    assert command.main(["--quick", "--out", str(tmp_path)]) == 0
    assert command.main(["--quick", "--out", str(tmp_path)]) == 0
    assert done == ["piece"]
    results = json.loads((tmp_path / "results.json").read_text())
    assert all(check["ok"] for check in results["verdict"])
    assert results["figures"]["odometry/m"]["mean"] == pytest.approx(0.85)
    assert "Table II" in (tmp_path / "results.md").read_text()


def test_the_command_fails_when_something_is_not_reached(
    small: Callable[[Tally], list[str]], tmp_path: Path
) -> None:
    bad = good()
    bad.add("drslamd/after/m", 5.0)
    small(bad)
    assert command.main(["--quick", "--out", str(tmp_path)]) == 1
    results = json.loads((tmp_path / "results.json").read_text())
    assert not all(check["ok"] for check in results["verdict"])
