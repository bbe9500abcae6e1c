"""A robot's set-up with one fault in it: what `check` says of it, and what `run` does.

`run` goes as far as it would on a robot: it refuses, or a real daemon runs until it has tried its
ports and its network, and says what it waits for.
"""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import io
import os
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest
import structlog.testing

from drslamd import cli, memory
from drslamd.cli import run as run_verb
from drslamd.config import Config
from drslamd.daemon import Daemon
from drslamd.events import Tick
from drslamd.gossip.seal import KEY_BYTES

NOBODY = 65_534
UDP_PORT = 47_123
SECRET = "5e" * KEY_BYTES
PATIENCE_S = 8.0
ALONE = "not localised: no other robot is heard", "not localised: the network has just been joined"
"""What a daemon in good order says here: nobody else is there."""

TOML = """\
[robot]
id = 3
[team]
key_file = "team.key"
[uwb]
port = "UWB"
[wheels]
source = "kobuki"
port = "WHEELS"
[gossip]
interface = "127.0.0.1"
ttl = 0
port = 47123
[daemon]
state_dir = "STATE"
log_level = "error"
"""
SERIAL_WHEELS = '[wheels]\nsource = "kobuki"\nport = "WHEELS"\n'


class Verdict(NamedTuple):
    """What a program said: exit code, all lines, without the name of the file."""

    code: int
    lines: list[str]

    @property
    def first(self) -> str:
        return self.lines[0] if self.lines else ""


class Setup:
    """A folder with everything that a robot needs; both its ports are there."""

    def __init__(self, folder: Path, uwb: str, wheels: str) -> None:
        self.folder, self.config = folder, folder / "3.toml"
        self.key, self.state = folder / "team.key", folder / "state"
        self.uwb, self.ports = uwb, (uwb, wheels)
        self._held: list[int] = []
        self._ports = {"UWB": uwb, "WHEELS": wheels, "STATE": str(self.state)}
        self.key.write_text(SECRET)
        self.key.chmod(0o600)
        self.state.mkdir()
        self.write(TOML)

    def write(self, text: str) -> None:
        for name, value in self._ports.items():
            text = text.replace(name, value)
        self.config.write_text(text)

    def change(self, *changes: tuple[str, str]) -> None:
        """Replace text of the good configuration."""
        text = TOML
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new)
        self.write(text)

    def hold(self, port: str) -> None:
        """As another program does."""
        self._held.append(os.open(port, os.O_RDWR | os.O_NOCTTY))
        fcntl.flock(self._held[-1], fcntl.LOCK_EX)

    def take_udp_port(self) -> None:
        """As a program does that does not share it."""
        other = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        other.bind(("", UDP_PORT))
        self._held.append(other.detach())

    def close(self) -> None:
        for descriptor in self._held:
            os.close(descriptor)

    def check(self) -> Verdict:
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            code = cli.main(["check", "-c", str(self.config)])
        *lines, verdict = said.getvalue().splitlines()
        assert verdict.startswith("verdict: ")
        return Verdict(code, [self._plain(line) for line in lines])

    def run(self) -> Verdict:
        """As far as it comes; of a daemon that runs, its problems."""
        problems: list[str] = []

        def serve(config: Config) -> int:
            with structlog.testing.capture_logs() as logged:
                problems.extend(asyncio.run(_problems_of(Daemon(config))))
            told = [str(entry["what"]) for entry in logged if "what" in entry]
            problems.extend(what for what in told if what not in problems)
            return 0

        said = io.StringIO()
        with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stderr(said):
            patch.setattr(run_verb, "_serve", serve)
            patch.setattr(run_verb, "_heed_signals", lambda: None)
            patch.setattr(memory, "LISTEN_US", 0)  # who cannot write its state would wait
            code = cli.main(["run", "-c", str(self.config)])
        refused = [self._plain(line) for line in said.getvalue().splitlines()]
        return Verdict(code, refused + [what for what in problems if not what.startswith(ALONE)])

    def _plain(self, line: str) -> str:
        return line.removeprefix(f"{self.config}: ").removeprefix("warning: ")


async def _problems_of(daemon: Daemon) -> list[str]:
    """What a daemon waits for once it has tried everything."""
    task = asyncio.ensure_future(daemon.run())
    robot, clock = daemon.robot, daemon._clock

    def has_tried() -> bool:
        return len(robot.ports) == 2 and robot.network is not None

    async def until_tried() -> None:
        while not has_tried():
            await asyncio.sleep(0.005)
            assert not task.done(), task

    await asyncio.wait_for(until_tried(), PATIENCE_S)
    utime = clock.now() + 1_100_000
    daemon.handle(Tick(utime))
    while robot.next_tick <= utime:
        daemon.handle(Tick(utime))
    problems = list(robot.health.sentences().values())
    daemon.stop()
    await task
    return problems


@contextmanager
def healthy() -> Iterator[Setup]:
    """A set-up without a fault, in a folder that everybody may enter."""
    with tempfile.TemporaryDirectory(prefix="drslamd-") as name, pseudo_ports(2) as (uwb, wheels):
        os.chmod(name, 0o755)
        setup = Setup(Path(name), uwb, wheels)
        try:
            yield setup
        finally:
            setup.close()


@contextmanager
def pseudo_ports(count: int) -> Iterator[list[str]]:
    """Terminals of the kind that serial ports are; their other ends stay open."""
    pairs = [os.openpty() for _ in range(count)]
    try:
        names = [os.ttyname(ours) for _, ours in pairs]
        for _, ours in pairs:
            os.close(ours)
        yield names
    finally:
        for far, _ in pairs:
            os.close(far)


def give_away(setup: Setup) -> None:
    """To the ordinary user that root is about to be."""
    if os.getuid() == 0:
        for path in (setup.folder, setup.config, setup.key, setup.state, *setup.ports):
            os.chown(path, NOBODY, NOBODY)


@contextmanager
def nobody() -> Iterator[None]:
    """Be an ordinary user for a while: root steps aside, others are one."""
    if os.getuid() != 0:
        yield
        return
    os.setegid(NOBODY)
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)
        os.setegid(0)
