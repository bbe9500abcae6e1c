"""A recording played in real time to real daemons: pseudo-terminals, processes, multicast on lo."""

from __future__ import annotations

import asyncio
import os
import random
import socket
import sys
import tempfile
import time
import tty
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path as FilePath

import numpy as np

from drslamd.config import GossipSection
from drslamd.gossip import lc02, messages
from drslamd.gossip.message_types import PoseState
from drslamd.io.multicast import open_group
from drslamd.io.status_socket import ask
from lab.play.playback import Chunk, Hardware, equip, robot_toml
from lab.play.simulator import Clock
from lab.play.virtual_team import SETTLE_S, add_answers, live_path, skewed_clock
from lab.recordings.recording import Recording
from lab.score.outcome import Outcome

START_S = 20.0
"""Longest wait for a daemon to answer; a loaded machine imports numpy slowly."""
GROUP = "239.255.76.67"


class TeamFailed(Exception):
    """A daemon did not start, or ended before its time."""


class PseudoPort:
    """One end of a serial cable; the other end is a device file with a stable name."""

    def __init__(self, name: FilePath) -> None:
        self.name = name
        self._heard: Callable[[bytes], bytes] | None = None
        self._master = self._slave = -1
        self.plug()

    def plug(self) -> None:
        """Put the cable in."""
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        fresh = self.name.with_suffix(".new")
        fresh.symlink_to(os.ttyname(self._slave))
        fresh.replace(self.name)
        if self._heard:
            asyncio.get_running_loop().add_reader(self._master, self._read)

    def pull(self) -> None:
        """Pull the cable out."""
        if self._master < 0:
            return
        if self._heard:
            asyncio.get_running_loop().remove_reader(self._master)
        os.close(self._master)
        os.close(self._slave)
        self._master = -1
        self.name.unlink(missing_ok=True)

    def answer_with(self, heard: Callable[[bytes], bytes]) -> None:
        """Let a device answer what is written to it."""
        self._heard = heard
        asyncio.get_running_loop().add_reader(self._master, self._read)

    def write(self, data: bytes) -> None:
        """Send; a full line drops, as a real one does."""
        if self._master < 0 or not data:
            return
        try:
            os.write(self._master, data)
        except BlockingIOError:
            return

    def _read(self) -> None:
        try:
            asked = os.read(self._master, 4096)
        except OSError:
            return
        if self._heard:
            self.write(self._heard(asked))


@dataclass
class RealRobot:
    """One daemon with its cables."""

    hardware: Hardware
    clock: Clock
    config: FilePath
    socket: FilePath
    uwb: PseudoPort
    wheels: PseudoPort
    process: asyncio.subprocess.Process | None = None
    log: FilePath = field(default_factory=FilePath)
    tree: FilePath | None = None
    """A checkout of another version, whose daemon it is."""

    async def start(self) -> None:
        """Start the process with a clock of its own."""
        path, module = sys.path, "lab.play.skewed_daemon"
        if self.tree is not None:
            path = [str(self.tree), str(self.tree / "tools")]
            if not (self.tree / "tools/lab/play").is_dir():
                module = "lab.skewed_daemon"  # where it was before there were rooms
        environment = {
            **os.environ,
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONPATH": os.pathsep.join(path),
        }
        with self.log.open("ab") as log:
            program = (sys.executable, "-m", module)
            arguments = (str(self.config), str(self.clock.offset_us), str(self.clock.ppm))
            self.process = await asyncio.create_subprocess_exec(
                *program, *arguments, stderr=log, env=environment, cwd=self.tree
            )

    async def ready(self) -> None:
        """
        Raises:
            TeamFailed: it does not answer.
        """
        for _ in range(int(START_S / 0.1)):
            if self.process is None or self.process.returncode is not None:
                break
            try:
                await ask(self.socket, "status")
                return
            except (OSError, ValueError):
                await asyncio.sleep(0.1)
        raise TeamFailed(
            f"robot {self.hardware.robot} did not start:\n{self.log.read_text()[-2000:]}"
        )

    async def stop(self) -> int:
        """SIGTERM; its exit code."""
        if self.process is None:
            return 0
        if self.process.returncode is None:
            self.process.terminate()
        try:
            return await asyncio.wait_for(self.process.wait(), 10)
        except (asyncio.TimeoutError, TimeoutError):
            self.process.kill()
            return await self.process.wait()


class RealTeam:
    """Daemons in one temporary folder, on one random multicast port."""

    def __init__(
        self,
        recording: Recording,
        hardware: dict[int, Hardware] | None = None,
        extra: str = "",
        seed: int = 0,
        tree: FilePath | None = None,
    ) -> None:
        """
        Args:
            tree: a checkout of another version, whose daemons these are.
        """
        self.recording, self._tree = recording, tree
        self._folder = tempfile.TemporaryDirectory(prefix="drslamd-team-")
        self.folder = FilePath(self._folder.name)
        self.port = free_port()
        rng = np.random.default_rng(seed)
        self._began = 0.0
        self.robots = {
            robot: self._robot(device, skewed_clock(rng), extra)
            for robot, device in (hardware or equip(recording)).items()
        }
        self._live: dict[int, list[messages.Pose]] = {robot: [] for robot in self.robots}

    def _robot(self, hardware: Hardware, clock: Clock, extra: str) -> RealRobot:
        place = self.folder / str(hardware.robot)
        place.mkdir()
        uwb, wheels = PseudoPort(place / "uwb"), PseudoPort(place / "wheels")
        gossip = f'[gossip]\ninterface = "127.0.0.1"\nttl = 0\nport = {self.port}\n'
        daemon = f'[daemon]\nstate_dir = "{place}"\nstatus_socket = "{place}/socket"\n'
        config = place / "robot.toml"
        config.write_text(
            robot_toml(hardware, str(uwb.name), str(wheels.name), gossip + daemon + extra)
        )
        devices = (place / "socket", uwb, wheels)
        return RealRobot(hardware, clock, config, *devices, log=place / "log", tree=self._tree)

    async def __aenter__(self) -> RealTeam:
        try:
            await asyncio.gather(*(robot.start() for robot in self.robots.values()))
            await asyncio.gather(*(robot.ready() for robot in self.robots.values()))
        except BaseException:
            await self._end()
            raise
        for robot in self.robots.values():
            robot.wheels.answer_with(robot.hardware.base.answer)
        self._listener = self._listen()
        return self

    async def __aexit__(self, *_: object) -> None:
        asyncio.get_running_loop().remove_reader(self._listener.fileno())
        self._listener.close()
        await self._end()

    async def _end(self) -> None:
        """Stop who runs, and leave nothing behind."""
        await asyncio.gather(*(robot.stop() for robot in self.robots.values()))
        for robot in self.robots.values():
            robot.uwb.pull()
            robot.wheels.pull()
        self._folder.cleanup()

    def _listen(self) -> socket.socket:
        """Hear what the robots publish, as lcm-spy would."""
        group = open_group(GossipSection(group=GROUP, port=self.port, interface="127.0.0.1", ttl=0))
        asyncio.get_running_loop().add_reader(group.fileno(), self._heard, group)
        return group

    def _heard(self, group: socket.socket) -> None:
        framed = lc02.decode(group.recv(65_536))
        if isinstance(framed, lc02.FramingFault):
            return
        channel, payload = framed
        if messages.kind_of_channel(channel) == "POSE":
            message = messages.decode("POSE", payload)
            if isinstance(message, messages.Pose) and message.state == PoseState.LOCALISED:
                self._live[int(channel.rpartition("_")[2])].append(message)

    async def play(self, progress: Callable[[float], None] | None = None) -> None:
        """Play the recording in real time, then let the team settle."""
        self._began = time.monotonic()
        tasks = [asyncio.ensure_future(self._play(robot)) for robot in self.robots.values()]
        end = self.recording.duration + SETTLE_S
        while (now := time.monotonic() - self._began) < end:
            if progress:
                progress(now)
            dead = [
                r for r in self.robots.values() if r.process and r.process.returncode is not None
            ]
            if dead:
                raise TeamFailed(
                    f"robot {dead[0].hardware.robot} ended:\n{dead[0].log.read_text()[-2000:]}"
                )
            await asyncio.sleep(min(0.5, end - now))
        await asyncio.gather(*tasks)

    async def _play(self, robot: RealRobot) -> None:
        ports = {"uwb": robot.uwb, "wheels": robot.wheels}
        chunk: Chunk
        for chunk in robot.hardware.chunks():
            wait = self._began + chunk.t - time.monotonic()
            if wait > 0:
                await asyncio.sleep(wait)
            ports[chunk.port].write(chunk.printed())

    def clock(self, robot: RealRobot) -> Clock:
        """From the robot's own clock to seconds of the recording (as us)."""
        began_us = round(self._began * 1e6)
        rate = 1 + robot.clock.ppm * 1e-6
        return Clock(robot.clock.offset_us + round(began_us * rate), robot.clock.ppm)

    async def outcome(self) -> Outcome:
        """Ask every daemon for what it knows."""
        out = Outcome()
        for number, robot in self.robots.items():
            clock = self.clock(robot)
            answers = [await ask(robot.socket, q) for q in ("trajectory", "closures", "status")]
            add_answers(out, number, clock, *answers)
            rows = [[clock.world(m.pose_utime) / 1e6, *m.pose, m.frame] for m in self._live[number]]
            out.live[number] = live_path(rows)
            for name, ms in answers[2]["ms"].items():
                out.ms[name] += ms["all"]
        return out


def free_port() -> int:
    """A UDP port that nobody uses now; parallel runs keep out of each other's way."""
    for _ in range(100):
        port = random.randint(20_000, 60_000)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind((GROUP, port))
                return port
            except OSError:
                continue
    raise TeamFailed("no free UDP port in a hundred tries")


async def run(
    recording: Recording,
    hardware: dict[int, Hardware] | None = None,
    extra: str = "",
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    beside: Callable[[int], AbstractAsyncContextManager[None]] | None = None,
) -> Outcome:
    """Start a team, play the recording to it, ask it.

    Args:
        beside: what runs meanwhile; it is told the port of the group.
    """
    async with RealTeam(recording, hardware, extra, seed) as team:
        async with beside(team.port) if beside else nullcontext():
            await team.play(progress)
        return await team.outcome()
