"""Pose and peers at the rate of the odometry, for programs on this host that steer by them.

One LCM message `near_t` for each sample of odometry, over a local socket of whole messages
(SOCK_SEQPACKET): whoever connects only reads. What a reader does not take in time is lost to it,
never kept for later, and nothing is worked out while nobody is connected.
"""

from __future__ import annotations

import asyncio
import os
import socket
from pathlib import Path

from drslamd.conventions import SECOND_US
from drslamd.gossip.seal import VERSION, Header
from drslamd.io.clock import Clock
from drslamd.io.status_socket import cannot_listen
from drslamd.io.wall_clock import read_wall_clock
from drslamd.near.near_message import NO_WALL, UNKNOWN_UNCERTAINTY, Wall, encode
from drslamd.near.surroundings import Surroundings

MOST_READERS = 16
"""At once; further ones are turned away."""
WALL_US = SECOND_US
"""Between two looks at the wall clock."""


class NearSocket:
    """Of one daemon.

    Attributes:
        lost: messages that readers did not take in time.
    """

    def __init__(self, path: Path, clock: Clock) -> None:
        self._path, self._clock = path, clock
        self._listener: socket.socket | None = None
        self._readers: set[socket.socket] = set()
        self._told: int | None = None
        self._wall: Wall = NO_WALL
        self._wall_at: int | None = None
        self.lost = 0

    def open(self) -> str:
        """Start to listen; why that failed, or an empty string."""
        listener = socket.socket(
            socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK | socket.SOCK_CLOEXEC
        )
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._path.unlink(missing_ok=True)
            listener.bind(str(self._path))
            os.chmod(self._path, 0o660)
            listener.listen(MOST_READERS)
        except OSError as error:
            listener.close()
            return cannot_listen(self._path, error.strerror or str(error))
        self._listener = listener
        asyncio.get_running_loop().add_reader(listener.fileno(), self._accept)
        return ""

    @property
    def has_readers(self) -> bool:
        """Does anybody wait for what is new?"""
        return bool(self._readers)

    def close(self) -> None:
        for reader in list(self._readers):
            self._drop(reader)
        if self._listener is not None:
            asyncio.get_running_loop().remove_reader(self._listener.fileno())
            self._listener.close()
            self._listener = None
            self._path.unlink(missing_ok=True)

    def tell(self, near: Surroundings) -> None:
        """What is new since the last time, to all who read."""
        if not self._readers or near.utime is None or near.utime == self._told:
            return
        self._told, now = near.utime, self._clock.now()
        told = near.look(now, self._wall_clock(now))
        if told is None:
            return
        payload = encode(Header(VERSION, *near.own, 0, now), told)
        for reader in list(self._readers):
            self._send(reader, payload)

    def _wall_clock(self, now: int) -> Wall:
        if self._wall_at is None or now - self._wall_at >= WALL_US:
            utc_minus_clock_us, unsure = read_wall_clock(self._clock)
            self._wall = utc_minus_clock_us, UNKNOWN_UNCERTAINTY if unsure is None else unsure
            self._wall_at = now
        return self._wall

    def _send(self, reader: socket.socket, payload: bytes) -> None:
        try:
            reader.send(payload)
        except BlockingIOError:
            self.lost += 1
        except OSError:
            self._drop(reader)

    def _accept(self) -> None:
        if self._listener is None:
            return
        try:
            reader, _ = self._listener.accept()
        except OSError:
            return  # gone again
        if len(self._readers) >= MOST_READERS:
            reader.close()
            return
        reader.setblocking(False)
        self._readers.add(reader)
        asyncio.get_running_loop().add_reader(reader.fileno(), self._heard, reader)

    def _heard(self, reader: socket.socket) -> None:
        """A reader has nothing to say: it went away, or it will be sent away."""
        self._drop(reader)

    def _drop(self, reader: socket.socket) -> None:
        asyncio.get_running_loop().remove_reader(reader.fileno())
        self._readers.discard(reader)
        reader.close()


def connected(path: Path) -> socket.socket:
    """A blocking socket on which `recv` gives one message after the other, empty at the end.

    Raises:
        OSError: nobody listens there.
    """
    reader = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_CLOEXEC)
    try:
        reader.connect(str(path))
    except OSError:
        reader.close()
        raise
    return reader
