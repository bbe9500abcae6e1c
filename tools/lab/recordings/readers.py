"""Readers of recordings by what the file is (tools/README.md says how to add one)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from drslamd.conventions import MAX_ROBOT_ID
from lab.recordings import murp, pyfg, range_only_cl, swust, text_lines, vub
from lab.recordings.recording import BadRecording, EdgeRecording, Recording


def _csv(path: Path) -> Recording:
    """Two layouts share this ending; their headers differ."""
    header = next((words for _, words in text_lines.worded(path)), [])
    return vub.read(path) if any("uwb_m" in word for word in header) else murp.read(path)


SHORTEST_S = 0.05
LONGEST_S = 86_400.0
"""A day. Who says more has two clocks in one file, or nanoseconds."""

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
        return playable(reader(path))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise BadRecording(f"{path}: {reason}") from None


def playable(recording: Recording) -> Recording:
    """The same, when a team can be played with it.

    Raises:
        BadRecording: it cannot.
    """
    name, trails = recording.name, recording.trails
    ids = {*trails, *np.unique(recording.ranges[:, 1:3]).astype(int).tolist()}
    if max(ids) > MAX_ROBOT_ID:
        raise BadRecording(f"{name}: {len(ids)} robots and nodes, {MAX_ROBOT_ID + 1} can be named")
    for robot, trail in trails.items():
        if len(trail.t) < 2 or not (np.diff(trail.t) > 0).all():
            raise BadRecording(
                f"{name}: robot {robot} has no two poses, or stamps that do not rise"
            )
        if trail.t[-1] - trail.t[0] < SHORTEST_S:
            raise BadRecording(
                f"{name}: robot {robot} is there for {trail.t[-1] - trail.t[0]:.3f} s; stamps are "
                f"in seconds, and {SHORTEST_S} s are the least that can be played"
            )
    if recording.duration > LONGEST_S:
        raise BadRecording(
            f"{name}: {recording.duration / 3600:.0f} hours from the first stamp to the last; "
            f"stamps are in seconds on one clock, and {LONGEST_S / 3600:.0f} hours are the most"
        )
    return recording


def read_edges(path: Path) -> EdgeRecording:
    """Read a folder of `has_edges`.

    Raises:
        BadRecording: a file in it that cannot be used.
    """
    try:
        return swust.read(path)
    except (OSError, UnicodeDecodeError) as error:
        raise BadRecording(f"{path}: {error}") from None
