"""What a daemon tells, one message after the other, and its times as UNIX time."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from drslamd.gossip.message_types import UNKNOWN_CLOCK
from drslamd.io.near_socket import connected
from drslamd.near import near_message
from drslamd.near.near_message import Near

AGAIN_S = 1.0
"""Between two tries to reach a daemon that is gone."""
LARGEST = 1 << 17


def told(path: Path, sleep: Callable[[float], object] = time.sleep) -> Iterator[Near]:
    """Everything that is told at a socket; a daemon that starts again is found again.

    Raises:
        OSError: nobody listens there at first.
    """
    reader = connected(path)
    while True:
        with reader:
            while payload := _received(reader):
                near = near_message.decode(payload)
                if isinstance(near, Near):
                    yield near
        reader = _again(path, sleep)


def _received(reader: socket.socket) -> bytes:
    try:
        return bytes(reader.recv(LARGEST))
    except OSError:
        return b""


def _again(path: Path, sleep: Callable[[float], object]) -> socket.socket:
    while True:
        sleep(AGAIN_S)
        try:
            return connected(path)
        except OSError:
            continue  # it may be about to start


def unix_us(near: Near, utime: int) -> int:
    """A time of the daemon's clock, us since 1970; as it is where nobody knows better."""
    known = near.utc_minus_clock_us
    return utime if known == UNKNOWN_CLOCK else utime + known
