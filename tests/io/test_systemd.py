"""What the service manager hears, and that it cannot hold up the robot."""

from __future__ import annotations

import os
import socket
import time
from pathlib import Path

import pytest
from deploy_helpers import Manager

from drslamd.io.systemd import Notifier


@pytest.fixture
def manager(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Manager:
    manager = Manager(tmp_path)
    monkeypatch.setenv("NOTIFY_SOCKET", manager.address)
    return manager


def test_every_message_arrives_in_its_own_datagram(manager: Manager) -> None:
    notifier = Notifier()
    notifier.ready()
    notifier.alive()
    notifier.status(lambda: "not localised, 0 peers")
    notifier.stopping()
    manager.wait_for("STOPPING")
    assert [message for _, message in manager.heard] == [
        "READY=1",
        "WATCHDOG=1",
        "STATUS=not localised, 0 peers",
        "STOPPING=1",
    ]
    manager.close()


def test_a_status_stays_one_line_whatever_a_driver_says(manager: Manager) -> None:
    Notifier().status(lambda: "wheels: broken\nMAINPID=1\r\nREADY=0 \udcff")
    assert manager.wait_for("STATUS") == "STATUS=wheels: broken MAINPID=1 READY=0 ?"
    manager.close()


def test_an_abstract_address_is_understood(monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"drslamd-test-{os.getpid()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as server:
        server.bind(f"\0{name}")
        server.settimeout(5)
        monkeypatch.setenv("NOTIFY_SOCKET", f"@{name}")
        Notifier().ready()
        assert server.recv(100) == b"READY=1"


def test_without_a_manager_nothing_happens(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    Notifier().ready()
    Notifier().status(lambda: pytest.fail("nobody would hear it"))
    monkeypatch.setenv("NOTIFY_SOCKET", "/nonexistent/notify")
    Notifier().ready()


def test_a_manager_that_does_not_listen_holds_up_nobody(manager: Manager) -> None:
    notifier = Notifier()
    began = time.monotonic()
    for _ in range(5):
        notifier.status(lambda: "x" * 150_000)  # fills the socket's buffer
    assert time.monotonic() - began < 1.0
    manager.close()


@pytest.mark.parametrize(
    ("period", "owner", "expected"),
    [
        ("10000000", None, 10.0),
        ("10000000", "own", 10.0),
        ("10000000", "1", None),
        (None, None, None),
        ("soon", None, None),
    ],
)
def test_the_watchdog_is_fed_only_for_those_who_are_asked(
    monkeypatch: pytest.MonkeyPatch,
    period: str | None,
    owner: str | None,
    expected: float | None,
) -> None:
    own = str(os.getpid())
    for name, value in (
        ("WATCHDOG_USEC", period),
        ("WATCHDOG_PID", own if owner == "own" else owner),
    ):
        if value is None:
            monkeypatch.delenv(name, raising=False)
        else:
            monkeypatch.setenv(name, value)
    assert Notifier().watchdog_s == expected
