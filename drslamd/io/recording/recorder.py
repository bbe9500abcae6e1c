"""Writes what a robot hears and does into files, off the loop.

The loop only appends bytes to a queue; a thread writes them once a second. A queue that is full, a
disk that is full or a folder that is read-only cost the recording and never the daemon.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from drslamd.conventions import SECOND_US
from drslamd.events import Effect, Event
from drslamd.io.recording.log_files import LogFiles
from drslamd.recording.encoder import Encoder
from drslamd.recording.records import Beginning, Opening, Told

FLUSH_S = 1.0
"""What a power cut or a kill costs at most, beside what the kernel had not written yet."""
MAX_QUEUED = 4 << 20
"""Bytes that wait for the disk: minutes of a busy robot. A card that hangs longer costs a gap."""
CLOCK_EVERY_US = 60 * SECOND_US
"""Between two looks at the wall clock, which somebody may have set."""
PATIENCE_S = 2.0
"""How long an orderly end waits for the disk."""


_NOTHING = Beginning(0)


class NoRecorder:
    """Where nothing is to be recorded."""

    def begin(self, utime: int, beginning: Beginning) -> None:
        """As of `Recorder`, like all that follows."""

    def event(self, event: Event) -> None: ...

    def effects(self, utime: int, effects: list[Effect]) -> None: ...

    def status(self) -> dict[str, Any] | None:
        return None

    def problems(self) -> list[str]:
        return []

    def start(self) -> None: ...

    async def close(self) -> None: ...


class Recorder:
    """Of one daemon."""

    def __init__(
        self,
        files: LogFiles,
        encoder: Encoder,
        provenance: Mapping[str, Any],
        clocks: Callable[[], dict[str, int]],
    ) -> None:
        """
        Args:
            clocks: the robot's clock, and the wall clock beside it.
        """
        self._files, self._encoder = files, encoder
        self._provenance, self._clocks = provenance, clocks
        self._queue: deque[bytes | None] = deque()
        """None: a new file begins."""
        self._queued = self._written = 0
        self._in_file, self._part = 0, 0
        self._clock_at = 0
        self._beginning = _NOTHING
        self._lost = 0
        self.dropped = 0
        self._wake = threading.Event()
        self._is_over = False
        self._thread: threading.Thread | None = None

    def begin(self, utime: int, beginning: Beginning) -> None:
        """A robot begins: the first, or one in the place of another."""
        is_first, self._beginning = self._beginning is _NOTHING, beginning
        if is_first:
            self._files.begin(beginning.epoch)
            self._open(utime)
        else:
            self._put(self._encoder.beginning(utime, beginning))

    def event(self, event: Event) -> None:
        """One event, before the robot answers it."""
        if self._files.fault:
            return
        if self._lost:
            self._close_gap(event.utime)
        if not self._has_room():
            self._lost += 1
            self.dropped += 1
            return
        if self._in_file >= self._files.file_bytes:
            self._part += 1
            self._open(event.utime)
        if event.utime >= self._clock_at:
            self._clock_at = event.utime + CLOCK_EVERY_US
            self._put(self._encoder.told(Told(event.utime, "clock", self._clocks())))
        self._put(self._encoder.event(event))

    def effects(self, utime: int, effects: list[Effect]) -> None:
        """What the robot did about the event before."""
        if effects and not self._files.fault:
            data = self._encoder.effects(utime, effects)
            if not self._lost:
                self._put(data)

    def status(self) -> dict[str, Any] | None:
        """What is recorded where, or why not."""
        return {
            "folder": str(self._files.folder),
            "file": self._files.name,
            "bytes": self._written,
            "events_lost": self.dropped,
            "fault": self._files.fault,
        }

    def problems(self) -> list[str]:
        """Sentences, where the recording is not whole."""
        said = [f"nothing is recorded: {self._files.fault}"] if self._files.fault else []
        lost = f"the recording lacks {self.dropped} events: the disk was too slow for them"
        return said + ([lost] if self.dropped else [])

    def start(self) -> None:
        """Begin to write."""
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()

    async def close(self) -> None:
        """Write what is left."""
        self._is_over = True
        self._wake.set()
        if self._thread is not None:
            await asyncio.to_thread(self._thread.join, PATIENCE_S)

    # in the loop

    def _open(self, utime: int) -> None:
        self._in_file = 0
        self._queue.append(None)
        provenance = {**self._provenance, "clocks": self._clocks()}
        opening = Opening(utime, self._beginning, self._part, provenance)
        self._put(self._encoder.opening(opening))

    def _has_room(self) -> bool:
        return self._queued - self._written < MAX_QUEUED

    def _close_gap(self, utime: int) -> None:
        if self._has_room():
            self._put(self._encoder.gap(utime, self._lost))
            self._lost = 0

    def _put(self, data: bytes) -> None:
        self._queue.append(data)
        self._queued += len(data)
        self._in_file += len(data)

    # in the thread

    def _work(self) -> None:
        while not self._files.fault:
            is_over = self._is_over
            self._flush()
            if is_over:
                break
            self._wake.wait(FLUSH_S)
        self._files.close()

    def _flush(self) -> None:
        """Everything that waits, one write for each file."""
        waiting: list[bytes] = []
        for _ in range(len(self._queue)):
            data = self._queue.popleft()
            if data is None:
                self._write(waiting)
                waiting = []
                self._files.next()
            else:
                waiting.append(data)
        self._write(waiting)

    def _write(self, waiting: list[bytes]) -> None:
        data = b"".join(waiting)
        if data:
            self._files.write(data)
            self._written += 0 if self._files.fault else len(data)
