"""A daemon without its ports, on a clock that stands: what is done to it, what it is seen to do."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from drslamd.config import Config, parse
from drslamd.daemon import Daemon
from drslamd.events import Effect, Event

CONFIG = """
[robot]
id = 1
[team]
insecure = true
trust_everyone_on = "239.255.76.67"
[uwb]
port = "/dev/none"
[wheels]
source = "kobuki"
port = "/dev/none"
[daemon]
log_level = "error"
"""


class Stepped:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.utime = 1_000_000_000

    def now(self) -> int:
        return self.utime


def configured(tmp_path: Path, more: str = "") -> Config:
    return parse(f'{CONFIG}state_dir = "{tmp_path / "state"}"\n{more}')


def heard_by(daemon: Daemon) -> list[Event]:
    """What the robot that the daemon has now is told from now on; it answers nothing."""
    heard: list[Event] = []

    def handle(event: Event) -> list[Effect]:
        heard.append(event)
        return []

    daemon.robot.handle = handle  # type: ignore[method-assign]
    return heard


def with_worker(daemon: Daemon, scene: Callable[[], Awaitable[None]]) -> None:
    """Play a scene in a loop, with the thread for computations and without the ports."""

    async def run() -> None:
        daemon._worker.start()
        daemon._disk.start()
        try:
            await asyncio.wait_for(scene(), 10)
        finally:
            daemon._worker.stop()
            daemon._disk.stop()
            if daemon._timer is not None:
                daemon._timer.cancel()

    asyncio.run(run())


async def until(what: Callable[[], object]) -> None:
    while not what():
        await asyncio.sleep(0.002)


def kept(tmp_path: Path) -> dict[str, Any]:
    state: dict[str, Any] = json.loads((tmp_path / "state" / "robot-1.json").read_text())
    return state
