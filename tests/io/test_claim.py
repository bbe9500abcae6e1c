"""One daemon for one configuration, and what a dead one leaves behind."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

from drslamd.io.claim import Claim, holder, is_held, lock_path

HOLD = """
import os, sys, time
from pathlib import Path
from drslamd.io.claim import Claim
print(Claim(Path(sys.argv[1])).take(), flush=True)
time.sleep(60)
"""


def test_only_one_holds_it_and_the_next_gets_it_afterwards(tmp_path: Path) -> None:
    path = tmp_path / "s"
    assert not is_held(path)
    with Claim(path) as first:
        assert first
        assert is_held(path)
        assert holder(path) == f"process {os.getpid()}"
        with Claim(path) as second:
            assert not second
    assert not is_held(path)
    with Claim(path) as third:
        assert third


def test_what_was_killed_holds_nothing(tmp_path: Path) -> None:
    path = tmp_path / "s"
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "True\n"
        assert is_held(path)
        assert holder(path) == f"process {other.pid}"
        other.kill()
        other.wait()
    assert not is_held(path)
    with Claim(path) as ours:
        assert ours


def test_whoever_looks_at_the_same_moment_does_not_keep_a_daemon_from_it(tmp_path: Path) -> None:
    path = tmp_path / "s"
    for _ in range(20):
        is_held(path)
        with Claim(path) as ours:
            assert ours


def test_a_socket_that_somebody_listens_at_is_held_without_a_lock(tmp_path: Path) -> None:
    path = tmp_path / "s"
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))
        assert not is_held(path)  # left over: nobody listens
        server.listen()
        assert is_held(path)
    assert not is_held(path)


def test_where_no_file_can_be_made_there_is_nothing_to_hold(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "s"
    with Claim(path) as ours:
        assert ours
        assert not is_held(path)
    assert holder(path) == ""


def test_a_number_that_is_none_is_not_shown(tmp_path: Path) -> None:
    lock_path(tmp_path / "s").write_bytes(b"\xff\xfe; rm -r")
    assert holder(tmp_path / "s") == ""
