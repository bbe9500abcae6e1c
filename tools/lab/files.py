"""Files that commands read and write: looked at before a long run, and results whole or not there.

Whoever waited minutes for a result is not told then that there is no place for it, and what failed
never stands where something good stood.
"""

from __future__ import annotations

import argparse
import io
import os
import sys
from pathlib import Path
from typing import Any

from drslamd.export.files import replaced
from lab.recordings.recording import BadRecording

CANNOT_WRITE = 73


def result_file(text: str) -> Path:
    """The type of an argument that names a file to be written; nothing is made yet.

    Raises:
        argparse.ArgumentTypeError: it could not be written.
    """
    path = Path(text)
    folder = next(place for place in path.absolute().parents if place.exists())
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{path} is a folder; name a file")
    if not folder.is_dir():
        raise argparse.ArgumentTypeError(f"{folder} is a file and no folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise argparse.ArgumentTypeError(f"{folder}: Permission denied")
    return path


def sections(path: Path | None) -> str:
    """Sections of TOML for every robot; none where no file is named.

    Raises:
        BadRecording: the file cannot be read.
    """
    try:
        return path.read_text() if path is not None else ""
    except OSError as error:
        raise BadRecording(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadRecording(f"{path}: not a text file; name a TOML file") from None


def keep(path: Path | None, content: str | bytes) -> int:
    """Write a result, if one is wanted, whole or not at all; the exit code, after a sentence."""
    if path is None:
        return 0
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replaced(path, content)
    except OSError as error:
        print(f"{path}: {error.strerror}; what was there before is still there", file=sys.stderr)
        return CANNOT_WRITE
    return 0


def drawn(figure: Any, path: Path) -> int:
    """Write a figure of matplotlib by the ending of its name, as `keep` does; the exit code."""
    out = io.BytesIO()
    figure.savefig(out, format=path.suffix.lstrip(".") or "png")
    return keep(path, out.getvalue())


def beside_a_good_one(path: Path) -> Path:
    """Where the result of a run goes that failed."""
    return path.with_name(f"{path.stem}-failed{path.suffix}")
