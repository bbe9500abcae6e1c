"""What systemd wants to hear: ready, alive, status, stopping (sd_notify(3))."""

from __future__ import annotations

import os
import socket


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
        if not period.isdigit() or owner != str(os.getpid()):
            return None
        return int(period) / 1e6

    def ready(self) -> None:
        self._send("READY=1")

    def alive(self) -> None:
        self._send("WATCHDOG=1")

    def status(self, text: str) -> None:
        self._send(f"STATUS={text}")

    def stopping(self) -> None:
        self._send("STOPPING=1")

    def _send(self, message: str) -> None:
        if not self._address:
            return
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as notify:
            try:
                notify.connect(self._address)
                notify.sendall(message.encode())
            except OSError:
                # a manager that went away must not take the robot with it
                return
