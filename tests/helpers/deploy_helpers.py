"""A real daemon process for tests: its configuration, its notifications, its log.

As root the process runs without capabilities: it owns root's files and may do no more with them
than their modes say, as an ordinary user may with his.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pages

REPOSITORY = Path(__file__).resolve().parents[2]
EXAMPLE = REPOSITORY / "etc" / "drslamd.toml"
UWB = "/dev/serial/by-id/usb-1a86_USB_Single_Serial_LINKTRACK-if00"
WHEELS = "/dev/serial/by-id/usb-Yujin_Robot_iClebo_Kobuki_kobuki_NUMBER-if00-port0"
"""The two ports of the example; no machine has them."""

LONGEST_STOP_S = 2.0
"""What systemd and the users are promised."""
NO_CAPABILITIES = ["setpriv", "--bounding-set", "-all", "--inh-caps", "-all"]
ORDINARY = os.getuid() != 0 or shutil.which("setpriv") is not None
"""Whether file modes mean anything to the processes that are started here."""


def lines_on_a_robot() -> tuple[list[str], list[str]]:
    """What the first page has one type: with the package, and what stands in for it in a clone."""
    page = pages.read("README.md", (REPOSITORY / "README.md").read_text())
    (packaged,) = (block for block in page.blocks if "apt install ./drslamd" in block)
    (cloned,) = (block for block in page.blocks if "-m venv /opt/drslamd" in block)
    return packaged.splitlines(), cloned.splitlines()


def local(text: str, folder: Path) -> str:
    """A configuration that speaks to this host alone and keeps its files in `folder`."""
    port = random.SystemRandom().randint(20_000, 60_000)
    for key, value in {
        "interface": '"127.0.0.1"',
        "port": str(port),
        "ttl": "0",
        "state_dir": f'"{folder / "state"}"',
        "status_socket": f'"{folder / "socket"}"',
    }.items():
        lines = text.splitlines()
        at = [i for i, line in enumerate(lines) if line.startswith(f"#{key} = ")]
        lines[at[-1]] = f"{key} = {value}"
        text = "\n".join(lines) + "\n"
    return text


def example_in(folder: Path, *changes: tuple[str, str]) -> Path:
    """The shipped example, made `local` and without its key, with some text replaced."""
    text = local(EXAMPLE.read_text(), folder)
    text = re.sub("(?m)^key_file = .*", "insecure = true", text)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "robot.toml"
    path.write_text(text)
    return path


def command(*arguments: str, fault: str = "") -> list[str]:
    """`drslamd` with these arguments, without privileges, and maybe with a planted fault."""
    drop = NO_CAPABILITIES if os.getuid() == 0 and ORDINARY else []
    faulty = str(REPOSITORY / "tests" / "deploy" / "faulty_daemon.py")
    program = [faulty, fault] if fault else ["-m", "drslamd"]
    return [*drop, sys.executable, *program, *arguments]


def environment(**extra: str) -> dict[str, str]:
    """Of a process that starts as on a robot: no manager's, and with its bytecode kept."""
    foreign = (
        *("NOTIFY_SOCKET", "WATCHDOG_USEC", "STATE_DIRECTORY", "RUNTIME_DIRECTORY"),
        "PYTHONDONTWRITEBYTECODE",
    )
    kept = {name: value for name, value in os.environ.items() if name not in foreign}
    return {**kept, "PYTHONPATH": str(REPOSITORY), **extra}


class Manager:
    """What a service manager does for a notification socket: it listens."""

    def __init__(self, folder: Path) -> None:
        self.address = str(folder / "notify")
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(self.address)
        self.heard: list[tuple[float, str]] = []

    def wait_for(self, start: str, patience: float = 10.0) -> str:
        """The next message that begins so."""
        end = time.monotonic() + patience
        while True:
            self._socket.settimeout(max(end - time.monotonic(), 1e-3))
            message = self._socket.recv(65_536).decode()
            self.heard.append((time.monotonic(), message))
            if message.startswith(start):
                return message

    def listen(self, seconds: float) -> None:
        """Hear what there is to hear."""
        with contextlib.suppress(TimeoutError):
            self.wait_for("nothing begins so", seconds)

    def times(self, start: str) -> list[float]:
        return [when for when, message in self.heard if message.startswith(start)]

    def close(self) -> None:
        self._socket.close()


class Daemon:
    """`drslamd run` as the service manager runs it; a context that leaves nothing behind."""

    def __init__(self, config: Path, fault: str = "", **extra: str) -> None:
        self.config = config
        self.manager = Manager(config.parent)
        self._log = config.parent / "log"
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                command("run", "-c", str(config), fault=fault),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env=environment(NOTIFY_SOCKET=self.manager.address, **extra),
                cwd=config.parent,
            )

    def __enter__(self) -> Daemon:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        self.manager.close()
        Path(self.manager.address).unlink()

    @property
    def log(self) -> str:
        return self._log.read_text()

    def signal(self, number: signal.Signals) -> None:
        self._process.send_signal(number)

    def wait(self, patience: float = 10.0) -> int:
        """Its exit code, negative for a signal."""
        return self._process.wait(patience)

    def is_alive(self) -> bool:
        return self._process.poll() is None

    def ask(self, *options: str) -> str:
        done = subprocess.run(
            command("status", "-c", str(self.config), *options),
            capture_output=True,
            text=True,
            env=environment(),
            timeout=20,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    def state(self, robot: int = 1) -> dict[str, Any]:
        path = self.config.parent / "state" / f"robot-{robot}.json"
        loaded: dict[str, Any] = json.loads(path.read_text())
        return loaded


def refused(config: Path, **extra: str) -> tuple[int, str, float]:
    """A run that is expected to end by itself: exit code, what it said, seconds of CPU."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command("run", "-c", str(config)),
        capture_output=True,
        text=True,
        env=environment(**extra),
        timeout=60,
        check=False,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return done.returncode, done.stderr + done.stdout, seconds
