"""One thread for what takes long, so that the loop is free to read sensors.

The thread is a daemon: at the end of the process nobody waits for a computation whose answer
nobody will use.
"""

from __future__ import annotations

import asyncio
import gc
import queue
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Finished:
    """What a computation gave, or the exception that it ended with, and how long it took."""

    result: Any
    error: BaseException | None
    seconds: float


SWITCH_S = 0.0005
"""How long the thread computes on while the loop waits for the interpreter. Python's own 5 ms, for
each of several waits of one event, would make a pose too old to steer by."""
WHOLE_LOOK_S = 3600.0
"""Between two looks for garbage through all that there is."""


class GarbageLooks:
    """What a look for garbage found in use twice is not looked through again for an hour.

    With fifty robots that takes 30 to 90 ms, every few seconds, and meanwhile nobody reads sensors;
    what is garbage is nearly always known by counting references.
    """

    def __init__(self) -> None:
        self._whole_at = time.monotonic()

    def begin(self) -> None:
        """What is there by now stays."""
        gc.freeze()
        gc.callbacks.append(self._on_look)

    def end(self) -> None:
        gc.callbacks.remove(self._on_look)
        gc.unfreeze()

    def _on_look(self, phase: str, info: dict[str, int]) -> None:
        if phase == "start" or not info["generation"]:
            return
        if info["generation"] == 2:
            self._whole_at = time.monotonic()
        if time.monotonic() < self._whole_at + WHOLE_LOOK_S:
            gc.freeze()
        else:
            # until the look through the oldest comes by itself
            gc.unfreeze()


class Worker:
    """Runs one computation after the other and reports each to the loop.

    Attributes:
        waiting: computations that have not ended.
    """

    def __init__(self, marks: Callable[[], int] = lambda: 0) -> None:
        """
        Args:
            marks: a number that is another one after each step of a computation.
        """
        self._marks = marks
        self.waiting = 0
        self._moved_at = 0.0
        self._seen = 0
        self._queue: queue.SimpleQueue[tuple[Callable[[], Any], Callable[[Finished], None]] | None]
        self._queue = queue.SimpleQueue()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._looks = GarbageLooks()

    def start(self) -> None:
        """Begin to work for the running loop."""
        self._loop = asyncio.get_running_loop()
        sys.setswitchinterval(SWITCH_S)
        self._looks.begin()
        threading.Thread(target=self._work, name="worker", daemon=True).start()

    def submit(self, run: Callable[[], Any], done: Callable[[Finished], None]) -> None:
        """Compute `run()` in the thread, then call `done` in the loop."""
        if not self.waiting:
            self._moved_at = time.monotonic()
        self.waiting += 1

        def ended(finished: Finished) -> None:
            self.waiting -= 1
            self._moved_at = time.monotonic()
            done(finished)

        self._queue.put((run, ended))

    def stuck_s(self) -> float:
        """How long it has had work and made no headway, s: nothing ended, and no step of a solver.

        Ask once in a while: a step counts from when it is seen.
        """
        now, made = time.monotonic(), self._marks()
        if made != self._seen:
            self._seen, self._moved_at = made, now
        return now - self._moved_at if self.waiting else 0.0

    def stop(self) -> None:
        """The thread ends after what it has been given; nobody waits for that."""
        self._queue.put(None)
        self._looks.end()

    def _work(self) -> None:
        assert self._loop is not None
        while task := self._queue.get():
            run, done = task
            began = time.perf_counter()
            result, error = None, None
            try:
                result = run()
            except BaseException as raised:
                # not swallowed: it ends the daemon from the loop, where its end is in order
                error = raised
            finished = Finished(result, error, time.perf_counter() - began)
            try:
                self._loop.call_soon_threadsafe(done, finished)
            except RuntimeError:
                # the loop has closed; nobody waits any more
                return
