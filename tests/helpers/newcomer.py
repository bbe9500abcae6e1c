"""Somebody who has read the first page: a clone, its first command, and the map in a browser.

Runs in a network of its own, where the port of the page is free and no other team is heard.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator
from pathlib import Path

from browser import Tab, tab

PATIENCE_S = 300.0
"""What the first page promises: from the clone to a map on which robots move."""
ROBOTS = 3
FAR_M = 0.3
SEEN = (
    "Object.fromEntries(liveMap.map.spots.filter((s) => s.id !== undefined)"
    ".map((s) => [s.id, [liveMap.camera.fromX(s.x), liveMap.camera.fromY(s.y)]]))"
)
"""Where robots are drawn, m."""


@contextlib.asynccontextmanager
async def typed(lines: list[str], folder: Path, log: Path) -> AsyncIterator[None]:
    """A shell that is given these lines, one after the other; it ends with Ctrl-C."""
    with log.open("wb") as out:
        shell = await asyncio.create_subprocess_exec(
            *("sh", "-ec", "\n".join(lines)),
            cwd=folder,
            stdout=out,
            stderr=out,
            start_new_session=True,
            # what is run is the clone, not what the test runs in
            env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        )
        try:
            yield
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(shell.pid, signal.SIGINT)
            await asyncio.wait_for(shell.wait(), 30)


async def address(log: Path) -> str:
    """What the demo says is to be opened."""
    began = time.monotonic()
    while (found := re.search(r"live map: (\S+)", log.read_text())) is None:
        assert time.monotonic() - began < PATIENCE_S, log.read_text()
        await asyncio.sleep(0.1)
    return found[1]


async def all_move(page: Tab) -> None:
    """Wait until every robot has left the place where it is drawn now."""
    before = await page.run(SEEN)
    gone = [
        f"Math.hypot({SEEN}[{robot}][0] - {x}, {SEEN}[{robot}][1] - {y}) > {FAR_M}"
        for robot, (x, y) in before.items()
    ]
    await page.until(" && ".join(gone))


async def go(folder: Path, lines: list[str]) -> None:
    """Type the lines, open the address, look; what was seen is printed as JSON."""
    log, began = folder / "log", time.monotonic()
    log.touch()
    async with typed(lines, folder, log):
        url = await address(log)
        async with tab() as page:
            await page.open(url)
            await page.until(f"window.liveMap && Object.keys({SEEN}).length === {ROBOTS}", 75.0)
            await all_move(page)
            seen: dict[str, object] = {"url": url, "complaints": page.complaints}
            seen["seconds"] = time.monotonic() - began
    print(json.dumps(seen))


if __name__ == "__main__":
    for command in ("link set lo up multicast on", "route add 224.0.0.0/4 dev lo"):
        subprocess.run(["ip", *command.split()], check=True)
    asyncio.run(go(Path(sys.argv[1]), sys.argv[2:]))
