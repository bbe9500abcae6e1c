"""tools/benchmark: what it counts, what it compares, and the graphs that it takes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from lab.benchmark import __main__ as command
from lab.benchmark import closures, graphs, module1, rows, timing, windows
from lab.benchmark.rows import Peer, Row

from drslamd.slam import se2
from drslamd.slam.consistency.pcm import PairConsistency


def row(value: float, peer: float = 10.0, unit: str = "ms", work: str = "some") -> Row:
    return Row(1, work, value, unit, 5.0, None, (Peer("other", peer, True), Peer("far", 9, False)))


# ---- rows ----


def test_a_row_meets_its_goal_or_not() -> None:
    assert row(5.0).is_met
    assert not row(5.1).is_met
    assert row(5.0, unit="share").is_met
    assert not row(4.9, unit="share").is_met
    assert Row(1, "some", 3.0, "ms").is_met is None


def test_only_peers_of_the_same_run_give_a_ratio() -> None:
    assert row(2.0).ratios() == {"other": 5.0}


def test_the_table_says_value_goal_ratio_and_what_is_only_quoted() -> None:
    text = rows.markdown([row(2.0), row(6.0)]).splitlines()
    assert text[2] == "| 1 | some | 2 ms |  | 5 ✓ | other 10 (5.0 x) | far 9 |"
    assert "5 MISSED" in text[3]


def test_json_gives_the_rows_back() -> None:
    some = [row(2.0), Row(0, "x", 1.0, "rounds")]
    assert rows.from_json(json.loads(json.dumps(rows.to_json(some)))) == some


@pytest.mark.parametrize(
    ("now", "then", "worse"),
    [
        (row(2.9), row(2.0), False),
        (row(3.1), row(2.0), True),
        # the machine became slower, and the peer with it
        (row(8.0, peer=40.0), row(2.0), False),
        (row(1.09, unit="rounds"), row(1.0, unit="rounds"), False),
        (row(1.2, unit="rounds"), row(1.0, unit="rounds"), True),
        (row(0.95, unit="share"), row(1.0, unit="share"), False),
        (row(0.90, unit="share"), row(1.0, unit="share"), True),
        (row(9.0, unit="share"), row(1.0, unit="share"), False),
        (row(1e-9, unit="gap"), row(1e-12, unit="gap"), False),
        (row(9.0, work="new"), row(1.0), False),
    ],
)
def test_a_regression_is_a_ratio_or_a_count_that_became_worse(
    now: Row, then: Row, worse: bool
) -> None:
    assert bool(rows.regressions([now], [then])) == worse


# ---- time ----


def test_programs_take_turns_and_the_first_round_does_not_count() -> None:
    calls: list[str] = []
    programs = {name: (lambda name=name: calls.append(name)) for name in ("a", "b")}
    times = timing.in_turns(programs, 3, 10.0)
    assert calls == ["a", "b"] * 4
    assert times["a"].count == times["b"].count == 3


def test_what_is_too_slow_is_run_less_often() -> None:
    times = timing.in_turns({"slow": lambda: sum(range(1_000_000))}, 1000, 0.05)
    assert 1 <= times["slow"].count < 100
    assert 0 < times["slow"].median <= times["slow"].p99


# ---- inputs ----


@pytest.mark.parametrize("straight", [False, True])
def test_windows_are_what_their_truth_says(straight: bool) -> None:
    rng = np.random.default_rng(1)
    for _ in range(5):
        window, a_T_b = windows.window(rng, 100, straight)
        b = se2.transform(a_T_b, window.b_points)
        errors = np.hypot(*(b - window.a_points).T) - window.ranges
        assert 0.07 < errors.std() < 0.13
        speed = np.hypot(*np.diff(window.a_poses[:, :2], axis=0).T) * windows.HZ
        np.testing.assert_allclose(speed, windows.SPEED_M_S, rtol=1e-6)
        assert window.a_poses[-1].tolist() == [0, 0, 0]


def test_the_peers_of_module_1_find_the_pose() -> None:
    rng = np.random.default_rng(2)
    for _ in range(3):
        window, a_T_b = windows.window(rng, 200)
        for found in (module1.grid(window), module1.one_seed(window)[0]):
            error = se2.between(a_T_b, found)
            assert np.hypot(*error[:2]) < 1.0
        minimum, cost = module1.polished(window, a_T_b)
        nudged = [module1.polished(window, minimum + step)[1] for step in np.eye(3) * 0.01]
        assert cost == pytest.approx(min(nudged), rel=1e-6)


def test_good_closures_agree_and_wrong_ones_do_not() -> None:
    pair = PairConsistency(closures.NOISE, closures.NOISE, 0.05)
    for candidate in closures.candidates(100, 0.5, 3):
        pair.add(candidate)
    assert 30 <= len(pair.kept()) <= 60
    lonely = PairConsistency(closures.NOISE, closures.NOISE, 0.05)
    for candidate in closures.candidates(100, 0.0, 3):
        lonely.add(candidate)
    assert len(lonely.kept()) < 6


# ---- the command ----


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
