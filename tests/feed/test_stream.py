"""Messages of a daemon that comes and goes."""

from __future__ import annotations

import socket
import threading
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest
from near_scenes import NEAR

from drslamd.feed.stream import told, unix_us
from drslamd.gossip.message_types import UNKNOWN_CLOCK
from drslamd.gossip.seal import VERSION, Header
from drslamd.near.near_message import Near, encode

PAYLOAD = encode(Header(VERSION, 3, 7, 0, 5_000_001), NEAR)


def listening(path: Path) -> socket.socket:
    path.unlink(missing_ok=True)
    daemon = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    daemon.bind(str(path))
    daemon.listen(1)
    return daemon


def test_a_daemon_that_starts_again_is_found_again(tmp_path: Path) -> None:
    path = tmp_path / "near"
    daemon = listening(path)
    messages = told(path, sleep=lambda s: None)
    pulled: list[Near] = []

    def serve(listener: socket.socket) -> None:
        reader, _ = listener.accept()
        with reader:
            reader.send(b"nonsense")
            reader.send(PAYLOAD)

    thread = threading.Thread(target=serve, args=(daemon,))
    thread.start()
    pulled += islice(messages, 1)
    thread.join()
    daemon.close()
    again = listening(path)
    thread = threading.Thread(target=serve, args=(again,))
    thread.start()
    pulled += islice(messages, 1)
    thread.join()
    again.close()
    assert [near.utime for near in pulled] == [NEAR.utime] * 2


def test_nobody_there_at_first_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(OSError):
        next(told(tmp_path / "near"))


def test_times_become_unix_times_where_that_is_known() -> None:
    assert unix_us(NEAR, 5) == 1_700_000_000_000_005
    assert unix_us(replace(NEAR, utc_minus_clock_us=UNKNOWN_CLOCK), 5) == 5
