"""The event loop of one of many, with as few of these as there may be."""

from __future__ import annotations

import asyncio
import time

import pytest
from lab.benchmark import rows
from lab.benchmark.large_teams import large_loop
from lab.benchmark.large_teams.met_team import MetTeam

from drslamd.io.worker import Worker
from drslamd.slam.back_end import BackEnd


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(large_loop, "ROBOTS", {True: 3})
    monkeypatch.setattr(large_loop, "AFTER_S", {True: 20})
    monkeypatch.setattr(large_loop, "SECONDS", {True: 2})


def found() -> list[rows.Row]:
    return list(large_loop.rows(quick=True))


@pytest.mark.usefixtures("small")
def test_lags_of_the_loop_and_the_time_between_two_answers_are_a_row_each() -> None:
    p99, longest, apart = found()
    assert [row.unit for row in (p99, longest, apart)] == ["ms", "ms", "s"]
    assert 0 < p99.value <= longest.value
    assert 0 < apart.value <= 2.0
    assert "3 robots" in p99.work


@pytest.mark.usefixtures("small")
def test_what_holds_the_loop_is_in_its_longest_lag(monkeypatch: pytest.MonkeyPatch) -> None:
    said = BackEnd.said_digest

    def slow(back: BackEnd) -> int:
        time.sleep(0.06)
        return said(back)

    monkeypatch.setattr(BackEnd, "said_digest", slow)
    assert found()[1].value > 35


@pytest.mark.usefixtures("small")
def test_a_computation_that_fails_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails() -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(BackEnd, "begin", lambda *_, **__: fails)
    with pytest.raises(ZeroDivisionError):
        found()


def test_each_look_that_was_missed_counts() -> None:
    """The loop was held for a tenth of a second: five looks were late, by 100 ms and less."""

    async def held() -> list[float]:
        loop = large_loop.LargeLoop(MetTeam(2, 2, 1), Worker())
        now = asyncio.get_running_loop().time()
        loop.read(now - 0.09, until=now)
        loop.failed.cancel()
        return loop.lags

    lags = asyncio.run(held())
    assert len(lags) == 5
    assert lags[0] == pytest.approx(90, abs=5)
    assert lags[-1] == pytest.approx(10, abs=5)
