"""Module 3 against its centralised optimum: the table, and what counts as reached."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from lab.benchmark import graphs
from lab.play.block_team import Descent
from lab.reproduce import __main__ as command
from lab.reproduce import rbcd_table
from lab.reproduce.rbcd_table import HEAD, LOSS, Line, line
from places import SHARED

DATA = SHARED / "data"


def fallen(*costs: float, at_rest: bool = True) -> Descent:
    return Descent(list(costs), None, at_rest=at_rest, megabytes=0.5)


GOOD = fallen(np.inf, 200.0, 100.5, 100.00001)


def test_a_line_says_what_was_reached() -> None:
    made = line("some graph", 0.0, GOOD, 100.0, (0.052, 0.05), 1.25)
    assert made.is_reached
    said = dict(zip(HEAD, made.cells, strict=True))
    assert said["ATE m"] == "0.0520"
    assert said["ratio"] == "1.040"
    assert (said["to 1 %"], said["to 1e-6"], said["at rest"]) == ("3", "4", "4")
    assert (said["rise"], said["MB"]) == ("0", "1.25")


@pytest.mark.parametrize(
    ("down", "ates"),
    [
        (fallen(200.0, 100.5, 100.00001, 100.6, 100.00001), None),
        (fallen(200.0, 100.5, 100.00001, at_rest=False), None),
        (fallen(*[200.0] * 40, 100.00001), None),
        (fallen(*[100.5] * 350, 100.00001), None),
        (fallen(100.5), None),
        (GOOD, (0.056, 0.05)),
    ],
)
def test_what_rises_never_rests_is_slow_or_far_off_is_not_enough(
    down: Descent, ates: tuple[float, float] | None
) -> None:
    assert not line("some graph", 0.0, down, 100.0, ates, 1.0).is_reached


def test_where_much_is_lost_only_one_percent_is_asked_for() -> None:
    assert line("some graph", LOSS, fallen(*[200.0] * 119, 100.5), 100.0, None, 1.0).is_reached
    assert not line("some graph", LOSS, fallen(*[200.0] * 120, 100.5), 100.0, None, 1.0).is_reached


def test_where_there_are_no_recordings_they_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main(["--rbcd", str(tmp_path), "--quick"]) == 66
    assert "tiers_4robots_cora.pyfg" in capsys.readouterr().err


@pytest.mark.parametrize(("reached", "code"), [(True, 0), (False, 1)])
def test_the_command_prints_line_by_line_and_fails_when_one_is_not_reached(
    reached: bool,
    code: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def lines(*_: object) -> Iterator[Line]:
        yield Line(("good",) * len(HEAD), True)
        yield Line(("last",) * len(HEAD), reached)

    monkeypatch.setattr(rbcd_table, "lines", lines)
    assert command.main(["--rbcd", "anywhere"]) == code
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == f"| {' | '.join((*HEAD, 'reached'))} |"
    assert printed[2].endswith("| yes |")
    assert printed[3].endswith("| yes |" if reached else "| **no** |")


@pytest.mark.slow
@pytest.mark.skipif(not (DATA / rbcd_table.TIERS).exists(), reason="no TIERS recording")
def test_the_quick_table_is_reached_on_a_recording_and_on_a_certified_graph() -> None:
    found = list(rbcd_table.lines(DATA, quick=True))
    assert len(found) == 4
    for made in found:
        assert made.is_reached, made.cells


@pytest.mark.slow
@pytest.mark.skipif(not (DATA / "posegraphs").exists(), reason="no pose graphs")
def test_a_certified_graph_comes_to_its_optimum() -> None:
    graph = graphs.load("team3_400", folder=DATA / "posegraphs")
    made = rbcd_table.certified(graph, 0.0)
    assert made.is_reached, made.cells
