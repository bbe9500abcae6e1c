"""Three real daemons on emulated hardware: what one of them takes of the machine."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from drslamd.io.status_socket import ask
from lab.benchmark.rows import Row
from lab.play.real_team import RealRobot, RealTeam
from lab.recordings import world

SCENE = world.Scene(robots=3, speed=0.2)
"""UWB at 50 Hz from both ends, odometry at 50 Hz."""
SECONDS = {True: 20.0, False: 90.0}
GOALS = {"share": 0.05, "MB": 90.0, "s": 1.2, "ms": 20.0}
TICK_S = os.sysconf("SC_CLK_TCK")


def rows(quick: bool) -> Iterator[Row]:
    """The busiest of three daemons, in real time."""
    share, memory, ready, lag = asyncio.run(_measured(SECONDS[quick]))
    work = "daemon, busiest of 3 robots at 50 Hz"
    yield Row(0, f"{work}, share of a core", share, "ratio", GOALS["share"])
    yield Row(0, f"{work}, resident", memory, "MB", GOALS["MB"])
    yield Row(0, f"{work}, CPU until it answers", ready, "s", GOALS["s"])
    yield Row(0, f"{work}, lag of its event loop, p99", lag, "ms", GOALS["ms"])


async def _measured(seconds: float) -> tuple[float, float, float, float]:
    """Share of a core while driving, MB, CPU seconds until it answers, ms of lag (99 %)."""
    recording = world.simulate(replace(SCENE, seconds=seconds), 1)
    async with RealTeam(recording) as team:
        robots = list(team.robots.values())
        ready = [_cpu_s(robot) for robot in robots]
        began = time.monotonic()
        await team.play()
        taken = time.monotonic() - began
        shares = [(_cpu_s(r) - before) / taken for r, before in zip(robots, ready, strict=True)]
        memory = [_resident_mb(robot) for robot in robots]
        lags = [(await ask(robot.socket, "status"))["loop_lag_ms"]["p99"] for robot in robots]
    return max(shares), max(memory), max(ready), max(lags)


def _proc(robot: RealRobot, name: str) -> str:
    if robot.process is None:
        raise AssertionError("the daemon was never started")
    return Path(f"/proc/{robot.process.pid}/{name}").read_text()


def _cpu_s(robot: RealRobot) -> float:
    fields = _proc(robot, "stat").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK_S


def _resident_mb(robot: RealRobot) -> float:
    line = next(row for row in _proc(robot, "status").splitlines() if row.startswith("VmRSS"))
    return int(line.split()[1]) * 1024 / 1e6
