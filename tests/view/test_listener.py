"""An onlooker hears the group and sends nothing into it."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator

import pytest
from transport_helpers import Ear, free_port, in_a_loop, section, until

from drslamd.config import GossipSection
from drslamd.gossip import lc02
from drslamd.io.clock import MonotonicClock
from drslamd.io.multicast import open_group
from drslamd.view import listener
from drslamd.view.listener import Listener

DATAGRAM = lc02.encode(1, "DRSLAM_STATUS_009", b"hello")


def speak(port: int, count: int = 1) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        udp.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        for _ in range(count):
            udp.sendto(DATAGRAM, ("239.255.76.67", port))


@contextlib.asynccontextmanager
async def hearing(where: GossipSection) -> AsyncIterator[Ear]:
    ear = Ear()
    task = asyncio.ensure_future(Listener(where, MonotonicClock(), ear.events.append).run())
    try:
        yield ear
        assert not task.done()
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


@in_a_loop
async def test_it_hears_the_group_and_says_where() -> None:
    port = free_port()
    async with hearing(section(port=port)) as ear:
        await until(ear.is_up)
        assert ear.states[0].detail == f"239.255.76.67:{port} on 127.0.0.1"
        speak(port, 3)
        await until(lambda: len(ear.messages) == 3)
        assert ear.messages[0] == ("DRSLAM_STATUS_009", b"hello")


@in_a_loop
async def test_an_interface_that_is_not_there_is_named() -> None:
    async with hearing(section(interface="nowhere0")) as ear:
        await until(ear.is_down)
        assert ear.states[0].detail.startswith("cannot join 239.255.76.67 on nowhere0: ")


@in_a_loop
async def test_after_a_silence_the_group_is_joined_anew() -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(listener, "SILENCE_S", 0.05)
        patch.setattr(listener, "LOOK_S", 0.02)
        opened: list[int] = []
        real = open_group

        def counted(where: GossipSection) -> socket.socket:
            opened.append(1)
            return real(where)

        patch.setattr(listener, "open_group", counted)
        port = free_port()
        async with hearing(section(port=port)) as ear:
            await until(lambda: len(opened) >= 3)
            assert len(ear.states) == 1


@in_a_loop
async def test_nothing_is_ever_sent() -> None:
    port = free_port()
    async with hearing(section(port=port)) as ear, hearing(section(port=port)) as other:
        await until(lambda: ear.is_up() and other.is_up())
        await asyncio.sleep(0.2)
        assert ear.messages == other.messages == []
