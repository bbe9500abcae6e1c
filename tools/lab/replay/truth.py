"""Where robots truly were: TUM or CSV files in UNIX time, one for each robot.

    TUM   t x y z qx qy qz qw        lines that begin with # are comments
    CSV   a header with t, x, y and theta (or yaw), in s, m and rad, in any order

A file belongs to the robot whose number is the last one in its name: ``robot_3.tum``, ``3.csv``.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np

from lab.recordings.recording import Array, BadRecording

NAMES = {
    "t": ("t", "time", "timestamp", "stamp"),
    "x": ("x", "x_m"),
    "y": ("y", "y_m"),
    "theta": ("theta", "yaw", "theta_rad", "yaw_rad", "heading"),
}
"""What columns of a CSV may be called, in small letters."""
ENDINGS = (".tum", ".txt", ".csv")
FEWEST = 2


def read(path: Path) -> dict[int, Array]:
    """(k, 4) of t (s, UNIX time, ascending), x, y (m), theta (rad) for each robot.

    Args:
        path: a file, or a folder of them.

    Raises:
        BadRecording: a file that cannot be used, or none.
    """
    files = [path]
    if path.is_dir():
        files = sorted(p for p in path.iterdir() if p.suffix.lower() in ENDINGS)
    if not files:
        raise BadRecording(f"{path}: no truth in it: robot_<id> with {', '.join(ENDINGS)}")
    out: dict[int, Array] = {}
    for file in files:
        robot = _robot(file)
        if robot in out:
            raise BadRecording(f"{file}: another file is the truth of robot {robot} already")
        out[robot] = _read(file)
    return out


def _robot(file: Path) -> int:
    numbers = re.findall(r"\d+", file.stem)
    if not numbers:
        raise BadRecording(f"{file}: its name has no number of a robot, as robot_3.tum has")
    return int(numbers[-1])


def _read(file: Path) -> Array:
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise BadRecording(f"{file}: {reason}") from None
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip()]
    rows = [(n, line) for n, line in lines if not line.lstrip().startswith("#")]
    if len(rows) < FEWEST:
        raise BadRecording(f"{file}: fewer than {FEWEST} poses")
    found = _tum(file, rows) if file.suffix.lower() != ".csv" else _csv(file, rows)
    if not np.isfinite(found).all():
        raise BadRecording(f"{file}: a number that is not finite")
    found = found[np.argsort(found[:, 0], kind="stable")]
    found[:, 3] = np.unwrap(found[:, 3])
    return found


def _tum(file: Path, rows: list[tuple[int, str]]) -> Array:
    table = np.array([_numbers(file, n, line.split(), 8) for n, line in rows])
    qx, qy, qz, qw = table[:, 4:].T
    theta = np.arctan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy**2 + qz**2))
    return np.column_stack([table[:, :3], theta])


def _csv(file: Path, rows: list[tuple[int, str]]) -> Array:
    split = [(n, next(csv.reader([line]))) for n, line in rows]
    header = [name.strip().lower() for name in split[0][1]]
    columns = []
    for wanted, names in NAMES.items():
        found = [header.index(name) for name in names if name in header]
        if not found:
            raise BadRecording(f"{file}: no column {wanted} in its header ({', '.join(header)})")
        columns.append(found[0])
    parts = [
        (n, [cells[c] for c in columns] if len(cells) > max(columns) else [])
        for n, cells in split[1:]
    ]
    return np.array([_numbers(file, n, cells, 4) for n, cells in parts]).reshape(-1, 4)


def _numbers(file: Path, line: int, words: list[str], count: int) -> list[float]:
    try:
        numbers = [float(word) for word in words]
    except ValueError as error:
        raise BadRecording(f"{file}, line {line}: {error}") from None
    if len(numbers) != count:
        raise BadRecording(f"{file}, line {line}: {len(numbers)} numbers, not {count}")
    return numbers
