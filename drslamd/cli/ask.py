"""A question to the running daemon of one configuration."""

from __future__ import annotations

import asyncio
import sys
from typing import Any

from drslamd.cli.parser import load
from drslamd.daemon import socket_to_ask
from drslamd.io.status_socket import ask


def ask_daemon(config_path: str, question: str) -> Any:
    """The answer, or None when none came, which has been said."""
    path = socket_to_ask(load(config_path))
    try:
        return asyncio.run(ask(path, question))
    except (OSError, ValueError, asyncio.TimeoutError) as error:
        print(f"no daemon answers at {path}: {error}", file=sys.stderr)
        return None
