"""Sums, state, verdict and command of tools/reproduce."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from lab.reproduce import __main__ as command
from lab.reproduce import pages, pictures, plan, printed, state, table2, verdict, window_columns
from lab.reproduce.state import State
from lab.reproduce.tally import Tally
from lab.reproduce.verdict import Check


def test_sums_of_parts_give_mean_and_spread_of_the_whole() -> None:
    rng = np.random.default_rng(7)
    whole = rng.normal(3, 2, 100)
    first, second = Tally(), Tally()
    first.add("x", whole[:30])
    second.add("x", whole[30:])
    first.merge(json.loads(json.dumps(second.sums)))
    spread = first["x"]
    assert spread.n == 100
    assert spread.mean == pytest.approx(whole.mean())
    assert spread.std == pytest.approx(whole.std())
    assert spread.most == whole.max()


def test_what_was_never_measured_is_shown_as_a_dash() -> None:
    assert str(Tally()["nothing"]) == "-"
    assert Tally()["nothing"].n == 0


def test_a_state_is_taken_up_again(tmp_path: Path) -> None:
    tally = Tally()
    tally.add("x", 2.0)
    State(tmp_path / "state.json").keep("piece", tally)
    again = State(tmp_path / "state.json")
    assert not again.stale
    assert again.total(["piece", "other"])["x"].mean == 2.0


def test_a_state_of_other_code_is_not_believed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    State(tmp_path / "state.json").keep("piece", Tally())
    monkeypatch.setattr(state, "fingerprint", lambda: "other")
    again = State(tmp_path / "state.json")
    assert again.stale
    assert not again.done


@pytest.mark.parametrize("text", ["", "{", "[]", '{"code": 1}'])
def test_a_damaged_state_is_not_believed(tmp_path: Path, text: str) -> None:
    (tmp_path / "state.json").write_text(text)
    assert State(tmp_path / "state.json").stale


@pytest.mark.parametrize(
    ("check", "ok"),
    [
        (verdict.at_most("x", 1.0, 1.0), True),
        (verdict.at_most("x", 1.01, 1.0), False),
        (verdict.at_least("x", 1.0, 1.0), True),
        (verdict.at_least("x", 0.99, 1.0), False),
        (verdict.within("x", 0.8, 0.8, 1.25), True),
        (verdict.within("x", 1.26, 0.8, 1.25), False),
        (verdict.at_most("x", float("nan"), 1.0), False),
    ],
)
def test_a_check_on_each_side_of_its_limit(check: Check, ok: bool) -> None:
    assert check.ok is ok


def good() -> Tally:
    """A total for which everything is as it ought to be."""
    tally = Tally()
    for k, tau in enumerate(window_columns.TAUS):
        for way, factor in (("nls", 3), ("coarse", 2), ("both", 1)):
            for unit in ("m", "deg"):
                tally.add(f"table1/{tau}/{way}/{unit}", factor / (k + 1))
    for tau in table2.TAUS:
        for epsilon in table2.EPSILONS:
            name = f"table2/{tau}/{epsilon}"
            before = 10.0 if epsilon is None else 6.0
            tally.poses(f"{name}/before", (np.array([before]), np.array([before])))
            for when in ("there", "after"):
                tally.poses(f"{name}/{when}", (np.array([0.5]), np.array([4.1])))
    tally.poses("odometry", (np.array([0.85]), np.array([8.99])))
    tally.poses("drslamd/after", (np.array([0.1]), np.array([1.0])))
    for name in ("drslamd/localised", "drslamd/claim/below", "drslamd/claim/nees",
                 "drslamd/published/nees", "table1/10/drslamd/claim/below"):  # fmt: skip
        tally.add(name, 1.0)
    tally.add("drslamd/published/inside", 0.95)
    tally.add("drslamd/claim/wild", 0.0)
    tally.add("table1/10/drslamd/claim/wild", 0.0)
    return tally


def missed(total: Tally) -> list[str]:
    return [check.name for check in verdict.checks(total) if not check.ok]


def test_everything_reached_is_said_so() -> None:
    assert missed(good()) == []


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("odometry/m", 3.0, "odometry alone, m"),
        ("table1/50/both/m", 9.0, "coarse + NLS against nls alone"),
        ("table2/50/0.1/before/m", 50.0, "PCM lowers the error"),
        ("table2/10/0.2/after/deg", 50.0, "DPGO lowers it again, at all pose times"),
        ("table2/10/0.2/there/deg", 50.0, "DPGO lowers it again, where closures were kept"),
        ("table2/50/0.5/after/m", 2.0, "DPGO at tau 50, epsilon 0.5"),
        ("drslamd/after/m", 1.0, "half of the paper's row"),
        ("drslamd/after/deg", 9.0, "drslamd, final, deg"),
        ("drslamd/localised", 0.0, "localised"),
        ("drslamd/claim/wild", 1.0, "Mahalanobis > 50"),
        ("table1/10/drslamd/claim/below", 0.0, "closures at tau 10"),
        ("drslamd/published/nees", 3.0, "published poses: NEES"),
        ("drslamd/published/inside", 0.0, "95 % ellipse"),
    ],
)
def test_every_promise_can_be_missed(name: str, value: float, words: str) -> None:
    total = good()
    total.add(name, value)
    assert any(words in name for name in missed(total))


def test_no_answer_at_all_from_short_windows_is_honest_once_it_was_asked_for() -> None:
    total = good()
    for name in ("below", "wild"):
        del total.sums[f"table1/10/drslamd/claim/{name}"]
    assert any("tau 10 not marked" in name for name in missed(total))
    total.add("table1/10/drslamd/unique", 0.0)
    assert missed(total) == []


def test_the_page_holds_every_printed_row() -> None:
    page = pages.everything(good(), verdict.checks(good()), [])
    for way in printed.TABLE_1[50].values():
        assert way[0] in page
    for row in printed.TABLE_2.values():
        assert f"| {row[0]} | {row[1]}, {row[2]} | {row[3]}, {row[4]} |" in page


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
