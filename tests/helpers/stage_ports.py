"""Ports for pages."""

from __future__ import annotations

import asyncio


async def free_port() -> int:
    """A TCP port that nobody uses now."""
    probe = await asyncio.start_server(lambda r, w: None, "127.0.0.1", 0)
    port = int(probe.sockets[0].getsockname()[1])
    probe.close()
    await probe.wait_closed()
    return port
