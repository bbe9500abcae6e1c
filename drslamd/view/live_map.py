"""The live map as one program: ears, what is known, and a window to it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from typing import Any

from drslamd import __version__
from drslamd.conventions import SECOND_US
from drslamd.events import ChannelMessage, Datagram, Event, NetworkState
from drslamd.host.ending import stops
from drslamd.io.clock import Clock, MonotonicClock
from drslamd.view.door import files
from drslamd.view.scene.hearing import Hearing
from drslamd.view.scene.scene import Scene
from drslamd.view.server import Piece, Server

UPDATE_S = 0.1
"""Between two updates of the poses; faster than any robot says one."""
ALL_EVERY = 10
"""Updates between two that say how everybody is."""

Listening = Callable[[Clock, Callable[[Event], None]], Any]
"""Makes what hears the network: an object with a coroutine `run`."""


class LiveMap:
    """Runs until it is stopped.

    Attributes:
        scene: what is known of the team.
        network: what is listened to, or why nothing is; up: whether something is.
    """

    def __init__(self, hearing: Hearing, listening: Listening, clock: Clock | None = None) -> None:
        self._clock = clock or MonotonicClock()
        self._began = self._clock.now()
        self._hearing, self.scene = hearing, Scene()
        self._listener = listening(self._clock, self.handle)
        self.network, self.up = "not tried yet", False
        self._server = Server(files(), self._everything)
        self._stop = asyncio.Event()

    async def open(self, listen: str, port: int) -> int:
        """Let pages ask; the port, which is one that is free for port 0.

        Raises:
            OSError: the address cannot be listened on.
        """
        return await self._server.open(listen, port)

    async def run(self) -> None:
        """Until SIGTERM, SIGINT or `stop`."""
        loop = asyncio.get_running_loop()
        for number in stops():
            loop.add_signal_handler(number, self.stop)
        work = (self._listener.run(), self._tell(), self._stop.wait())
        tasks = [asyncio.ensure_future(part) for part in work]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()  # a bug of ours is raised
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await self._server.close()

    def stop(self) -> None:
        """End `run`."""
        self._stop.set()

    def handle(self, event: Event) -> None:
        """What comes from the network."""
        if isinstance(event, NetworkState):
            self.network, self.up = event.detail, event.up
        elif isinstance(event, (Datagram, ChannelMessage)):
            said = self._hearing.receive(event)
            if said is not None:
                self.scene.take(said, self._since(event.utime))

    def _since(self, utime: int) -> float:
        return (utime - self._began) / SECOND_US

    async def _tell(self) -> None:
        number = 0
        while True:
            await asyncio.sleep(UPDATE_S)
            number += 1
            of_all = number % ALL_EVERY == 0
            piece = self.scene.changes(self._since(self._clock.now()), of_all)
            if of_all:
                piece["team"] = self._team()
            if len(piece) > 1:
                self._server.tell(piece)

    def _everything(self) -> Iterator[Piece]:
        yield {"hello": __version__, "team": self._team()}
        yield from self.scene.everything(self._since(self._clock.now()))
        yield {"complete": True}

    def _team(self) -> Piece:
        hearing = self._hearing
        return {
            "network": self.network,
            "up": self.up,
            "verified": hearing.verifies,
            "trust": hearing.trust(),
            "problems": hearing.problems(self._clock.now()),
            "messages": hearing.accepted,
            "octets": hearing.octets,
            "refused": dict(hearing.refused),
        }
