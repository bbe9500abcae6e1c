"""The page in a real browser: what is drawn, how fast, on which screens."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from onlooked_team import COVARIANCE, Actor, entry
from transport_helpers import in_a_loop

aiohttp = pytest.importorskip("aiohttp", reason="aiohttp is not installed")

from browser import CHROMIUM, Tab, artefacts, tab  # noqa: E402
from stage import Stage, playing, ring  # noqa: E402

from drslamd.conventions import node_chain  # noqa: E402
from drslamd.gossip.message_types import Hypotheses, PoseState  # noqa: E402
from drslamd.slam.hypotheses.places_left import PossiblePlace  # noqa: E402

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium is installed"),
]

FRAME_MS = 1000 / 30
WARM_UP_S, MEASURED_S = 4.0, 5.0
SPOT = "liveMap.map.spots.find((s) => s.id === {})"
PIXEL = """(() => {{
  const spot = {spot}, canvas = document.getElementById("map");
  const probe = document.createElement("canvas").getContext("2d");
  const colour = (style) => {{
    probe.fillStyle = style; probe.fillRect(0, 0, 1, 1);
    return [...probe.getImageData(0, 0, 1, 1).data].slice(0, 3);
  }};
  const at = canvas.getContext("2d").getImageData(spot.x + {dx}, spot.y + {dy}, 1, 1).data;
  return {{ seen: [...at].slice(0, 3),
    wanted: colour(getComputedStyle(document.documentElement).getPropertyValue("{name}")) }};
}})()"""


@contextlib.asynccontextmanager
async def shown(stage: Stage, width: int = 1280, height: int = 800) -> AsyncIterator[Tab]:
    """The page of a stage; its console must stay silent."""
    async with playing(stage), tab() as page:
        await page.size(width, height)
        await page.open(stage.url)
        await page.until("window.liveMap?.team.isComplete")
        await page.until("liveMap.map.spots.length")
        yield page
        assert page.complaints == []


async def place(page: Tab, robot: int) -> tuple[float, float]:
    """Where it is drawn, m."""
    x, y = await page.run(
        f"(() => {{ const s = {SPOT.format(robot)}; "
        "return [liveMap.camera.fromX(s.x), liveMap.camera.fromY(s.y)]; })()"
    )
    return float(x), float(y)


async def is_colour(page: Tab, robot: int, name: str, dx: int = -7, dy: int = -4) -> bool:
    found = await page.run(PIXEL.format(spot=SPOT.format(robot), name=name, dx=dx, dy=dy))
    return bool(max(abs(a - b) for a, b in zip(found["seen"], found["wanted"], strict=True)) < 40)


async def item(page: Tab, robot: int) -> dict[str, str]:
    """The robot in the list: its class and its words."""
    found = await page.run(
        "(() => { const li = [...document.querySelectorAll('#robots li')]"
        f".find((li) => li.querySelector('.disk').textContent === '{robot}'); "
        "return { standing: li.className, words: li.innerText }; })()"
    )
    return dict(found)


NOSE = """(() => {{
  const spot = {spot}, {{ theta }} = liveMap.team.robot({robot}).shown;
  const probe = document.createElement("canvas").getContext("2d");
  probe.fillStyle = spot.colour; probe.fillRect(0, 0, 1, 1);
  const x = spot.x + 15 * Math.cos(theta), y = spot.y - 15 * Math.sin(theta);
  const at = document.getElementById("map").getContext("2d").getImageData(x, y, 1, 1).data;
  const wanted = probe.getImageData(0, 0, 1, 1).data;
  return Math.max(...[0, 1, 2].map((k) => Math.abs(at[k] - wanted[k])));
}})()"""


def test_headings_that_are_not_known_modules_and_possible_places_are_drawn(tmp_path: Path) -> None:
    @in_a_loop
    async def go() -> None:
        stage = Stage(ring(2))
        first, second = stage.actors.values()
        second.state, second.turning = PoseState.POSITION, 0.0
        async with shown(stage) as page:
            nose = [NOSE.format(spot=SPOT.format(k), robot=k) for k in (0, 1)]
            await page.until(f"{nose[0]} < 40")
            assert await page.run(nose[1]) > 40
            await page.until("document.querySelector('#robots li.position')")
            assert "position only" in (await item(page, 1))["words"]

            # where it was a second ago must have been told
            await asyncio.sleep(max(0.0, 2.0 - stage.t))
            t = stage.t
            closure = replace(first.closure_to(second, t - 1, 0), peer=node_chain(101))
            said = entry(1, (), (), (closure,))
            stage.deliver(first.datagram(said, t, stage.clock.now()))
            await page.until("liveMap.map.spots.some((s) => s.module === 101)")

            x, y, theta = first.truth(t).tolist()
            place = PossiblePlace(9, 0, 0.5, (x - 1.5, y - 1.5, 1.0), COVARIANCE)
            mirrored = replace(place, pose=(x - 1.5, y + 1.5, 2.0))
            for _ in range(3):
                utime = first.n(stage.t) * 100_000
                odom = x, y, theta
                message = Hypotheses(utime, odom, (place, mirrored))
                stage.deliver(first.datagram(message, stage.t, stage.clock.now()))
                await asyncio.sleep(0.6)
            await page.until("liveMap.map.spots.filter((s) => s.maybe === 9).length === 2")
            said_in_words = "document.getElementById('robots').innerText"
            await page.until(f"{said_in_words}.includes('Robot 9 is at one of 2 places')")
            await page.screenshot(artefacts(tmp_path) / "possible.png")

    go()


def test_robots_move_are_doubted_lose_odometry_and_get_lost(tmp_path: Path) -> None:
    @in_a_loop
    async def go() -> None:
        stage = Stage(ring(4))
        async with shown(stage) as page:
            before, began = await place(page, 0), stage.t
            await asyncio.sleep(2.0)
            after, t = await place(page, 0), stage.t
            assert math.dist(before, after) > 0.3
            # eased, so a bit behind
            assert (
                min(math.dist(after, stage.actors[0].truth(t - late)[:2]) for late in (0.2, 0.5, 1))
                < 0.25
            )
            assert began < t
            assert (await item(page, 1))["standing"] == "localised"
            assert not await is_colour(page, 3, "--grey")
            await page.until("[...liveMap.team.pairs.values()].some((p) => p.past.length)")

            stage.actors[1].state = PoseState.DOUBTFUL
            stage.actors[2].state = PoseState.STALE
            del stage.actors[3]
            await page.until("document.querySelector('#robots li.doubtful')")
            await page.until("document.querySelector('#robots li.stale')")
            await page.until("document.querySelector('#robots li.lost')")
            await asyncio.sleep(0.5)
            await page.screenshot(artefacts(tmp_path) / "standing.png")
            assert "in doubt" in (await item(page, 1))["words"]
            # the badge beside the robot is amber, the body of the others grey
            assert await is_colour(page, 1, "--warn", 11, -16)
            assert not await is_colour(page, 1, "--grey")
            assert await is_colour(page, 2, "--grey")
            assert await is_colour(page, 3, "--grey")
            assert "no odometry" in (await item(page, 2))["words"]
            lost = "document.querySelector('#robots li.lost').innerText"
            await page.until(f"{lost}.includes('Is not heard any more')")
            assert "1 lost" in await page.run("document.getElementById('summary').textContent")

    go()


def test_the_slider_shows_the_past_and_leads_back() -> None:
    @in_a_loop
    async def go() -> None:
        stage = Stage(ring(3))
        stage.fill(120)
        async with shown(stage) as page:
            await page.until("+document.getElementById('slider').max > 119")
            await page.run(
                "(() => { const s = document.getElementById('slider'); s.value = 60; "
                "s.dispatchEvent(new Event('input')); })()"
            )
            await asyncio.sleep(0.5)
            assert math.dist(await place(page, 1), stage.actors[1].truth(60)[:2]) < 0.05
            assert (await page.run("document.getElementById('clock').textContent")).startswith(
                "−1:"
            )
            assert await page.run("document.getElementById('live').ariaPressed") == "false"
            await page.run("document.getElementById('live').click()")
            await asyncio.sleep(0.5)
            assert math.dist(await place(page, 1), stage.actors[1].truth(60)[:2]) > 0.05
            assert await page.run("document.getElementById('clock').textContent") == "now"

    go()


def test_ranges_that_no_longer_fit_colour_their_link() -> None:
    @in_a_loop
    async def go() -> None:
        stage = Stage(ring(2))
        stage.fill(120)
        async with shown(stage) as page:
            link = "liveMap.map.spots.find((s) => s.pair)?.scatter[1]"
            await page.until(f"{link} < 0.1")
            stage.off_m = 2.0
            await page.until(f"{link} > 0.5")

    go()


@pytest.mark.parametrize(("width", "height"), [(390, 844), (320, 568), (844, 390)])
def test_nothing_is_wider_than_a_phone(width: int, height: int, tmp_path: Path) -> None:
    @in_a_loop
    async def go() -> None:
        stage = Stage(ring(5))
        stage.fill(60)
        async with shown(stage) as page:
            await page.size(width, height, 2, is_phone=True)
            await asyncio.sleep(1.0)
            await page.screenshot(artefacts(tmp_path) / f"phone-{width}x{height}.png")
            widths = await page.run(
                "[document.scrollingElement.scrollWidth, innerWidth, "
                "document.getElementById('map').clientHeight]"
            )
            assert widths[0] <= widths[1] == width
            assert widths[2] > 0.25 * height
            # every robot can be tapped, and the list scrolled to
            box = await page.run("document.querySelector('#robots button').offsetHeight")
            assert box >= 40

    go()


def test_light_and_dark_follow_the_browser() -> None:
    @in_a_loop
    async def go() -> None:
        ground = (
            "[...document.getElementById('map').getContext('2d').getImageData(3, 3, 1, 1).data]"
            ".slice(0, 3).reduce((a, b) => a + b)"
        )
        async with shown(Stage(ring(2))) as page:
            for scheme, is_dark in (("dark", True), ("light", False)):
                await page.prefer(scheme)
                await asyncio.sleep(0.5)
                assert (await page.run(ground) < 200) is is_dark

    go()


def test_a_robot_that_is_not_localised_is_listed_and_not_drawn() -> None:
    @in_a_loop
    async def go() -> None:
        stage = Stage([*ring(2), Actor(9, state=PoseState.NOT_LOCALISED, peers=(0, 1))])
        async with shown(stage) as page:
            await page.until("document.querySelectorAll('#robots li').length === 3")
            assert (await item(page, 9))["standing"] == "away"
            assert await page.run(f"{SPOT.format(9)} === undefined")

    go()


def test_a_page_whose_map_has_ended_says_so_and_comes_back() -> None:
    @in_a_loop
    async def go() -> None:
        async with tab() as page:
            async with playing(Stage(ring(2))) as stage:
                await page.open(stage.url)
                await page.until("window.liveMap?.map.spots.length")
            await page.until("document.getElementById('problems').innerText.includes('answer')", 20)
            assert await page.run("liveMap.map.spots.length") >= 2

    go()


@pytest.mark.parametrize("count", [3, 20])
def test_an_hour_of_history_is_drawn_thirty_times_a_second(count: int, tmp_path: Path) -> None:
    stage = Stage(ring(count))
    stage.fill()

    @in_a_loop
    async def go() -> None:
        async with shown(stage) as page:
            await page.until(f"liveMap.team.robots.size === {count}")
            await asyncio.sleep(WARM_UP_S)
            await page.run("(liveMap.pace.drawn.length = 0, liveMap.pace.apart.length = 0, 0)")
            await asyncio.sleep(MEASURED_S)
            pace = json.loads(await page.run("JSON.stringify(liveMap.pace)"))
            rows = await page.run("[...liveMap.team.robots.values()].map((r) => r.path.length)")
            # by hand, which draws all paths anew each time
            await page.run(
                "(liveMap.pace.drawn.length = 0, liveMap.pace.apart.length = 0, "
                "setInterval(() => { liveMap.camera.byHand(); liveMap.camera.x += 0.02; }, 16))"
            )
            await asyncio.sleep(MEASURED_S)
            moved = json.loads(await page.run("JSON.stringify(liveMap.pace)"))
            await page.screenshot(artefacts(tmp_path) / f"hour-{count}.png")
        assert min(rows) > 3_300
        for what, times in (("still", pace), ("moved", moved)):
            figures = {name: summary(values) for name, values in times.items()}
            print(f"{count} robots, an hour, {what}: {figures}")
            (artefacts(tmp_path) / f"pace-{count}-{what}.json").write_text(json.dumps(figures))
            assert figures["drawn"]["median"] < FRAME_MS / 2
            assert figures["apart"]["median"] < FRAME_MS

    go()


def summary(values: list[float]) -> dict[str, Any]:
    """ms"""
    ordered = sorted(values)
    at = {"median": 0.5, "p95": 0.95, "most": 1.0}
    found = {name: ordered[min(len(ordered) - 1, int(s * len(ordered)))] for name, s in at.items()}
    return {"pictures": len(values), **{name: round(v, 1) for name, v in found.items()}}
