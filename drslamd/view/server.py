"""Hands out the page, and to each page that is open a stream of updates (server-sent events).

A stream goes one way, so there is nothing that a page could tell us. Who cannot keep up with it is
let go and comes back for a fresh picture; how many may come is bounded.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from aiohttp import web

from drslamd.view.door import HEADERS, Door, File, TurnedAway

MAX_STREAMS = 16
"""Pages that are open at once; with a second's work for each when they come."""
MAX_CONNECTIONS = 64
"""Whoever comes then is hung up on: a browser opens up to six for one page."""
QUEUE = 100
"""Updates that wait for one page, ten seconds of them; a page that is slower is let go."""
IDLE_S = 15.0
"""How long a connection is kept that asks for nothing."""

Piece = dict[str, Any]


class Server:
    """Answers browsers.

    Attributes:
        streams: the updates that wait for each page that is open.
    """

    def __init__(
        self, files: Mapping[str, File], everything: Callable[[], Iterator[Piece]]
    ) -> None:
        """
        Args:
            files: of the page, by path.
            everything: what a page that has just come is told, in pieces.
        """
        self._files, self._everything = files, everything
        self._door: Door | None = None
        self.streams: dict[asyncio.Task[Any], asyncio.Queue[bytes]] = {}
        self._runner: web.ServerRunner | None = None
        self._listening: asyncio.Server | None = None

    async def open(self, listen: str, port: int) -> int:
        """Listen; the port, which is one that is free for port 0.

        Raises:
            OSError: it is taken, or no such address is here.
        """
        server = web.Server(
            self._answer,
            access_log=None,
            keepalive_timeout=IDLE_S,
            lingering_time=0.0,
            handler_cancellation=True,  # a page that was closed frees its place at once
        )

        def connection() -> asyncio.BaseProtocol:
            return _HungUp() if len(server.connections) >= MAX_CONNECTIONS else server()

        loop = asyncio.get_running_loop()
        self._listening = await loop.create_server(connection, listen, port)
        opened = int(self._listening.sockets[0].getsockname()[1])
        self._door = Door(listen, opened, self._files)
        self._runner = web.ServerRunner(server, handle_signals=False)
        await self._runner.setup()
        return opened

    async def close(self) -> None:
        """Hang up on everybody."""
        if self._listening is None or self._runner is None:
            return
        self._listening.close()
        for task in list(self.streams):
            task.cancel()
        await self._runner.cleanup()

    def tell(self, piece: Piece) -> None:
        """An update for all pages."""
        if not self.streams:
            return
        event = as_event(piece)
        for task, queue in list(self.streams.items()):
            if queue.full():
                task.cancel()
            else:
                queue.put_nowait(event)

    async def _answer(self, request: web.BaseRequest) -> web.StreamResponse:
        assert self._door is not None
        verdict = self._door.judge(
            request.method,
            request.headers.getall("Host", []),
            request.headers.get("Sec-Fetch-Site", ""),
            request.path,
        )
        if verdict is None:
            full = len(self.streams) >= MAX_STREAMS
            return _refused(TurnedAway.FULL) if full else await self._stream(request)
        if isinstance(verdict, File):
            headers = {**HEADERS, "Content-Type": verdict.kind}
            return web.Response(body=verdict.content, headers=headers)
        return _refused(verdict)

    async def _stream(self, request: web.BaseRequest) -> web.StreamResponse:
        task = asyncio.current_task()
        assert task is not None
        queue: asyncio.Queue[bytes] = asyncio.Queue(QUEUE)
        self.streams[task] = queue
        try:
            response = web.StreamResponse(
                headers={**HEADERS, "Content-Type": "text/event-stream; charset=utf-8"}
            )
            await response.prepare(request)
            for piece in self._everything():
                await response.write(as_event(piece))
                await asyncio.sleep(0)
            while True:
                await response.write(await queue.get())
        except ConnectionError:
            return response  # the page was closed
        finally:
            del self.streams[task]


class _HungUp(asyncio.Protocol):
    """In the place of a connection that is one too many."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        transport.close()


def _refused(refusal: TurnedAway) -> web.Response:
    code, why = refusal.value
    extra = {"Allow": "GET"} if refusal is TurnedAway.METHOD else {}
    headers = {**HEADERS, **extra, "Content-Type": "text/plain; charset=utf-8"}
    return web.Response(status=code, text=why + "\n", headers={**headers, "Connection": "close"})


def as_event(piece: Piece) -> bytes:
    """One update as a server-sent event."""
    text = json.dumps(piece, separators=(",", ":"), allow_nan=False)
    return f"data: {text}\n\n".encode()
