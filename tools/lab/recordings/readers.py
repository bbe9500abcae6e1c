"""Readers of recordings by what the file is (tools/README.md says how to add one)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from lab.recordings import murp, pyfg, range_only_cl, swust, vub
from lab.recordings.recording import BadRecording, EdgeRecording, Recording


def _csv(path: Path) -> Recording:
    """Two layouts share this ending; their headers differ."""
    with path.open() as file:
        header = file.readline()
    return vub.read(path) if "uwb_m" in header else murp.read(path)


READERS: dict[str, Callable[[Path], Recording]] = {
    ".pyfg": pyfg.read,
    ".csv": _csv,
    ".mat": range_only_cl.read,
}
EDGE_FILE = "params_estimate_*.txt"
"""What a folder with relative poses instead of ranges holds."""


def has_edges(path: Path) -> bool:
    """Is it a recording of relative poses, without ranges?"""
    return path.is_dir() and any(path.glob(EDGE_FILE))


def read(path: Path) -> Recording:
    """Read a recording.

    Raises:
        BadRecording: no reader for this ending, no such file, or a file that cannot be used.
    """
    reader = READERS.get(path.suffix)
    if reader is None:
        raise BadRecording(
            f"{path}: readers exist for {', '.join(READERS)}, and for folders with {EDGE_FILE}"
        )
    try:
        return reader(path)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise BadRecording(f"{path}: {reason}") from None


def read_edges(path: Path) -> EdgeRecording:
    """Read a folder of `has_edges`.

    Raises:
        BadRecording: a file in it that cannot be used.
    """
    try:
        return swust.read(path)
    except (OSError, UnicodeDecodeError) as error:
        raise BadRecording(f"{path}: {error}") from None
