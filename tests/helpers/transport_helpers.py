"""What the tests of the networks share: a transport that runs, and what it delivered."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import socket
from collections.abc import AsyncIterator, Callable, Coroutine
from typing import Any, ParamSpec, Union

from drslamd.config import GossipSection
from drslamd.events import ChannelMessage, Datagram, Event, NetworkState
from drslamd.gossip import lc02
from drslamd.io.clock import MonotonicClock
from drslamd.io.liblcm import Liblcm
from drslamd.io.multicast import Multicast

GROUP = "239.255.76.67"
Transport = Union[Multicast, Liblcm]
P = ParamSpec("P")
LONGEST_S = 60.0
"""No test of a network may take longer."""


def free_port() -> int:
    """A UDP port of the group that nobody uses now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((GROUP, 0))
        return int(probe.getsockname()[1])


def section(interface: str = "127.0.0.1", port: int = 0, group: str = GROUP) -> GossipSection:
    """Of this host only, on a port of its own."""
    return GossipSection(interface=interface, port=port or free_port(), group=group, ttl=0)


class Ear:
    """Keeps what a transport delivers."""

    def __init__(self) -> None:
        self.events: list[Event] = []

    @property
    def states(self) -> list[NetworkState]:
        return [event for event in self.events if isinstance(event, NetworkState)]

    @property
    def messages(self) -> list[tuple[str, bytes]]:
        """Channels and payloads, whichever way they came."""
        out = []
        for event in self.events:
            if isinstance(event, ChannelMessage):
                out.append((event.channel, event.payload))
            elif isinstance(event, Datagram):
                framed = lc02.decode(event.data)
                assert not isinstance(framed, lc02.FramingFault)
                out.append(framed)
        return out

    def is_up(self) -> bool:
        return bool(self.states) and self.states[-1].up

    def is_down(self) -> bool:
        return bool(self.states) and not self.states[-1].up


def in_a_loop(test: Callable[P, Coroutine[Any, Any, None]]) -> Callable[P, None]:
    """A test in a loop of its own, which it must leave in time and without tasks."""

    @functools.wraps(test)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        async def alone() -> None:
            await asyncio.wait_for(test(*args, **kwargs), LONGEST_S)
            assert asyncio.all_tasks() == {asyncio.current_task()}

        asyncio.run(alone())

    return run


async def until(condition: Callable[[], bool], seconds: float = 5.0) -> float:
    """Wait for something to become true; how long that took."""
    loop = asyncio.get_running_loop()
    began = loop.time()
    while not condition():
        assert loop.time() - began < seconds, f"not within {seconds} s"
        await asyncio.sleep(0.005)
    return loop.time() - began


@contextlib.asynccontextmanager
async def running(transport: Transport) -> AsyncIterator[None]:
    """A transport that runs; afterwards nothing of it is left."""
    task = asyncio.ensure_future(transport.run())
    try:
        yield
        assert not task.done(), "the transport ended by itself"
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


def native(where: GossipSection) -> tuple[Multicast, Ear]:
    """A native transport and what it hears."""
    ear = Ear()
    return Multicast(where, MonotonicClock(), ear.events.append), ear


async def spoken_until(
    transport: Transport, condition: Callable[[], bool], seconds: float = 5.0
) -> float:
    """Send a message every 50 ms until something becomes true; how long that took."""
    loop = asyncio.get_running_loop()
    began = loop.time()
    while not condition():
        assert loop.time() - began < seconds, f"not within {seconds} s"
        transport.send("DRSLAM_STATUS_009", b"again")
        await asyncio.sleep(0.05)
    return loop.time() - began
