"""A log of what is said in a group: what the lcm package reads, and nothing of what is none."""

from __future__ import annotations

import errno
import os
import socket
import time
from pathlib import Path
from typing import Any

import lcm
import pytest
from transport_helpers import GROUP, section

from drslamd.gossip import lc02
from drslamd.io.recording.group_log import GroupLog

SECTION = section()


def say(*datagrams: bytes) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as talker:
        here = socket.inet_aton("127.0.0.1")
        talker.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, here)
        talker.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        for datagram in datagrams:
            talker.sendto(datagram, (GROUP, SECTION.port))


def heard(path: Path, *datagrams: bytes) -> GroupLog:
    listener = GroupLog(SECTION, path)
    end = time.monotonic() + 10
    try:
        say(*datagrams)
        listener.run(
            lambda: (
                sum(listener.channels.values()) + listener.refused == len(datagrams)
                or time.monotonic() > end
            )
        )
    finally:
        listener.close()
    return listener


def test_messages_are_written_as_the_lcm_package_reads_them(tmp_path: Path) -> None:
    before = time.time_ns() // 1_000
    said = [("DRSLAM_POSE_001", b"one"), ("OTHER", b""), ("DRSLAM_POSE_001", b"two")]
    listener = heard(tmp_path / "log", *(lc02.encode(7, *message) for message in said))
    log = lcm.EventLog(str(tmp_path / "log"), "r")
    found = list(log)
    log.close()
    assert [(event.channel, event.data) for event in found] == said
    assert [event.eventnum for event in found] == [0, 1, 2]
    assert all(0 <= event.timestamp - before < 60_000_000 for event in found)
    assert listener.channels == {"DRSLAM_POSE_001": 2, "OTHER": 1}
    assert listener.bytes == (tmp_path / "log").stat().st_size


def test_what_is_no_message_is_counted_and_left_out(tmp_path: Path) -> None:
    listener = heard(tmp_path / "log", b"noise", lc02.encode(1, "A", b"x"))
    assert (listener.refused, listener.channels) == (1, {"A": 1})


def test_names_without_end_are_counted_together(tmp_path: Path) -> None:
    listener = GroupLog(SECTION, tmp_path / "log")
    try:
        for k in range(1_002):
            listener._entry(lc02.encode(1, f"C{k}", b""))
    finally:
        listener.close()
    assert len(listener.channels) == 1_001
    assert listener.channels["others"] == 2


def test_a_file_that_is_there_is_not_written_over(tmp_path: Path) -> None:
    (tmp_path / "log").write_text("mine")
    with pytest.raises(FileExistsError):
        GroupLog(SECTION, tmp_path / "log")
    assert (tmp_path / "log").read_text() == "mine"


def test_a_disk_that_is_full_ends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    listener = GroupLog(SECTION, tmp_path / "log")
    try:
        monkeypatch.setattr(os, "write", full)
        say(lc02.encode(1, "A", b"x"))
        with pytest.raises(OSError, match="No space left"):
            listener.run(lambda: False)
    finally:
        listener.close()
