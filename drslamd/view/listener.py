"""Hears the group of the team and sends nothing into it."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable

from drslamd.config import GossipSection
from drslamd.events import Datagram, Event, NetworkState
from drslamd.io.backoff import Backoff
from drslamd.io.clock import Clock
from drslamd.io.multicast import open_group

SILENCE_S = 10.0
"""Who sends nothing has no echo by which to know that the group works: after such a silence it is
joined anew, which costs nothing when there was nobody to hear."""
LOOK_S = 1.0
"""How often that is looked at."""
LARGEST = 65_536
AT_ONCE = 64
"""Datagrams read in one go; then the pages have their turn."""


class Listener:
    """The native transport, for an onlooker."""

    def __init__(
        self, section: GossipSection, clock: Clock, deliver: Callable[[Event], None]
    ) -> None:
        self._section, self._clock, self._deliver = section, clock, deliver
        self._socket: socket.socket | None = None
        self._heard_at = 0.0
        self._last_state: tuple[bool, str] | None = None

    async def run(self) -> None:
        """Join, hear, join again."""
        backoff = Backoff()
        try:
            while True:
                if self._open():
                    backoff.reset()
                    await self._until_silent()
                    self._close()
                else:
                    await backoff.wait()
        finally:
            self._close()

    def _open(self) -> bool:
        where = self._section.interface or "the default interface"
        try:
            self._socket = open_group(self._section)
        except OSError as error:
            hint = "" if self._section.interface else "; name one with --interface"
            reason = error.strerror or str(error)
            self._state(False, f"cannot join {self._section.group} on {where}: {reason}{hint}")
            return False
        loop = asyncio.get_running_loop()
        self._heard_at = loop.time()
        loop.add_reader(self._socket.fileno(), self._read)
        self._state(True, f"{self._section.group}:{self._section.port} on {where}")
        return True

    async def _until_silent(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            await asyncio.sleep(LOOK_S)
            if self._socket is None or loop.time() - self._heard_at >= SILENCE_S:
                return

    def _read(self) -> None:
        for _ in range(AT_ONCE):
            if self._socket is None:
                return
            try:
                data, sender = self._socket.recvfrom(LARGEST)
            except BlockingIOError:
                return
            except OSError:
                self._close()
                return
            self._heard_at = asyncio.get_running_loop().time()
            self._deliver(Datagram(self._clock.now(), data, sender[0]))

    def _close(self) -> None:
        if self._socket is not None:
            asyncio.get_running_loop().remove_reader(self._socket.fileno())
            self._socket.close()
            self._socket = None

    def _state(self, up: bool, detail: str) -> None:
        if (up, detail) != self._last_state:
            self._last_state = (up, detail)
            self._deliver(NetworkState(self._clock.now(), up, detail))
