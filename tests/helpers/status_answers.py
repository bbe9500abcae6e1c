"""A status socket with a set answer, in the place of a daemon."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from drslamd.io.status_socket import StatusSocket

WITHOUT_DEVICES = """
[robot]
id = {robot}
[team]
insecure = true
[uwb]
port = "/dev/none"
[wheels]
source = "kobuki"
port = "/dev/none"
[daemon]
status_socket = "{socket}"
"""
"""A configuration that leads to a status socket, and to no device."""


@contextmanager
def answering(path: Path, answer: Any, question: str = "trajectory") -> Iterator[None]:
    """A daemon that knows one question."""
    with answering_all(path, {question: answer}):
        yield


@contextmanager
def answering_all(path: Path, answers: Mapping[str, Any]) -> Iterator[None]:
    """A status socket in a thread of its own, as the daemon has one."""
    ready = threading.Event()
    ends: list[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = []

    questions: dict[str, Callable[[], Any]] = {
        name: partial(dict, answer) for name, answer in answers.items()
    }

    async def serve() -> None:
        server, end = StatusSocket(path, questions), asyncio.Event()
        assert await server.open() == ""
        ends.append((asyncio.get_running_loop(), end))
        ready.set()
        await end.wait()
        await server.close()

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    try:
        assert ready.wait(10)
        yield
    finally:
        loop, end = ends[0]
        loop.call_soon_threadsafe(end.set)
        thread.join()
