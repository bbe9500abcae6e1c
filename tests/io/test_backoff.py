"""Waits grow from one failure to the next, up to an end, and start anew after a success."""

from __future__ import annotations

import asyncio

import pytest

from drslamd.io.backoff import FIRST_S, LONGEST_S, Backoff


@pytest.fixture
def waits(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The waits that were asked for; none of them takes any time."""
    asked: list[float] = []

    async def sleep(seconds: float) -> None:
        asked.append(seconds)

    monkeypatch.setattr(asyncio, "sleep", sleep)
    return asked


async def wait(backoff: Backoff, times: int) -> None:
    for _ in range(times):
        await backoff.wait()


def test_waits_double_up_to_the_longest(waits: list[float]) -> None:
    asyncio.run(wait(Backoff(), 8))
    assert waits == pytest.approx([0.2, 0.4, 0.8, 1.6, 3.2, 5.0, 5.0, 5.0])
    assert (waits[0], waits[-1]) == (FIRST_S, LONGEST_S)


def test_after_a_success_the_first_wait_is_short_again(waits: list[float]) -> None:
    backoff = Backoff()
    asyncio.run(wait(backoff, 4))
    backoff.reset()
    asyncio.run(wait(backoff, 2))
    assert waits[4:] == [0.2, 0.4]
