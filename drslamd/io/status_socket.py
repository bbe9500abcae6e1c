"""Questions over a local socket: one line with a word in, one line of JSON out."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

LONGEST_QUESTION = 256
PATIENCE_S = 5.0
MAX_PATH_BYTES = 107
"""Of a socket, without its final NUL; unix(7)."""
PATH_TOO_LONG = "AF_UNIX path too long"
"""What Python says of a longer one."""


def cannot_listen(path: Path, reason: str) -> str:
    """What is said of questions that cannot come."""
    return f"cannot listen at {path}: {reason}"


class StatusSocket:
    """Serves a table of questions."""

    def __init__(self, path: Path, questions: Mapping[str, Callable[[], Any]]) -> None:
        self._path = path
        self._questions = questions
        self._server: asyncio.AbstractServer | None = None

    async def open(self) -> str:
        """Start to listen; why that failed, or an empty string."""
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._path.unlink(missing_ok=True)
            self._server = await asyncio.start_unix_server(
                self._serve, str(self._path), limit=LONGEST_QUESTION
            )
            os.chmod(self._path, 0o660)
        except OSError as error:
            return cannot_listen(self._path, error.strerror or str(error))
        return ""

    async def close(self) -> None:
        if self._server is not None:
            self._server.close()
            self._path.unlink(missing_ok=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            line = await asyncio.wait_for(reader.readline(), PATIENCE_S)
            question = line.decode("ascii", "replace").strip()
            answer = self._questions.get(question)
            reply = answer() if answer else {"error": f"ask one of {', '.join(self._questions)}"}
            writer.write(json.dumps(reply).encode() + b"\n")
            await asyncio.wait_for(writer.drain(), PATIENCE_S)
        except (asyncio.TimeoutError, TimeoutError, ConnectionError, ValueError):
            # a client that is slow, gone or says too much is its own loss
            pass
        finally:
            writer.close()


async def ask(path: Path, question: str) -> Any:
    """One question to a daemon.

    Raises:
        OSError: nobody listens there.
        ValueError: the answer is not JSON.
    """
    reader, writer = await asyncio.open_unix_connection(str(path), limit=1 << 28)
    try:
        writer.write(question.encode() + b"\n")
        await writer.drain()
        return json.loads(await asyncio.wait_for(reader.readline(), 30.0))
    finally:
        writer.close()
