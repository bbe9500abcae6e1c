"""A daemon that tells the same of robot 3 again and again, and a feed of it as a process."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from itertools import count
from pathlib import Path

from near_scenes import NEAR
from places import REPOSITORY
from status_answers import WITHOUT_DEVICES

from drslamd.gossip.seal import VERSION, Header
from drslamd.near.near_message import encode

START_S, EVERY_S, ENOUGH = 30.0, 0.02, 20


@contextlib.contextmanager
def feeding(folder: Path, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """`drslamd feed` with these arguments, once it was told enough to have told some of it; it is
    ended by SIGTERM if it did not end before."""
    config, told, ended = folder / "3.toml", threading.Event(), threading.Event()
    config.write_text(WITHOUT_DEVICES.format(robot=3, socket=folder / "3.sock"))
    daemon = _daemon(folder / "3.near", told, ended)
    kind, *more = arguments
    command = (sys.executable, "-m", "drslamd", "feed", kind, "-c", str(config), *more)
    with subprocess.Popen(command, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True) as feed:
        try:
            assert told.wait(START_S), "the feed does not connect"
            yield feed
        finally:
            feed.terminate()
            feed.wait()
            ended.set()
            daemon.join()


def _daemon(path: Path, told: threading.Event, ended: threading.Event) -> threading.Thread:
    daemon = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    daemon.bind(str(path))
    daemon.listen(1)
    daemon.settimeout(START_S)

    def serve() -> None:
        with daemon, daemon.accept()[0] as reader, contextlib.suppress(ConnectionError):
            for k in count():
                reader.send(encode(Header(VERSION, 3, 7, 0, 5_000_001), NEAR))
                if k == ENOUGH:
                    told.set()
                if ended.wait(EVERY_S):
                    return

    thread = threading.Thread(target=serve)
    thread.start()
    return thread
