"""A CSV file with a header as arrays of numbers."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from lab.recordings.recording import Array, BadRecording


def columns(path: Path) -> dict[str, Array]:
    """Every column by its name.

    Raises:
        BadRecording: a row of another length, a cell that is not a finite number, or fewer than
            two rows.
    """
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    header, body = (rows[0] if rows else []), rows[1:]
    values = []
    for number, row in enumerate(body, start=2):
        if len(row) != len(header):
            raise BadRecording(f"{path.name} line {number}: {len(row)} cells, not {len(header)}")
        try:
            values.append([float(cell) for cell in row])
        except ValueError as error:
            raise BadRecording(f"{path.name} line {number}: {error}") from None
    table = np.array(values).reshape(len(body), len(header))
    if len(table) < 2 or not np.isfinite(table).all():
        raise BadRecording(f"{path.name}: fewer than two rows, or a number that is not finite")
    return dict(zip(header, table.T, strict=True))
