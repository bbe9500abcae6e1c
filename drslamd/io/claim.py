"""One daemon for one configuration: whoever runs holds a lock beside its status socket.

The kernel lets go of the lock when its process ends, however it ends, so what a dead daemon left
behind is taken over. The file stays: to remove it would let two daemons lock two files.
"""

from __future__ import annotations

import fcntl
import os
import socket
import time
from contextlib import suppress
from pathlib import Path

TRIES, APART_S = 10, 0.02
"""Whoever looks whether it is held holds it for a moment."""
CONNECT_S = 1.0
MAX_PID_BYTES = 16


class Claim:
    """Of one process to one status socket; a context that says whether it is ours."""

    def __init__(self, socket_path: Path) -> None:
        self._path = lock_path(socket_path)
        self._descriptor = -1

    def __enter__(self) -> bool:
        return self.take()

    def __exit__(self, *_: object) -> None:
        self.release()

    def take(self) -> bool:
        """False when another holds it; where no file can be made there is nothing to hold."""
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError:
            return True
        for attempt in range(TRIES):
            if attempt:
                time.sleep(APART_S)
            if _locks(self._descriptor, fcntl.LOCK_EX):
                with suppress(OSError):  # a full disk: the number is only for people
                    os.ftruncate(self._descriptor, 0)
                    os.pwrite(self._descriptor, f"{os.getpid()}\n".encode(), 0)
                return True
        self.release()
        return False

    def release(self) -> None:
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def lock_path(socket_path: Path) -> Path:
    return socket_path.with_name(socket_path.name + ".lock")


def is_held(socket_path: Path) -> bool:
    """Does a daemon live that answers there, or would?"""
    return _is_answered(socket_path) or _is_locked(lock_path(socket_path))


def holder(socket_path: Path) -> str:
    """Its process, in words; empty when it is not known."""
    try:
        with lock_path(socket_path).open("rb") as file:
            number = file.read(MAX_PID_BYTES).decode("ascii", "replace").strip()
    except OSError:
        return ""
    return f"process {number}" if number.isdecimal() else ""


def _is_answered(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
        client.settimeout(CONNECT_S)
        try:
            client.connect(str(path))
        except TimeoutError:
            return True  # it has no time for anybody, but it lives
        except OSError:
            return False
    return True


def _is_locked(path: Path) -> bool:
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        return not _locks(descriptor, fcntl.LOCK_SH)
    finally:
        os.close(descriptor)


def _locks(descriptor: int, kind: int) -> bool:
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
