"""The command line of tools/reproduce: it goes on where it stopped, and says what is missed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from lab.bound import efficiency
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


@pytest.mark.parametrize(("square", "code"), [(1.11, 0), (1.12, 1)])
def test_efficiency_is_reached_at_nine_tenths_of_who_is_told_all(
    square: float,
    code: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """What chance does to the bound over a mean square error of one seed decides nothing."""
    tally = Tally()
    for row in efficiency.ROWS:
        for unit in efficiency.UNITS:
            name = f"efficiency/3/0/{row}/{unit}"
            for what, value in (("bound", 0.25), ("told", 1.0), ("square", square)):
                tally.add(f"{name}/{what}", value)
    asked: list[int] = []

    def pieces(seeds: int, teams: object = None) -> list[plan.Piece]:
        asked.append(seeds)
        return [plan.Piece("piece", 1.0, lambda: tally)]

    monkeypatch.setattr(plan, "efficient", pieces)
    assert command.main(["--efficiency", "--seeds", "3", "--out", str(tmp_path)]) == code
    assert asked[-1] == 3
    page = (tmp_path / "results.md").read_text()
    assert "| 3 | 0% | live | 1 | 0.500 | 1.000 |" in page
    assert page in capsys.readouterr().out
