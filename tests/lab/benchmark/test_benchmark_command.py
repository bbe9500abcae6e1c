"""The command line of tools/benchmark: what is compared, what is missing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from lab.benchmark import __main__ as command
from lab.benchmark import graphs, timing
from lab.benchmark.rows import Peer, Row
from lab.files import CANNOT_WRITE, keep


def row(value: float, peer: float = 10.0, unit: str = "ms", work: str = "some") -> Row:
    return Row(1, work, value, unit, 5.0, None, (Peer("other", peer, True), Peer("far", 9, False)))


class Fake:
    """A part that takes no time."""

    def __init__(self, value: float) -> None:
        self.value = value

    def rows(self, quick: bool) -> Iterator[Row]:
        assert quick
        yield row(self.value)


@pytest.fixture
def part(monkeypatch: pytest.MonkeyPatch) -> Fake:
    fake = Fake(2.0)
    monkeypatch.setattr(command, "PARTS", {"1": fake})
    monkeypatch.setattr(timing, "pin", lambda: None)
    return fake


def test_what_became_worse_is_said_and_ends_with_1(
    part: Fake, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stored = tmp_path / "stored.json"
    assert command.main(["--quick", "--json", str(stored)]) == 0
    assert command.main(["--quick", "--check", str(stored)]) == 0
    part.value = 4.0
    capsys.readouterr()
    assert command.main(["--quick", "--check", str(stored)]) == 1
    said = capsys.readouterr()
    assert "| 1 | some | 4 ms |" in said.out
    assert "worse: 1 some [ms]: 2.50 times as fast as other, was 5.00" in said.err


class Interrupted(Fake):
    """A part that is ended after its first row."""

    def rows(self, quick: bool) -> Iterator[Row]:
        yield row(self.value)
        raise KeyboardInterrupt


def test_rows_that_were_measured_outlive_a_run_that_is_ended(
    part: Fake, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    stored, unfinished = tmp_path / "now.json", tmp_path / "now-unfinished.json"
    asked = ["--quick", "--json", str(stored)]
    monkeypatch.setattr(command, "PARTS", {"1": part, "2": Interrupted(3.0)})
    with pytest.raises(KeyboardInterrupt):
        command.main(asked)
    assert not stored.exists()
    assert [r["value"] for r in json.loads(unfinished.read_text())["rows"]] == [2.0, 3.0]
    monkeypatch.setattr(command, "PARTS", {"1": part})
    assert command.main(asked) == 0
    assert not unfinished.exists()


def test_rows_stay_where_the_result_cannot_be_written(
    part: Fake, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    stored = tmp_path / "now.json"

    def full(path: Path, content: str) -> int:
        return CANNOT_WRITE if path == stored else keep(path, content)

    monkeypatch.setattr(command, "keep", full)
    assert command.main(["--quick", "--json", str(stored)]) == CANNOT_WRITE
    assert (tmp_path / "now-unfinished.json").exists()


@pytest.mark.parametrize("content", [None, "", "{}", '{"rows": [{"module": 1}]}'])
def test_a_file_that_is_none_of_ours_cannot_be_compared(
    part: Fake, tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str | None
) -> None:
    path = tmp_path / "x.json"
    if content is not None:
        path.write_text(content)
    assert command.main(["--quick", "--check", str(path)]) == 66
    assert "no results of tools/benchmark" in capsys.readouterr().err


def test_missing_graphs_are_said_in_one_sentence(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(graphs, "FOLDER", tmp_path)
    monkeypatch.setattr(timing, "pin", lambda: None)
    assert command.main(["--quick", "--module", "3"]) == 66
    assert "DRSLAMD_POSEGRAPHS" in capsys.readouterr().err


def test_without_graphs_all_but_module_3_is_measured(
    part: Fake, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(graphs, "FOLDER", tmp_path / "none")
    monkeypatch.setattr(command, "PARTS", {"1": part, "3": None})
    assert command.main(["--quick"]) == 0
    assert "module 3 is left out" in capsys.readouterr().err
