"""What only the process knows of itself, and says in `drslamd status`."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from drslamd.config import parse
from drslamd.conventions import MILLISECOND_US
from drslamd.daemon import Daemon
from drslamd.events import Send

CONFIG = """
[robot]
id = 1
[team]
insecure = true
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


@pytest.fixture
def clock() -> Stepped:
    return Stepped()


@pytest.fixture
def daemon(tmp_path: Path, clock: Stepped) -> Daemon:
    """One that was not started."""
    return Daemon(parse(f'{CONFIG}state_dir = "{tmp_path}"\n'), clock)


def test_what_the_network_did_not_take_is_in_the_status(daemon: Daemon) -> None:
    assert daemon._picture()["network"]["dropped"] == 0
    for _ in range(3):
        daemon._perform(Send("DRSLAM_STATUS_001", b""))
    assert daemon._picture()["network"]["dropped"] == 3


@pytest.mark.parametrize("late_ms", [0, 25])
def test_how_late_the_loop_was_is_in_the_status(
    daemon: Daemon, clock: Stepped, late_ms: int
) -> None:
    async def one_tick() -> None:
        daemon.robot.timers.next = clock.utime + 10 * MILLISECOND_US
        daemon._wake()
        clock.utime += (10 + late_ms) * MILLISECOND_US
        while daemon.robot.next_tick <= clock.utime:
            await asyncio.sleep(0.001)
        assert daemon._timer is not None
        daemon._timer.cancel()

    asyncio.run(asyncio.wait_for(one_tick(), 5))
    assert daemon._picture()["loop_lag_ms"] == {"median": late_ms, "p99": late_ms}
