"""Promises are kept up to their bounds, and the table says which are."""

from __future__ import annotations

from dataclasses import fields

import pytest
from lab.trust import play, promises, table
from lab.trust.cases import CASES, QUICK
from lab.trust.figures import Figures
from lab.trust.promises import Check, Promise
from lab.trust.watch import Run

NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("reached", "is_kept"),
    [(0.79, False), (0.8, True), (1.25, True), (1.26, False), (NAN, False), (INF, False)],
)
def test_a_promise_is_kept_between_its_bounds(reached: float, is_kept: bool) -> None:
    assert Promise("nees", 0.8, 1.25).is_kept(reached) is is_kept


def test_without_a_bound_anything_is_right_on_that_side() -> None:
    assert Promise("inside", 0.9).is_kept(1.0)
    assert Promise("cause_s", most=20.0).is_kept(0.0)
    assert not Promise("cause_s", most=20.0).is_kept(INF)


def test_every_promise_is_about_a_figure_that_has_a_column() -> None:
    names = {field.name for field in fields(Figures)}
    assert set(table.COLUMNS) == names
    assert {*table.POSES, *table.FAULTS} <= names
    assert {p.figure for case in CASES.values() for p in case.promises} <= names


def test_no_case_promises_a_figure_twice_and_each_promises_something() -> None:
    for case in CASES.values():
        promised = [promise.figure for promise in case.promises]
        assert promised, case.name
        assert len(set(promised)) == len(promised), case.name


def test_twins_have_the_same_robots_and_seeds() -> None:
    for case in CASES.values():
        if case.twin:
            twin = CASES[case.twin]
            assert (case.first_seed, case.world) == (twin.first_seed, twin.world)
            assert case.seeds <= twin.seeds
    assert set(QUICK) <= set(CASES)


def test_a_cause_is_promised_only_where_one_can_be_named() -> None:
    for case in CASES.values():
        if {"said_s", "cause_s", "named"} & {promise.figure for promise in case.promises}:
            assert case.cause.about, case.name
            assert case.cause.named or case.cause.keys, case.name


def test_a_check_takes_its_figure_by_name() -> None:
    found = Figures(*([0.5] * len(fields(Figures))))  # type: ignore[arg-type]
    (check,) = promises.checks("made", (Promise("liars", most=0.002),), found)
    assert check == Check("made", Promise("liars", most=0.002), 0.5)
    assert not check.is_kept


@pytest.mark.parametrize(
    ("promise", "words"),
    [
        (Promise("nees", 0.8, 1.25), "0.80 to 1.25"),
        (Promise("inside", 0.85), "at least 85.0 %"),
        (Promise("liars", most=0.002), "at most 0.2 %"),
        (Promise("cause_s", most=20.0), "at most 20 s"),
        (Promise("wrong_names", most=0), "none"),
    ],
)
def test_what_is_promised_stands_in_words(promise: Promise, words: str) -> None:
    assert table.wanted(promise) == words


@pytest.mark.parametrize(
    ("figure", "value", "text"),
    [
        ("nees", 1.234, "1.23"),
        ("inside", 0.9251, "92.5 %"),
        ("ate_m", 0.0666, "0.067 m"),
        ("said_s", INF, "never"),
        ("nees", INF, "inf"),
        ("nees", NAN, "-"),
        ("wrong_names", 3.0, "3"),
    ],
)
def test_a_figure_is_written_with_its_unit(figure: str, value: float, text: str) -> None:
    assert table.COLUMNS[figure].text(value) == text


def test_the_table_says_which_promises_are_kept_in_columns_that_line_up() -> None:
    lines = table.promised(
        [
            Check("slip", Promise("liars", most=0.002), 0.001),
            Check("blocked", Promise("cause_s", most=20.0), INF),
        ]
    )
    assert [line.split("|")[-2].strip() for line in lines[2:]] == ["yes", "**no**"]
    assert "never" in lines[3]
    assert len({len(line) for line in lines}) == 1
    bars = [[k for k, c in enumerate(line) if c == "|"] for line in lines]
    assert all(bar == bars[0] for bar in bars)


def test_seeds_without_an_error_on_record_are_held_against_the_rest_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(play, "_run", lambda _: Run())
    recorded, unseen = (play.trusted({"recorded": 1}, 1, first)[0] for first in (None, 2000))
    assert "ate_x_today" in {check.promise.figure for check in recorded.checks}
    assert {check.promise.figure for check in unseen.checks} == {
        promise.figure for promise in CASES["recorded"].promises
    } - {"ate_x_today"}
    assert (list(recorded.runs), list(unseen.runs)) == ([100], [2000])
