"""How old a pose is for whoever steers, and what telling it costs: a real daemon, real time."""

from __future__ import annotations

import asyncio
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drslamd.io.near_socket import connected
from drslamd.io.status_socket import ask
from drslamd.machine.folders import near_path
from drslamd.near import near_message
from lab.play.playback import Chunk, equip, robot_toml
from lab.play.real_team import PseudoPort, free_port
from lab.recordings import world
from lab.recordings.recording import Array

START_S = 60.0


async def measured(robots: int, seconds: float, computes: bool = True) -> tuple[list[float], float]:
    """Ages of the poses in ms, and how long telling one takes, us of a core.

    Args:
        computes: module 3 of such a team, without a pause.
    """
    hardware = equip(world.simulate(world.Scene(robots=1, seconds=seconds + 2), 1))[0]
    with tempfile.TemporaryDirectory(prefix="drslamd-near-") as name:
        folder = Path(name)
        uwb, wheels = PseudoPort(folder / "uwb"), PseudoPort(folder / "wheels")
        extra = (
            f'[gossip]\ninterface = "127.0.0.1"\nttl = 0\nport = {free_port()}\n'
            f'[daemon]\nstate_dir = "{folder}"\nstatus_socket = "{folder}/socket"\n'
            'log_level = "error"\n'
        )
        config = folder / "robot.toml"
        config.write_text(robot_toml(hardware, str(uwb.name), str(wheels.name), extra))
        word = "compute" if computes else "rest"
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "lab.near.busy_daemon", str(config), str(robots), word),
            stdout=asyncio.subprocess.PIPE,
            env={
                **os.environ,
                "OPENBLAS_NUM_THREADS": "1",
                "PYTHONPATH": os.pathsep.join(sys.path),
            },
        )
        try:
            await _ready(folder / "socket")
            chunks = [c for c in hardware.chunks() if c.port == "wheels" and c.t < seconds]
            playing = asyncio.ensure_future(_play(wheels, chunks))
            read = await asyncio.to_thread(_read, folder / "socket", seconds - 1.0)
            written = await playing
        finally:
            process.terminate()
            said, _ = await process.communicate()
            uwb.pull()
            wheels.pull()
    spent_s, times = said.decode().splitlines()[-1].split()
    return _ages(read, written), 1e6 * float(spent_s) / float(times)


async def _ready(path: Path) -> None:
    for _ in range(int(START_S / 0.1)):
        try:
            await ask(path, "status")
            return
        except (OSError, ValueError):
            await asyncio.sleep(0.1)
    raise AssertionError("the daemon does not answer")


async def _play(port: PseudoPort, chunks: Sequence[Chunk]) -> Array:
    """(k, 2) when each was due and when it was written, us."""
    rows = []
    began = time.monotonic()
    for chunk in chunks:
        wait = began + chunk.t - time.monotonic()
        if wait > 0:
            await asyncio.sleep(wait)
        port.write(chunk.printed())
        rows.append([(began + chunk.t) * 1e6, time.monotonic_ns() / 1e3])
    return np.array(rows)


def _ages(read: Array, written: Array) -> list[float]:
    """ms from measurement to reader; how late the emulated wheels were does not count."""
    due, late = written[:, 0], written[:, 1] - written[:, 0]
    nearest = np.abs(read[:, 1, None] - due).argmin(axis=1)
    ages: list[float] = ((read[:, 0] - read[:, 1] - late[nearest]) / 1e3).tolist()
    return ages


def _read(path: Path, seconds: float) -> Array:
    """(m, 2) when each message was read and the time that it bears, us."""
    rows, end = [], time.monotonic() + seconds
    with connected(near_path(path)) as reader:
        while time.monotonic() < end:
            payload = reader.recv(1 << 16)
            now = time.monotonic_ns() // 1_000
            near = near_message.decode(payload)
            assert not isinstance(near, str), near
            if near.peers.robots:
                rows.append([now, near.utime])
    return np.array(rows, dtype=float).reshape(-1, 2)
