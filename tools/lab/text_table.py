"""A CSV file with a header as arrays of numbers."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from lab.recordings import text_lines
from lab.recordings.recording import Array, BadRecording


def columns(path: Path) -> dict[str, Array]:
    """Every column by its name; comments and a byte order mark say nothing.

    Raises:
        BadRecording: a row of another length, a cell that is not a finite number, two columns of
            one name, or fewer than two rows.
    """
    lines = text_lines.text(path).splitlines()
    numbered = [
        (number, line)
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.lstrip().startswith(text_lines.COMMENTS)
    ]
    try:
        rows = list(csv.reader(line for _, line in numbered))
    except csv.Error as error:
        raise BadRecording(f"{path.name}: not a table of cells with commas ({error})") from None
    header = [name.strip() for name in rows[0]] if rows else []
    if len(set(header)) < len(header):
        raise BadRecording(f"{path.name}: two columns have the same name")
    values = []
    for (number, _), row in zip(numbered[1:], rows[1:], strict=False):
        if len(row) != len(header):
            raise BadRecording(f"{path.name} line {number}: {len(row)} cells, not {len(header)}")
        try:
            values.append([text_lines.number(cell) for cell in row])
        except ValueError as error:
            raise BadRecording(f"{path.name} line {number}: {error}") from None
    if len(values) < 2:
        raise BadRecording(f"{path.name}: fewer than two rows")
    return dict(zip(header, np.array(values).T, strict=True))
