"""``drslamd status --watch``, in a terminal and elsewhere."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from made_up_answers import answer
from places import REPOSITORY
from setup_scenes import healthy
from status_answers import answering

from drslamd.cli.ask import NoAnswer
from drslamd.cli.watch import ENTER, HOME, LEAVE, watch

PATIENCE_S = 20.0


@pytest.fixture
def place() -> Iterator[Path]:
    with healthy() as setup:
        yield setup.folder / "s"


def test_without_a_daemon_it_does_not_begin(place: Path) -> None:
    with pytest.raises(NoAnswer, match="none runs with this configuration"):
        watch(place, "3.toml")


def test_elsewhere_it_prints_a_block_each_second_until_it_is_interrupted(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    slept: list[float] = []

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        if len(slept) == 3:
            raise KeyboardInterrupt

    handler = signal.getsignal(signal.SIGTERM)
    with answering(place, answer(), "status"):
        assert watch(place, "3.toml", sleep) == 0
    printed = capsys.readouterr().out
    assert slept == [1.0, 1.0, 1.0]
    assert printed.count("robot 3: localised") == 3
    assert "\x1b" not in printed
    assert signal.getsignal(signal.SIGTERM) is handler


def test_a_daemon_that_goes_away_is_waited_for(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    server = answering(place, answer(), "status")
    server.__enter__()
    steps = iter((lambda: server.__exit__(None, None, None), lambda: None))

    def sleep(_: float) -> None:
        step = next(steps, None)
        if step is None:
            raise KeyboardInterrupt
        step()

    assert watch(place, "3.toml", sleep) == 0
    printed = capsys.readouterr().out
    assert printed.count("robot 3: localised") == 1
    assert printed.count("no daemon answers at ") == 2


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_terminal_is_as_it_was_after_the_end(place: Path, number: signal.Signals) -> None:
    config = place.with_name("3.toml")
    config.write_text(config.read_text() + f'status_socket = "{place}"\n')
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "drslamd", "status", "-c", str(config), "--watch"]
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY), "COLUMNS": "72", "LINES": "20"}
    with answering(place, answer(), "status"):
        child = subprocess.Popen(command, stdout=theirs, stderr=theirs, env=environment)
        os.close(theirs)
        try:
            drawn = read_until(ours, b"connected group")
            child.send_signal(number)
            assert child.wait(PATIENCE_S) == 0
            drawn += read_until(ours, LEAVE.encode())
        finally:
            child.kill()
            child.wait()
            os.close(ours)
    text = drawn.decode()
    assert text.startswith(ENTER + HOME)
    assert text.endswith(LEAVE)
    assert max(map(len, text.split("\r\n"))) < 72 + 20  # with control sequences


def read_until(descriptor: int, wanted: bytes) -> bytes:
    data, end = b"", time.monotonic() + PATIENCE_S
    while wanted not in data:
        ready, _, _ = select.select([descriptor], [], [], max(0.0, end - time.monotonic()))
        assert ready, data
        try:
            data += os.read(descriptor, 65_536)
        except OSError:  # the other end is closed
            break
    return data
