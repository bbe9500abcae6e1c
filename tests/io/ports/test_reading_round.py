"""Rounds in which ports are read: once each, together, and not while somebody waits."""

from __future__ import annotations

import asyncio
import itertools

import pytest

from drslamd.io.ports.reading_round import PERIOD_S, ReadingRound


async def a_while(periods: float = 1.5) -> None:
    await asyncio.sleep(periods * PERIOD_S)


def test_who_joined_is_called_once_in_the_next_round_and_all_of_them_together() -> None:
    async def run() -> None:
        rounds, called = ReadingRound(lambda: False), []
        rounds.join(lambda: called.append("uwb"))
        await asyncio.sleep(PERIOD_S / 3)
        rounds.join(lambda: called.append("wheels"))
        assert called == []
        await a_while()
        assert called == ["uwb", "wheels"]
        await a_while()
        assert called == ["uwb", "wheels"]

    asyncio.run(run())


def test_who_joins_during_a_round_is_called_in_the_next_one() -> None:
    async def run() -> None:
        rounds, times = ReadingRound(lambda: False), []

        def read() -> None:
            times.append(asyncio.get_running_loop().time())
            if len(times) < 3:
                rounds.join(read)

        rounds.join(read)
        await a_while(5)
        assert len(times) == 3
        assert min(b - a for a, b in itertools.pairwise(times)) > 0.9 * PERIOD_S

    asyncio.run(run())


def test_who_leaves_is_not_called_and_the_others_are() -> None:
    async def run() -> None:
        rounds, called = ReadingRound(lambda: False), []

        def gone() -> None:
            called.append("gone")

        rounds.join(gone)
        rounds.leave(gone)
        rounds.leave(gone)
        await a_while()
        assert called == []
        rounds.join(gone)
        rounds.join(lambda: called.append("here"))
        rounds.leave(gone)
        await a_while()
        assert called == ["here"]

    asyncio.run(run())


@pytest.mark.parametrize("urgent", [False, True])
def test_there_is_time_unless_somebody_waits(urgent: bool) -> None:
    assert ReadingRound(lambda: urgent).has_time() is not urgent


@pytest.mark.parametrize("hz", [25, 30, 40, 50, 100])
def test_some_frame_of_each_four_seconds_is_read_within_two_milliseconds(hz: int) -> None:
    """The device clock looks for the shortest delay in so long. Who sends less often is silent for
    a round, and read as soon as it speaks."""
    period_ms, round_ms = 1000 / hz, round(PERIOD_S * 1000)
    assert min(round_ms * k % period_ms for k in range(4000 // round_ms)[1:]) <= 2
