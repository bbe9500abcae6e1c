"""The live map with a made-up team that drives before it, in this process."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable

from onlooked_team import Actor, entry

from drslamd.events import Event, NetworkState
from drslamd.io.clock import Clock, MonotonicClock
from drslamd.view.live_map import LiveMap
from drslamd.view.scene.hearing import Hearing

TICK_S = 0.1
HOUR_S = 3_600
SCATTER_EVERY_S = 10


class MovedClock:
    """The monotonic clock, `ahead_us` of itself."""

    def __init__(self) -> None:
        self.ahead_us = 0
        self._clock = MonotonicClock()

    def now(self) -> int:
        return self._clock.now() + self.ahead_us


class Stage:
    """A team before the map.

    Attributes:
        actors: by robot; who is taken out is silent.
        url: of the page.
        off_m: by how much the first robot's ranges are too long.
    """

    def __init__(self, actors: list[Actor]) -> None:
        self.clock = MovedClock()
        self.actors = {actor.robot: actor for actor in actors}
        self.off_m = 0.0
        self.url = ""
        self.map = LiveMap(Hearing(None, False), self._listening, self.clock)
        self._began = self.clock.now()
        self._seq = 0

    def _listening(self, clock: Clock, deliver: Callable[[Event], None]) -> Stage:
        self.deliver = deliver
        return self

    @property
    def t(self) -> float:
        """Now, s since the map began."""
        return (self.clock.now() - self._began) / 1e6

    async def run(self) -> None:
        """As a listener: everybody drives in real time."""
        self.deliver(NetworkState(self.clock.now(), True, "239.255.76.67:7667 on stage"))
        tick = 0
        while True:
            self._play(tick)
            tick += 1
            await asyncio.sleep(TICK_S)

    def _play(self, tick: int) -> None:
        t, now = self.t, self.clock.now()
        others = list(self.actors.values())
        for actor in others:
            if tick % 3 == 0:
                self.deliver(actor.datagram(actor.pose(t), t, now))
            if tick % 10 == 0:
                self.deliver(actor.datagram(actor.status(), t, now))
            if tick % 5 == 0:
                self._seq += 1
                peers = [a for a in others if a.robot in actor.peers and a.robot > actor.robot]
                # a second ago, where everybody's path is known
                ranges = tuple(actor.range_to(a, t - 1, self.off_m) for a in peers)
                said = entry(self._seq, (actor.keyframe(t),), ranges)
                self.deliver(actor.datagram(said, t, now))

    def fill(self, seconds: int = HOUR_S) -> None:
        """As if everybody had driven so long already."""
        scene = self.map.scene
        actors = list(self.actors.values())
        for t in range(seconds):
            for actor in actors:
                scene.take(actor.said(actor.pose(t), t), float(t))
            if t % SCATTER_EVERY_S == 0 and t:
                self._measure(t)
                scene.changes(t, True)
        for actor in actors:
            scene.take(actor.said(actor.status(), seconds), float(seconds))
        self.clock.ahead_us = round(seconds * 1e6)

    def _measure(self, t: int) -> None:
        for actor in self.actors.values():
            for peer in actor.peers:
                if peer > actor.robot:
                    other = self.actors[peer]
                    ranges = tuple(actor.range_to(other, t - k / 2) for k in range(1, 5))
                    is_due = t % 60 == 0
                    closures = (actor.closure_to(other, t - 1.0, t),) if is_due else ()
                    said = entry(t, (), ranges, closures)
                    self.map.scene.take(actor.said(said, t), float(t))


@contextlib.asynccontextmanager
async def playing(stage: Stage) -> AsyncIterator[Stage]:
    """The map is open, on a free port of loopback; `stage.url` leads there."""
    port = await stage.map.open("127.0.0.1", 0)
    stage.url = f"http://127.0.0.1:{port}/"
    running = asyncio.ensure_future(stage.map.run())
    try:
        yield stage
        stage.map.stop()
        await running
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)


def ring(count: int) -> list[Actor]:
    """Robots on circles of different size and place, each with four neighbours."""
    actors = []
    columns = max(2, round(count**0.5))
    for k in range(count):
        near = {(k + step) % count for step in (-2, -1, 1, 2)} - {k}
        actors.append(
            Actor(
                k,
                centre=(6.0 * (k % columns), 5.0 * (k // columns)),
                radius=1.5 + 0.9 * (k % 4),
                turning=(0.2 + 0.03 * (k % 5)) * (-1) ** k,
                phase=0.8 * k,
                ahead_s=500.0 * (k + 1),
                peers=tuple(sorted(near)),
                covariance=(0.01, 0.004 * (-1) ** k, 0.0, 0.02, 0.0, 0.001),
            )
        )
    return actors
