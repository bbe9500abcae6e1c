"""A port that is missing, taken or forbidden: named in one sentence, and opened once it can be."""

from __future__ import annotations

import fcntl
import json
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from deploy_helpers import ORDINARY, UWB, WHEELS, Daemon, example_in

pytestmark = pytest.mark.slow

LONGEST_BACKOFF_S = 5.0


@contextmanager
def serial_line() -> Iterator[str]:
    """A terminal of the kind that a serial port is; its other end stays open."""
    ours, theirs = os.openpty()
    try:
        yield os.ttyname(theirs)
    finally:
        os.close(ours)
        os.close(theirs)


def running(folder: Path, uwb: Path | str) -> Daemon:
    daemon = Daemon(example_in(folder, (UWB, str(uwb)), (WHEELS, str(folder / "no-wheels"))))
    daemon.manager.wait_for("READY=1")
    return daemon


def uwb_port(daemon: Daemon) -> dict[str, Any]:
    answer: dict[str, Any] = json.loads(daemon.ask("--json"))["uwb"]
    return answer


def wait_until_open(daemon: Daemon) -> None:
    end = time.monotonic() + LONGEST_BACKOFF_S + 2
    while uwb_port(daemon)["port"] != "open":
        assert time.monotonic() < end, daemon.log
        time.sleep(0.2)


def test_a_port_that_another_program_holds(tmp_path: Path) -> None:
    with serial_line() as path:
        holder = os.open(path, os.O_RDWR | os.O_NOCTTY)
        fcntl.flock(holder, fcntl.LOCK_EX)
        with running(tmp_path, path) as daemon:
            assert f"in use by another program: {path}" in daemon.ask()
            os.close(holder)
            wait_until_open(daemon)
            assert path not in "".join(json.loads(daemon.ask("--json"))["problems"])


@pytest.mark.skipif(not ORDINARY, reason="root may open anything")
def test_a_port_that_may_not_be_opened(tmp_path: Path) -> None:
    with serial_line() as path:
        os.chmod(path, 0)
        with running(tmp_path, path) as daemon:
            assert f"no permission: {path}: Permission denied" in daemon.ask()
            os.chmod(path, 0o600)
            wait_until_open(daemon)


@pytest.mark.row("D8")
def test_a_port_that_appears_later(tmp_path: Path) -> None:
    """As a name below /dev/serial/by-id does when the module is plugged in."""
    name = tmp_path / "usb-LINKTRACK"
    with serial_line() as path, running(tmp_path, name) as daemon:
        assert f"missing: {name}: No such file or directory" in daemon.ask()
        name.symlink_to(path)
        wait_until_open(daemon)


def test_a_port_that_is_no_serial_line(tmp_path: Path) -> None:
    name = tmp_path / "file"
    name.touch()
    with running(tmp_path, name) as daemon:
        assert uwb_port(daemon)["port"] == "unfit"
        assert f"unfit: {name}: not a serial port" in daemon.ask()


def test_a_robot_does_not_open_its_own_module_twice(tmp_path: Path) -> None:
    """Two daemons of one robot, as after a start by hand: the second one says who is in the way."""
    second = tmp_path / "second"
    second.mkdir()
    with serial_line() as path, running(tmp_path, path) as first:
        wait_until_open(first)
        with running(second, path) as daemon:
            assert f"in use by another program: {path}" in daemon.ask()
            assert uwb_port(first)["port"] == "open"
