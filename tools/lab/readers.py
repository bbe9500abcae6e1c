"""Readers of recordings by the ending of the file (tools/README.md says how to add one)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from lab import pyfg
from lab.recording import BadRecording, Recording

READERS: dict[str, Callable[[Path], Recording]] = {".pyfg": pyfg.read}


def read(path: Path) -> Recording:
    """Read a recording.

    Raises:
        BadRecording: no reader for this ending, no such file, or a file that cannot be used.
    """
    reader = READERS.get(path.suffix)
    if reader is None:
        raise BadRecording(f"{path}: readers exist for {', '.join(READERS)}")
    try:
        return reader(path)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise BadRecording(f"{path}: {reason}") from None
