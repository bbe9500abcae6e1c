"""tools/soak: what it plays, what it writes down, where it goes on."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from lab.soak import __main__ as soak
from lab.soak import results
from lab.soak.run import Figures, Result
from lab.soak.scenarios import SCENARIOS, scenario_of


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Runs that would have been played; seed 2 fails."""
    found: list[tuple[str, int]] = []

    def run(name: str, seed: int, until_s: float = 0.0, journal: bool = True) -> Result:
        found.append((name, seed))
        fault = "P4: planted" if seed == 2 else ""
        return Result(scenario_of(name, seed), seed, Figures(healed_s=5.0), "d", fault, 61.25)

    monkeypatch.setattr(soak, "run", run)
    monkeypatch.setattr(soak, "commit", lambda: "abc")
    monkeypatch.setattr("lab.soak.run.commit", lambda: "abc")
    return found


def test_runs_are_written_down_and_a_second_call_plays_none_of_them_again(
    played: list[tuple[str, int]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "soak.jsonl"
    arguments = ["parted", "--seeds", "2", "--jobs", "1", "--results", str(path)]
    assert soak.main(arguments) == soak.BROKEN
    assert played == [("parted", 1), ("parted", 2)]
    said = capsys.readouterr().out
    assert "FAIL parted seed=2 commit=abc t=61.250 P4: planted" in said
    assert "repeat: tools/soak parted --seed 2 --until 61.251" in said
    with path.open("a") as file:
        file.write('{"scenario": "cut in the mid')
    assert soak.main([*arguments[:2], "3", *arguments[3:]]) == 0
    assert played[2:] == [("parted", 3)]


def test_one_seed_is_written_nowhere(played: list[tuple[str, int]], tmp_path: Path) -> None:
    path = tmp_path / "soak.jsonl"
    assert soak.main(["mixed", "--seed", "2", "--results", str(path)]) == soak.BROKEN
    assert soak.main(["mixed", "--seed", "3", "--results", str(path)]) == 0
    assert not path.exists()


def test_a_scenario_that_is_none_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        soak.main(["patred"])
    assert "no scenario 'patred'" in capsys.readouterr().err


def test_all_scenarios_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert soak.main(["--list"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(SCENARIOS)


def test_the_page_says_how_many_runs_failed_and_what_every_hour_was_like() -> None:
    ran = {"scenario": "parted", "seed": 1, "commit": "abc", "fault": "", "figures": {}}
    figures = {"healed_s": 9.0, "liars": 0}
    rows = [{**ran, "figures": figures}, {**ran, "fault": "P4", "figures": figures}]
    hour: dict[str, object] = {
        "hour": 1,
        "took_s": 9.5,
        "rss_mb": 80.0,
        "descriptors": 4,
        "solve_ms": 2.0,
    }
    hour |= {"pair_rms_m": 0.1, "entries": 7, "sitting": 2, "commit": "abc"}
    earlier_day = {**hour, "took_s": 8.5}
    page = "\n".join(results.page(json.loads(json.dumps([*rows, earlier_day, hour]))))
    assert "8.5" not in page
    assert "| parted | one robot cut off | 2 | 1 | 9 | 0 |" in page
    assert "* 1 x parted: P4" in page
    assert "| 1 | 9.5 | 2 | 80.0 | 4 | 2.0 | 0.1 | 7 |" in page
