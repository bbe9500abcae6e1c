"""The map as one program: datagrams in, a stream of updates out."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest
from onlooked_team import Actor, two
from transport_helpers import in_a_loop

aiohttp = pytest.importorskip("aiohttp", reason="aiohttp is not installed")

from stage import Stage, playing  # noqa: E402

from drslamd import __version__  # noqa: E402
from drslamd.events import Datagram  # noqa: E402


async def heard(stage: Stage, enough: Any) -> list[dict[str, Any]]:
    """What a page is told, until it is `enough`."""
    out: list[dict[str, Any]] = []
    timeout = aiohttp.ClientTimeout(total=20)
    async with (
        aiohttp.ClientSession(timeout=timeout) as session,
        session.get(f"{stage.url}stream") as answer,
    ):
        while not enough(out):
            line = await answer.content.readline()
            if line.startswith(b"data: "):
                out.append(json.loads(line[6:]))
    return out


def pairs_of(said: list[dict[str, Any]]) -> list[Any]:
    return [row for update in said for row in update.get("pairs", [])]


@in_a_loop
async def test_a_page_is_told_of_the_team_from_its_datagrams_alone() -> None:
    async with playing(Stage(list(two()))) as stage:
        await asyncio.sleep(1.0)
        said = await heard(stage, pairs_of)
    assert said[0]["hello"] == __version__
    complete = next(k for k, update in enumerate(said) if update.get("complete"))
    paths = {robot for update in said[:complete] for robot in update.get("paths", {})}
    assert paths == {"0", "1"}
    moved = {row[0] for update in said[complete:] for row in update.get("poses", [])}
    assert moved == {0, 1}
    low, high, _, rms, _ = pairs_of(said)[-1]
    assert (low, high) == (0, 1)
    assert rms < 0.1


@in_a_loop
async def test_the_page_is_told_what_is_listened_to_and_whether_it_is_proven() -> None:
    async with playing(Stage([])) as stage:
        stage.deliver(Datagram(0, b"noise"))
        said = await heard(stage, lambda out: any(u.get("team", {}).get("up") for u in out))
    team = next(update["team"] for update in said if update.get("team", {}).get("up"))
    assert team["network"] == "239.255.76.67:7667 on stage"
    assert team["verified"] is False
    assert team["trust"].startswith("not verified")
    assert team["refused"] == {"datagram too short": 1}


@in_a_loop
async def test_noise_on_the_group_harms_nobody() -> None:
    async with playing(Stage([Actor(0)])) as stage:
        whole = stage.actors[0].datagram(stage.actors[0].pose(0.0), 0.0).data
        for k in range(len(whole)):
            stage.deliver(Datagram(stage.clock.now(), whole[:k] + b"\xff" + whole[k + 1 :]))
        said = await heard(stage, lambda out: any("poses" in update for update in out))
    assert said


@in_a_loop
async def test_a_listener_that_ends_by_a_bug_ends_the_map() -> None:
    stage = Stage([])

    async def broken() -> None:
        raise ZeroDivisionError

    stage.run = broken  # type: ignore[method-assign]
    with pytest.raises(ZeroDivisionError):
        async with playing(stage):
            await asyncio.sleep(0.1)
