"""Lines of words in text files, as tools write them: with comments, blanks, a byte order mark."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from lab.recordings.recording import BadRecording

COMMENTS = ("#", "//", "%")
MOST_BYTES = 1 << 30
"""No recording of a team is so long; a larger file is something else, and would fill the memory."""


MOST = 1e15
"""Of any number: far above every UNIX time in seconds, far below where squares overflow."""


def text(path: Path) -> str:
    """What stands in a file, without a byte order mark.

    Raises:
        BadRecording: it is not text, or far too long. OSError: it cannot be read.
    """
    if path.is_file() and path.stat().st_size > MOST_BYTES:
        raise BadRecording(f"{path.name}: more than {MOST_BYTES >> 30} GiB, no recording of a team")
    try:
        found = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise BadRecording(f"{path.name}: not a text file") from None
    if "\x00" in found:
        raise BadRecording(f"{path.name}: not a text file")
    return found


def worded(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Number of each line, from 1, and its words; neither blank lines nor comments.

    Raises:
        BadRecording, OSError: see `text`.
    """
    for number, line in enumerate(text(path).splitlines(), start=1):
        words = line.split()
        if words and not words[0].startswith(COMMENTS):
            yield number, words


def number(word: str) -> float:
    """A finite number.

    Raises:
        ValueError: it is none; the text says what it is.
    """
    try:
        value = float(word)
    except ValueError:
        raise ValueError(f"{word[:40]!r} is not a number") from None
    if not math.isfinite(value):
        raise ValueError(f"{word[:40]} is not a finite number")
    if abs(value) > MOST:
        raise ValueError(f"{word[:40]} is too large: seconds, metres and radians are read")
    return value


def numbers(words: list[str], names: str) -> list[float]:
    """As many finite numbers as there are names.

    Args:
        names: of the numbers, for the sentence.

    Raises:
        ValueError: another count, or one that is no number.
    """
    count = len(names.split())
    if len(words) != count:
        raise ValueError(f"{len(words)} numbers stand there, {count} belong there: {names}")
    return [number(word) for word in words]
