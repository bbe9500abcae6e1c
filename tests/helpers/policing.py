"""The suite polices itself: what a test leaves behind, or keeps the loop waiting with, fails it.

Left behind may be: no asyncio task, no thread (but daemon threads that are not our worker), no
descriptor, no child process. An exception that only the loop's log would know fails the test too.

The loop counts as blocked when one callback of drslamd computes for more than `COMPUTING_S`, which
is CPU time of the thread and so does not grow on a loaded machine, or does not come back for
`WAITING_S` of real time, which is for blocking calls.
"""

from __future__ import annotations

import asyncio
import functools
import gc
import os
import signal
import sysconfig
import threading
import time
from asyncio import base_events, events, runners
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from places import REPOSITORY

GRACE_S = 3.0
"""What is about to end may end; a loaded machine takes a while."""
COMPUTING_S = 0.1
WAITING_S = 0.5
TASK_GRACE_S = 0.5

_INSTALLED = os.path.realpath(sysconfig.get_path("purelib"))
_PACKAGE = str(REPOSITORY / "drslamd")
_loop_faults: list[str] = []


def pytest_configure() -> None:
    """What a script starts in the background ignores interrupts, and so would our children."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def threads() -> dict[int, str]:
    """Threads that somebody has to end."""
    return {
        id(thread): f"thread {thread.name!r}"
        for thread in threading.enumerate()
        if not thread.daemon or thread.name == "worker"
    }


def descriptors() -> dict[int, str]:
    """All but those of files that came with an installed package, such as fonts."""
    found = {}
    for name in os.listdir("/proc/self/fd"):
        try:
            what = os.readlink(f"/proc/self/fd/{name}")
        except FileNotFoundError:
            continue  # the one that listed the folder
        if not what.startswith(_INSTALLED):
            found[int(name)] = f"descriptor {name} of {what}"
    return found


def children() -> dict[int, str]:
    """Child processes, those that ended and were not waited for among them."""
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return {}
    found = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, rest = path.read_text().rpartition(")")
        except OSError:
            continue  # it ended meanwhile
        if int(rest.split()[1]) == os.getpid():
            found[int(path.parent.name)] = f"child process {name})"
    return found


LEFTOVERS = (threads, descriptors, children)


@contextmanager
def nothing_left_behind() -> Iterator[None]:
    """Fail when there is more of anything afterwards."""
    before = [set(list_them().items()) for list_them in LEFTOVERS]
    yield
    until = time.monotonic() + GRACE_S
    while left := _more_than(before):
        if time.monotonic() > until:
            pytest.fail("left behind: " + "; ".join(left), pytrace=False)
        gc.collect()
        time.sleep(0.02)


def _more_than(before: list[set[tuple[int, str]]]) -> list[str]:
    return [
        text
        for list_them, old in zip(LEFTOVERS, before, strict=True)
        for number, text in sorted(list_them().items())
        if (number, text) not in old
    ]


@pytest.fixture(autouse=True, scope="module")
def _modules_clean_up() -> Iterator[None]:
    """Also what the fixtures of a module held must be gone when it ends."""
    with nothing_left_behind():
        yield


@pytest.fixture(autouse=True)
def _tests_clean_up(_watched_loops: None) -> Iterator[None]:
    _loop_faults.clear()
    with nothing_left_behind():
        yield
    faults = "; ".join(_loop_faults)
    _loop_faults.clear()
    if faults:
        pytest.fail(faults, pytrace=False)


@pytest.fixture(autouse=True, scope="session")
def _watched_loops() -> Iterator[None]:
    """Every event loop of this process is watched."""
    run_handle, close = events.Handle._run, base_events.BaseEventLoop.close
    cancel_all, complain = (
        runners._cancel_all_tasks,  # type: ignore[attr-defined]
        base_events.BaseEventLoop.default_exception_handler,
    )

    def run_and_time(handle: Any) -> None:
        callback, began, cpu = handle._callback, time.monotonic(), time.thread_time()
        run_handle(handle)
        cpu, waited = time.thread_time() - cpu, time.monotonic() - began
        if (cpu > COMPUTING_S or waited > WAITING_S) and _is_ours(callback):
            _loop_faults.append(
                f"the loop was blocked for {waited:.3f} s ({cpu:.3f} s computing) by {callback!r}"
            )

    def note_and_cancel(loop: Any) -> None:
        _note_tasks(loop)
        cancel_all(loop)

    def note_and_close(loop: Any) -> None:
        if not loop.is_closed():
            _note_tasks(loop)
        close(loop)

    def note_and_complain(loop: Any, context: dict[str, Any]) -> None:
        error = context.get("exception")
        _loop_faults.append(f"the loop was told: {context.get('message')} ({error!r})")
        complain(loop, context)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(events.Handle, "_run", run_and_time)
        patch.setattr(runners, "_cancel_all_tasks", note_and_cancel)
        patch.setattr(base_events.BaseEventLoop, "close", note_and_close)
        patch.setattr(base_events.BaseEventLoop, "default_exception_handler", note_and_complain)
        yield


def _note_tasks(loop: Any) -> None:
    """Tasks that are still there when their loop ends and do not end by themselves."""
    pending = asyncio.all_tasks(loop)
    if pending:
        _, pending = loop.run_until_complete(asyncio.wait(pending, timeout=TASK_GRACE_S))
    _loop_faults.extend(f"left behind: {task!r}" for task in pending)


def _is_ours(callback: Any) -> bool:
    """Is it code of the package, or a task that began there?"""
    while isinstance(callback, functools.partial):
        callback = callback.func
    task = getattr(callback, "__self__", None)
    if isinstance(task, asyncio.Task):
        code = getattr(task.get_coro(), "cr_code", None)
    else:
        code = getattr(callback, "__code__", None)
    return code is not None and code.co_filename.startswith(_PACKAGE)
