"""LCM through the `lcm` package, for whoever needs one of its providers.

liblcm parses what comes from the network itself: one malformed datagram can end the process, so
this transport is for trusted networks and tests. The package is imported only when it is chosen.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from drslamd.config import ConfigError, GossipSection
from drslamd.events import ChannelMessage, Event, NetworkState
from drslamd.gossip.messages import CHANNEL_PREFIX
from drslamd.io.backoff import Backoff
from drslamd.io.clock import Clock

QUEUE = 500
"""Messages that liblcm holds for us; its own default of 30 drops a burst in silence."""


def require_lcm() -> None:
    """
    Raises:
        ConfigError: the package or the system library under it is missing.
    """
    try:
        import lcm  # noqa: F401
    except ImportError as error:
        missing = "glib" in str(error)
        remedy = "apt install libglib2.0-0" if missing else "pip install lcm"
        raise ConfigError([f'gossip.provider = "liblcm": {error}; {remedy}']) from None


def default_url(section: GossipSection) -> str:
    """The URL that means the same group as the native transport's keys."""
    return section.url or f"udpm://{section.group}:{section.port}?ttl={section.ttl}"


class Liblcm:
    """The transport of the lcm package.

    Attributes:
        dropped: messages that liblcm did not take, since the start.
        flooded: 0: liblcm does not say who sends.
        reads: how often it has read since the start.
    """

    def __init__(
        self, section: GossipSection, clock: Clock, deliver: Callable[[Event], None]
    ) -> None:
        self._url = default_url(section)
        self._clock = clock
        self._deliver = deliver
        self._lcm: Any = None
        self._failed = asyncio.Event()
        self._last_state: tuple[bool, str] | None = None
        self.dropped = self.reads = self.flooded = 0

    async def run(self) -> None:
        """Join, receive, join again."""
        backoff = Backoff()
        try:
            while True:
                if await self._open():
                    backoff.reset()
                    await self._failed.wait()
                await backoff.wait()
        finally:
            self._close()

    def complaint(self) -> str | None:
        """Nothing: liblcm does not say who sends."""
        return None

    def descriptor(self) -> int:
        """Of what liblcm reads from, or -1."""
        return -1 if self._lcm is None else int(self._lcm.fileno())

    def send(self, channel: str, payload: bytes) -> None:
        """Publish without waiting."""
        if self._lcm is None:
            self.dropped += 1
            return
        try:
            self._lcm.publish(channel, payload)
        except OSError as error:
            self.dropped += 1
            self._fail(f"cannot send to {self._url}: {error}")

    async def _open(self) -> bool:
        try:
            # the first subscription runs a self test that may take ten seconds
            instance = await asyncio.to_thread(self._connect)
        except (RuntimeError, OSError) as error:
            self._state(False, f"{self._url}: {error}")
            return False
        self._lcm = instance
        self._failed.clear()
        asyncio.get_running_loop().add_reader(instance.fileno(), self._handle)
        self._state(True, self._url)
        return True

    def _connect(self) -> Any:
        import lcm

        instance = lcm.LCM(self._url)
        subscription = instance.subscribe(CHANNEL_PREFIX + ".*", self._message)
        if subscription is None:
            raise OSError("cannot subscribe")
        subscription.set_queue_capacity(QUEUE)
        instance.fileno()
        return instance

    def _handle(self) -> None:
        self.reads += 1
        try:
            self._lcm.handle()
        except OSError as error:
            self._fail(f"cannot receive from {self._url}: {error}")

    def _message(self, channel: str, data: bytes) -> None:
        self._deliver(ChannelMessage(self._clock.now(), channel, data))

    def _fail(self, why: str) -> None:
        self._close()
        self._state(False, why)
        self._failed.set()

    def _state(self, up: bool, detail: str) -> None:
        if (up, detail) != self._last_state:
            self._last_state = (up, detail)
            self._deliver(NetworkState(self._clock.now(), up, detail))

    def _close(self) -> None:
        if self._lcm is not None:
            asyncio.get_running_loop().remove_reader(self._lcm.fileno())
            self._lcm = None
