"""What systemd wants to hear: ready, alive, status, stopping (sd_notify(3))."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Callable

PATIENCE_S = 0.1
"""A manager that is busy, as when the host boots, holds up the robot no longer."""


class Notifier:
    """Talks to the service manager; does nothing when there is none."""

    def __init__(self) -> None:
        self._address = os.environ.get("NOTIFY_SOCKET", "")
        if self._address.startswith("@"):
            self._address = "\0" + self._address[1:]

    @property
    def watchdog_s(self) -> float | None:
        """How often a sign of life is due, None when nobody waits for one."""
        period = os.environ.get("WATCHDOG_USEC", "")
        owner = os.environ.get("WATCHDOG_PID", str(os.getpid()))
        if not period.isdecimal() or owner != str(os.getpid()):
            return None
        return int(period) / 1e6

    def ready(self) -> None:
        self._send("READY=1")

    def alive(self) -> None:
        self._send("WATCHDOG=1")

    def status(self, text: Callable[[], str]) -> None:
        """One line, worked out only where somebody hears it; a line break would end it and begin
        another message."""
        if self._address:
            self._send("STATUS=" + " ".join(text().splitlines()))

    def stopping(self) -> None:
        self._send("STOPPING=1")

    def _send(self, message: str) -> None:
        if not self._address:
            return
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as notify:
            notify.settimeout(PATIENCE_S)
            # a manager that is gone must not take the robot with it
            with contextlib.suppress(OSError):
                notify.sendto(message.encode(errors="replace"), self._address)
