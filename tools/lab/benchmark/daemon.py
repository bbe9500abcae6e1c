"""Three real daemons on emulated hardware: what one of them takes of the machine.

What a daemon takes depends on the machine and on what else it does, so it is compared with what
runs at the same time: daemons of another version on the same recording, where a checkout of it is
there, and one window of grid + least_squares now and then.
"""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drslamd.io.status_socket import ask
from lab.benchmark import module1, timing, windows
from lab.benchmark.rows import Row
from lab.play.real_team import RealRobot, RealTeam
from lab.recordings import world

SCENE = world.Scene(robots=3, speed=0.2)
"""UWB at 50 Hz from both ends, odometry at 50 Hz."""
SECONDS = {True: 20.0, False: 90.0}
GOALS = {"before": 0.7, "MB": 80.0, "s": 1.2, "ms": 5.0}
BEFORE = "DRSLAMD_BEFORE"
"""Names a checkout of another version."""
TAU = 50
YARDSTICK_S = 1.0
"""Between two windows of the grid."""
TICK_S = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Taken:
    """By the busiest of three daemons.

    Attributes:
        share: of a core while driving.
        memory: MB.
        ready: CPU seconds until it answers.
        lag: ms of its event loop, 99 %.
    """

    share: float
    memory: float
    ready: float
    lag: float


def rows(quick: bool) -> Iterator[Row]:
    """The busiest of three daemons, in real time."""
    before = os.environ.get(BEFORE)
    trees: list[Path | None] = [None, *([Path(before).resolve()] if before else [])]
    (ours, *others), grid_ms = asyncio.run(_measured(SECONDS[quick], trees))
    work = "daemon, busiest of 3 robots at 50 Hz"
    yield Row(0, f"{work}, share of a core", ours.share, "ratio")
    grids = f"{work}, a second of it in windows of {module1.GRID}, tau {TAU}"
    yield Row(0, grids, 1e3 * ours.share / grid_ms, "ratio")
    for other in others:
        beside = f"{work}, share over that of {BEFORE} at the same time"
        yield Row(0, beside, ours.share / other.share, "ratio", GOALS["before"])
    yield Row(0, f"{work}, resident", ours.memory, "MB", GOALS["MB"])
    yield Row(0, f"{work}, CPU until it answers", ours.ready, "s", GOALS["s"])
    yield Row(0, f"{work}, lag of its event loop, p99", ours.lag, "ms", GOALS["ms"])


async def _measured(seconds: float, trees: list[Path | None]) -> tuple[list[Taken], float]:
    """What a team of each tree takes, all at the same time, and ms of a window of the grid.

    Args:
        trees: checkouts of other versions; None is this one.
    """
    grids: list[float] = []
    recording = world.simulate(replace(SCENE, seconds=seconds), 1)
    teams = [RealTeam(recording, tree=tree) for tree in trees]
    for team in teams:
        await team.__aenter__()
    try:
        ready = [[_cpu_s(robot) for robot in team.robots.values()] for team in teams]
        yardstick = asyncio.ensure_future(_yardstick(grids))
        began = time.monotonic()
        await asyncio.gather(*(team.play() for team in teams))
        elapsed = time.monotonic() - began
        yardstick.cancel()
        taken = [await _taken(t, r, elapsed) for t, r in zip(teams, ready, strict=True)]
    finally:
        for team in teams:
            await team.__aexit__()
    return taken, float(np.median(grids))


async def _yardstick(grids: list[float]) -> None:
    """How many ms a window of the grid takes, again and again."""
    window = windows.window(np.random.default_rng(TAU), TAU)[0]
    while True:
        began = timing.now_ms()
        module1.grid(window)
        grids.append(timing.now_ms() - began)
        await asyncio.sleep(YARDSTICK_S)


async def _taken(team: RealTeam, ready: list[float], elapsed: float) -> Taken:
    robots = list(team.robots.values())
    shares = [(_cpu_s(r) - before) / elapsed for r, before in zip(robots, ready, strict=True)]
    lags = [(await ask(robot.socket, "status"))["loop_lag_ms"]["p99"] for robot in robots]
    return Taken(max(shares), max(_resident_mb(robot) for robot in robots), max(ready), max(lags))


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
