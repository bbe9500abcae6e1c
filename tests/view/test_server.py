"""What a browser, or somebody who is none, gets from the map."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Iterator
from typing import Any

import pytest
from transport_helpers import in_a_loop, until

aiohttp = pytest.importorskip("aiohttp", reason="aiohttp is not installed")

from drslamd.view import server as served  # noqa: E402
from drslamd.view.door import files  # noqa: E402
from drslamd.view.server import MAX_CONNECTIONS, MAX_STREAMS, QUEUE, Server, as_event  # noqa: E402


def everything() -> Iterator[dict[str, Any]]:
    yield {"hello": "1"}
    yield {"complete": True}


@contextlib.asynccontextmanager
async def serving() -> AsyncIterator[tuple[Server, int]]:
    """On a free port of loopback."""
    server = Server(files(), everything)
    port = await server.open("127.0.0.1", 0)
    try:
        yield server, port
    finally:
        await server.close()
        await asyncio.sleep(0.05)


class Visitor:
    """Speaks HTTP by hand."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer

    async def head(self) -> str:
        return (await asyncio.wait_for(self.reader.readuntil(b"\r\n\r\n"), 5)).decode()

    async def all(self) -> bytes:
        return await asyncio.wait_for(self.reader.read(), 5)

    async def close(self) -> None:
        self.writer.close()
        with contextlib.suppress(ConnectionError):
            await self.writer.wait_closed()


async def visit(port: int, path: str = "/", method: str = "GET", host: str = "") -> Visitor:
    visitor = Visitor(*await asyncio.open_connection("127.0.0.1", port))
    host = host or f"127.0.0.1:{port}"
    visitor.writer.write(f"{method} {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
    return visitor


async def answer(port: int, path: str = "/", method: str = "GET", host: str = "") -> str:
    visitor = await visit(port, path, method, host)
    head = await visitor.head()
    await visitor.close()
    return head


@in_a_loop
async def test_the_page_comes_with_its_locks() -> None:
    async with serving() as (_, port):
        head = await answer(port)
    assert head.startswith("HTTP/1.1 200 ")
    for line in (
        "Content-Type: text/html; charset=utf-8",
        "Content-Security-Policy: default-src 'none';",
        "X-Content-Type-Options: nosniff",
        "Server: drslamd\r",
    ):
        assert line in head


@in_a_loop
async def test_refusals_have_their_codes_and_the_locks_too() -> None:
    async with serving() as (_, port):
        heads = {
            405: await answer(port, method="POST"),
            421: await answer(port, host=f"evil.example:{port}"),
            404: await answer(port, "/nothing"),
        }
        stream = await answer(port, "/stream", "DELETE")
    for code, head in heads.items():
        assert head.startswith(f"HTTP/1.1 {code} ")
        assert "Content-Security-Policy: default-src 'none';" in head
    assert "Allow: GET\r" in heads[405]
    assert stream.startswith("HTTP/1.1 405 ")


@pytest.mark.parametrize(
    "path",
    [
        "/../server.py",
        "/%2e%2e/server.py",
        "/..%2fserver.py",
        "/static/../../door.py",
        "/app.js%00",
    ],
)
def test_no_way_leads_out_of_the_folder(path: str) -> None:
    @in_a_loop
    async def go() -> None:
        async with serving() as (_, port):
            head = await answer(port, path)
            assert head.split()[1] in ("400", "404")

    go()


@in_a_loop
async def test_a_page_is_told_everything_and_then_what_is_new() -> None:
    async with serving() as (server, port):
        visitor = await visit(port, "/stream")
        assert "Content-Type: text/event-stream" in await visitor.head()
        await until(lambda: len(server.streams) == 1)
        server.tell({"t": 7})
        said = b""
        while b'"t":7' not in said:
            said += await asyncio.wait_for(visitor.reader.read(1_000), 5)
        assert said.index(b'data: {"hello":"1"}') < said.index(b"complete") < said.index(b'"t":7')
        await visitor.close()
        server.tell({"t": 8})
        await until(lambda: not server.streams)


@in_a_loop
async def test_one_page_too_many_is_refused_until_another_is_closed() -> None:
    async with serving() as (server, port):
        visitors = [await visit(port, "/stream") for _ in range(MAX_STREAMS)]
        await until(lambda: len(server.streams) == MAX_STREAMS)
        refused = await answer(port, "/stream")
        assert refused.startswith("HTTP/1.1 503 ")
        assert (await answer(port)).startswith("HTTP/1.1 200 ")
        await visitors[0].close()
        await until(lambda: len(server.streams) < MAX_STREAMS)
        assert (await answer(port, "/stream")).startswith("HTTP/1.1 200 ")
        for visitor in visitors[1:]:
            await visitor.close()


@in_a_loop
async def test_one_connection_too_many_is_hung_up_on() -> None:
    async with serving() as (_, port):
        idle = [
            Visitor(*await asyncio.open_connection("127.0.0.1", port))
            for _ in range(MAX_CONNECTIONS)
        ]
        await asyncio.sleep(0.1)
        late = await visit(port)
        with contextlib.suppress(ConnectionError):
            assert await late.all() == b""
        for visitor in (*idle, late):
            await visitor.close()


@in_a_loop
async def test_a_page_that_does_not_read_is_let_go() -> None:
    async with serving() as (server, port):
        visitor = await visit(port, "/stream")
        await visitor.head()
        await until(lambda: len(server.streams) == 1)
        large = {"t": 1, "filling": "x" * 200_000}
        for _ in range(3 * QUEUE):
            server.tell(large)
            await asyncio.sleep(0)
        await until(lambda: not server.streams)
        await visitor.close()


@in_a_loop
async def test_what_is_no_http_ends_its_own_connection_only() -> None:
    async with serving() as (_, port):
        visitor = Visitor(*await asyncio.open_connection("127.0.0.1", port))
        visitor.writer.write(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" * 40 + b"\r\n\r\n")
        said = await visitor.all()
        assert not said or b" 400 " in said.splitlines()[0]
        await visitor.close()
        assert (await answer(port)).startswith("HTTP/1.1 200 ")


@in_a_loop
async def test_a_port_that_is_taken_is_an_error_of_the_system() -> None:
    async with serving() as (_, port):
        second = Server({}, everything)
        with pytest.raises(OSError, match="in use"):
            await second.open("127.0.0.1", port)
        await second.close()


def test_an_event_is_one_line_of_json_that_every_browser_reads() -> None:
    event = as_event({"words": ["a\nb"], "t": 1.5})
    assert event == b'data: {"words":["a\\nb"],"t":1.5}\n\n'
    assert json.loads(event.removeprefix(b"data: ")) == {"words": ["a\nb"], "t": 1.5}
    with pytest.raises(ValueError, match="JSON"):
        as_event({"t": float("nan")})
    assert served.IDLE_S > 0
