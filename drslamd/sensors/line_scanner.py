"""Cuts a stream of bytes into lines.

A line ends with CR or LF, whichever comes; empty lines do not count. The bytes are consumed before
anybody decodes them, so a poisoned byte can spoil the line that it is in and no other.
"""

from __future__ import annotations

import re
from typing import Final

MAX_LINE_BYTES: Final = 128
"""Four times the longest line that any driver reads; a longer one is noise without line ends."""

_END: Final = re.compile(rb"[\r\n]")


class LineScanner:
    """Collects lines.

    Attributes:
        overlong: lines of more than `MAX_LINE_BYTES`, dropped whole.
    """

    def __init__(self) -> None:
        self._rest = b""
        self._dropping = False
        self.overlong = 0

    def feed(self, data: bytes) -> list[bytes]:
        """Lines that `data` completes, without their ends, never empty."""
        *ended, rest = _END.split(data)
        lines = [line for part in ended if (line := self._end_line(part))]
        self._grow(rest)
        return lines

    def _end_line(self, part: bytes) -> bytes:
        self._grow(part)
        line, self._rest, self._dropping = self._rest, b"", False
        return line

    def _grow(self, part: bytes) -> None:
        if self._dropping:
            return
        self._rest += part
        if len(self._rest) > MAX_LINE_BYTES:
            self._rest, self._dropping = b"", True
            self.overlong += 1
