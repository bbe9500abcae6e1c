"""What robots say on a network, into one LCM log: for a laptop that is no robot.

Times are the wall clock's, in microseconds since 1970, as of lcm-logger.
"""

from __future__ import annotations

import os
import select
import socket
import time
from collections.abc import Callable
from pathlib import Path

from drslamd.config import GossipSection
from drslamd.gossip import lc02
from drslamd.io.multicast import open_group
from drslamd.recording.event_log import packed

PATIENCE_S = 0.2
"""How long a stop waits at most."""
DATAGRAMS_AT_ONCE = 64
"""Read in one go; then they are written."""


class GroupLog:
    """Of one group.

    Attributes:
        channels: messages by channel; the first 1000 names that turn up, others count as "others".
        refused: datagrams that are no LCM messages of one piece.
        bytes: written.
    """

    def __init__(self, section: GossipSection, path: Path) -> None:
        """
        Raises:
            OSError: the group cannot be joined, or the file is there or cannot be made.
        """
        self._socket = open_group(section)
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        except OSError:
            self._socket.close()
            raise
        self.channels: dict[str, int] = {}
        self.refused = self.bytes = self._number = 0

    def run(self, is_over: Callable[[], bool]) -> None:
        """Write what comes until `is_over`.

        Raises:
            OSError: the disk takes no more, or the network is gone.
        """
        while not is_over():
            if select.select([self._socket], [], [], PATIENCE_S)[0]:
                data = b"".join(self._entry(d) for d in _waiting(self._socket))
                self.bytes += len(data)
                rest = memoryview(data)
                while rest:
                    rest = rest[os.write(self._file, rest) :]

    def close(self) -> None:
        """Let go of file and network."""
        os.close(self._file)
        self._socket.close()

    def _entry(self, datagram: bytes) -> bytes:
        framed = lc02.decode(datagram)
        if isinstance(framed, lc02.FramingFault):
            self.refused += 1
            return b""
        channel, payload = framed
        name = channel if channel in self.channels or len(self.channels) < 1_000 else "others"
        self.channels[name] = self.channels.get(name, 0) + 1
        self._number += 1
        return packed(self._number - 1, time.time_ns() // 1_000, channel.encode(), payload)


def _waiting(group: socket.socket) -> list[bytes]:
    out: list[bytes] = []
    while len(out) < DATAGRAMS_AT_ONCE:
        try:
            out.append(group.recv(65_536))
        except BlockingIOError:
            break
    return out
