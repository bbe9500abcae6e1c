"""Finds frames in a stream of bytes that may start anywhere and hold anything.

Law of this file:
1. What is cut out depends on the bytes and on silences, never on how the bytes were cut into reads.
2. After a header that led nowhere the search goes on ONE byte later, so that a good frame behind a
   false header is found; an intact frame is jumped over whole, so that what it carries is not
   taken for a frame.
3. A false header may announce more than ever comes. Once the line has been silent for `STALL_US`,
   an intact frame further on is believed and everything before it dropped. An unfinished frame
   with nothing intact behind it is kept: its rest may only be late.
4. Every byte ends in exactly one place: a frame, `garbage_bytes` or the bounded rest.

Whatever is wrong with the bytes is counted; nothing here raises for them.
"""

from __future__ import annotations

import re
from typing import Final, Protocol

MAX_BUFFER_BYTES: Final = 4096
"""Longest frame that any format may announce, and the most that a scanner ever holds. At 1450
bytes a second (LinkTrack, one peer, 50 Hz) a false header of this length hides 2.8 s."""

STALL_US: Final = 90_000
"""A sender puts a frame out in one burst of a few milliseconds, and ports are read every 50."""

NOT_A_FRAME: Final = -1
NEED_MORE: Final = 0


class FrameFormat(Protocol):
    """What a scanner has to know about one kind of stream."""

    @property
    def head(self) -> re.Pattern[bytes]:
        """Matches one byte with which a frame may start."""

    def length_at(self, buffer: bytes, at: int) -> int:
        """Length of the frame that starts at `at`, at most `MAX_BUFFER_BYTES`.

        `NOT_A_FRAME` and a length are final: more bytes must not change the answer. `NEED_MORE`
        asks for more bytes.
        """

    def is_intact(self, frame: bytes) -> bool:
        """Is the checksum of this frame of the announced length right?"""


class FrameScanner:
    """Cuts intact frames out of a stream.

    Attributes:
        garbage_bytes: bytes that belong to no intact frame.
        bad_checksums: candidates of full length whose checksum was wrong.
    """

    def __init__(self, frame_format: FrameFormat) -> None:
        self._format, self._start = frame_format, frame_format.head.search
        self._rest = b""
        self._last_byte_utime = 0
        self.garbage_bytes = 0
        self.bad_checksums = 0

    @property
    def pending_bytes(self) -> int:
        """Bytes held back because a frame may start with them; below `MAX_BUFFER_BYTES`."""
        return len(self._rest)

    def feed(self, data: bytes, utime: int) -> list[bytes]:
        """Intact frames that are complete now that `data` has arrived at `utime` (microseconds)."""
        frames: list[bytes] = []
        if self._rest and utime - self._last_byte_utime >= STALL_US:
            self._rest = self._take(self._rest, frames, patient=False)
        if data:
            self._last_byte_utime = utime
        start = 0
        while start < len(data):
            end = start + MAX_BUFFER_BYTES - len(self._rest)
            self._rest = self._take(self._rest + data[start:end], frames, patient=True)
            start = end
        return frames

    def _take(self, buffer: bytes, frames: list[bytes], patient: bool) -> bytes:
        """Moves the intact frames of `buffer` to `frames` and returns what has to wait.

        A patient search stops at the first unfinished candidate; another one that finds nothing
        more leaves all that is behind the last frame.
        """
        start, length_at, is_intact = self._start, self._format.length_at, self._format.is_intact
        at = taken = bad_checksums = 0
        while (head := start(buffer, at)) is not None:
            at = head.start()
            length = length_at(buffer, at)
            unfinished = length == NEED_MORE or at + length > len(buffer)
            if unfinished and patient:
                break
            if not unfinished and length != NOT_A_FRAME:
                frame = buffer[at : at + length]
                if is_intact(frame):
                    frames.append(frame)
                    self._count(at - taken, bad_checksums)
                    at = taken = at + length
                    bad_checksums = 0
                    continue
                bad_checksums += 1
            at += 1
        else:
            at = len(buffer)
        if not patient:
            return buffer[taken:]
        self._count(at - taken, bad_checksums)
        return buffer[at:]

    def _count(self, garbage_bytes: int, bad_checksums: int) -> None:
        self.garbage_bytes += garbage_bytes
        self.bad_checksums += bad_checksums
