"""Numerics never block the loop: sensors are read on time while a solve runs."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lab.play.playback import equip, robot_toml
from lab.play.real_team import PseudoPort, free_port
from lab.recordings import world

from drslamd.config import parse
from drslamd.daemon import Daemon
from drslamd.events import Event, SerialData, Solve
from drslamd.io.ports.reading_round import PERIOD_S
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose import solver
from drslamd.slam.relative_pose.estimate import PairNoise
from drslamd.slam.relative_pose.window import Window

pytestmark = pytest.mark.slow


def long_solve() -> int:
    """Three seconds of module 1, as one job."""
    rng = np.random.default_rng(0)
    poses = np.cumsum(rng.normal(size=(60, 3)) * 0.05, axis=0)
    times, ranges, antenna = np.linspace(-30, 0, 60), rng.uniform(2, 8, 60), np.zeros(2)
    window = Window(times, ranges, poses, poses[::-1], antenna, antenna)
    odometry = OdometryNoise(0.03, 0.0026, 0.01, 0.0087)
    noise = PairNoise(RangeNoise(0.1, 0.3), odometry, odometry)
    count, end = 0, time.monotonic() + 3.0
    while time.monotonic() < end:
        solver.solve(window, noise, 0.1)
        count += 1
    return count


@pytest.mark.row("O9")
def test_bytes_are_stamped_on_time_while_a_solve_runs(tmp_path: Path) -> None:
    async def run() -> tuple[list[float], int]:
        hardware = equip(world.simulate(world.Scene(robots=1, seconds=1.0), 0))[0]
        uwb, wheels = PseudoPort(tmp_path / "uwb"), PseudoPort(tmp_path / "wheels")
        extra = (
            f'[gossip]\ninterface = "127.0.0.1"\nttl = 0\nport = {free_port()}\n'
            f'[daemon]\nstate_dir = "{tmp_path}"\nlog_level = "error"\n'
        )
        daemon = Daemon(parse(robot_toml(hardware, str(uwb.name), str(wheels.name), extra)))
        lags: list[float] = []
        written: dict[bytes, float] = {}
        solved: list[Any] = []
        handle = daemon.robot.handle

        def watched(event: Event) -> Any:
            if isinstance(event, SerialData) and event.port == "uwb":
                for frame in [frame for frame in written if frame in event.data]:
                    lags.append(event.utime / 1e6 - written.pop(frame))
            if type(event).__name__ == "JobDone" and event.job_id == -1:  # type: ignore[union-attr]
                solved.append(event.result)  # type: ignore[union-attr]
                return []
            return handle(event)

        daemon.robot.handle = watched  # type: ignore[method-assign]
        task = asyncio.ensure_future(daemon.run())
        await asyncio.sleep(0.5)
        daemon._perform(Solve(-1, "relative_pose", long_solve))
        for k in range(300):
            frame = hardware.uwb.frame(k * 0.01, [(7, 5.0)])
            written[frame] = time.monotonic()
            uwb.write(frame)
            await asyncio.sleep(0.01)
        while not solved:
            await asyncio.sleep(0.05)
        daemon.stop()
        await task
        uwb.pull()
        wheels.pull()
        return lags, solved[0]

    lags, windows = asyncio.run(asyncio.wait_for(run(), 30))
    assert windows > 100
    assert len(lags) >= 280
    # read in rounds; what the clock of the module reads is told by those that wait for none
    assert np.percentile(lags, 99) < PERIOD_S + 0.060
    assert np.percentile(lags, 5) < 0.005
