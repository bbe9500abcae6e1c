"""The event loop of one of many, with as few of these as there may be."""

from __future__ import annotations

import time

import pytest
from lab.benchmark import rows
from lab.benchmark.large_teams import large_loop

from drslamd.slam.back_end import BackEnd


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(large_loop, "ROBOTS", {True: 3})
    monkeypatch.setattr(large_loop, "AFTER_S", {True: 20})
    monkeypatch.setattr(large_loop, "SECONDS", {True: 1})


def found() -> list[rows.Row]:
    return list(large_loop.rows(quick=True))


@pytest.mark.usefixtures("small")
def test_lags_of_the_loop_and_the_time_between_two_answers_are_a_row_each() -> None:
    p99, longest, apart = found()
    assert [row.unit for row in (p99, longest, apart)] == ["ms", "ms", "s"]
    assert 0 < p99.value <= longest.value
    assert apart.value == pytest.approx(1.0)
    assert "3 robots" in p99.work


@pytest.mark.usefixtures("small")
def test_what_holds_the_loop_is_in_its_longest_lag(monkeypatch: pytest.MonkeyPatch) -> None:
    said = BackEnd.said_digest

    def slow(back: BackEnd) -> int:
        time.sleep(0.06)
        return said(back)

    monkeypatch.setattr(BackEnd, "said_digest", slow)
    assert found()[1].value > 35
