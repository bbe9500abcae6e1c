"""The police at work: each kind of bad test is caught, and its good twin is not."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import policing
import pytest

IMPORTS = """
import os, socket, subprocess, threading, time
HELD = os.path.abspath("held")

def hold():
    while os.path.exists(HELD):
        time.sleep(0.02)
"""
BAD = {
    "threading.Thread(target=hold).start()": "left behind: thread",
    "threading.Thread(None, hold, 'worker', daemon=True).start()": "left behind: thread 'worker'",
    "socket.socket().detach()": "of socket:",
    "os.open('/proc/self/stat', os.O_RDONLY)": "/stat",
    "os.spawnlp(os.P_NOWAIT, 'sleep', 'sleep', '60')": "left behind: child process",
    "os.spawnlp(os.P_NOWAIT, 'true', 'true')": "left behind: child process",
}
"""What is done, and what is said to it."""
GOOD = [
    "threading.Thread(target=time.sleep, args=(0.05,)).start()",
    "threading.Thread(target=time.sleep, args=(0.5,), daemon=True).start()",
    "socket.socket().close()",
    "subprocess.run(['true'], check=True)",
]

LOOPS = """
import asyncio, tempfile, time
from pathlib import Path
from drslamd.io.status_socket import StatusSocket, ask

async def answered(answer):
    with tempfile.TemporaryDirectory() as folder:
        server = StatusSocket(Path(folder) / "s", {"status": answer})
        await server.open()
        await ask(Path(folder) / "s", "status")
        await server.close()

async def with_task(seconds):
    with_task.kept = asyncio.ensure_future(asyncio.sleep(seconds))

async def with_failure():
    asyncio.get_running_loop().call_soon(lambda: 1 / 0)
    await asyncio.sleep(0.01)

def compute(seconds):
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass
    return {}

def block(seconds):
    time.sleep(seconds)
    return {}
"""

BAD_LOOPS = {
    "with_task(60)": "left behind: <Task pending",
    "with_failure()": "ZeroDivisionError",
    "answered(lambda: compute(0.2))": "computing) by",
    "answered(lambda: block(0.7))": "the loop was blocked for 0.7",
}
GOOD_LOOPS = [
    "with_task(0.05)",
    "answered(lambda: compute(0.03))",
    "answered(lambda: block(0.2))",
]


@pytest.fixture
def court(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.Pytester]:
    """Short patience inside; what the accused left behind is cleared away afterwards."""
    monkeypatch.setattr(policing, "GRACE_S", 0.15)
    monkeypatch.setattr(policing, "TASK_GRACE_S", 0.15)
    open_before, children_before = set(policing.descriptors()), set(policing.children())
    (pytester.path / "held").touch()
    yield pytester
    (pytester.path / "held").unlink()
    for pid in set(policing.children()) - children_before:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
    for number in set(policing.descriptors()) - open_before:
        os.close(number)


def verdicts(court: pytest.Pytester, source: str) -> dict[str, str]:
    """What is said of each test of a file: all that went wrong with it, or nothing."""
    court.makepyfile(source)
    result = court.inline_run("-p", "policing", "-p", "no:cacheprovider")
    said: dict[str, str] = {}
    for report in result.getreports("pytest_runtest_logreport"):
        name = report.nodeid.partition("::")[2]
        said[name] = said.get(name, "") + (report.longreprtext if report.failed else "")
    return said


def as_test(number: int, deed: str) -> str:
    return f"\ndef test_{number}():\n    {deed}\n"


@pytest.mark.slow
def test_a_test_that_leaves_something_behind_fails(court: pytest.Pytester) -> None:
    tests = [as_test(k, deed) for k, deed in enumerate(BAD)]
    said = verdicts(court, IMPORTS + "".join(tests))
    for k, (deed, sentence) in enumerate(BAD.items()):
        assert sentence in said[f"test_{k}"], deed


def test_a_test_that_cleans_up_passes(court: pytest.Pytester) -> None:
    tests = [as_test(k, deed) for k, deed in enumerate(GOOD)]
    said = verdicts(court, IMPORTS + "".join(tests))
    assert [said[f"test_{k}"] for k in range(len(GOOD))] == [""] * len(GOOD)


def test_a_fixture_of_a_module_that_leaves_something_behind_fails(court: pytest.Pytester) -> None:
    source = """
    import os, pytest
    @pytest.fixture(scope="module")
    def pipe():
        return os.pipe()
    def test_bad(pipe):
        assert pipe
    """
    assert "left behind: descriptor" in verdicts(court, source)["test_bad"]


def test_a_loop_that_is_blocked_or_not_emptied_fails(court: pytest.Pytester) -> None:
    tests = [as_test(k, f"asyncio.run({deed})") for k, deed in enumerate(BAD_LOOPS)]
    said = verdicts(court, LOOPS + "".join(tests))
    for k, (deed, sentence) in enumerate(BAD_LOOPS.items()):
        assert sentence in said[f"test_{k}"], deed


def test_a_loop_that_turns_passes(court: pytest.Pytester) -> None:
    tests = [as_test(k, f"asyncio.run({deed})") for k, deed in enumerate(GOOD_LOOPS)]
    said = verdicts(court, LOOPS + "".join(tests))
    assert [said[f"test_{k}"] for k in range(len(GOOD_LOOPS))] == [""] * len(GOOD_LOOPS)
