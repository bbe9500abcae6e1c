"""Reader of three robots with odometry and relative poses made from LinkTrack ranges (SWUST).

A folder of tab-separated text: ``droneN_odom.txt`` (name, Unix s, x, y, yaw at 50 Hz),
``gt_N_interpolation.txt`` (the same columns by AMCL, every 0.2 m; the first line is older than the
drive) and ``params_estimate_I_J.txt`` (I, J, Unix s, then the pose of J in the frame of I).

Odometry was started at the true pose upstream; here every robot's begins at zero. The edges come
without covariances. Their errors against AMCL are 0.07 m and 2 to 3 degrees (one sigma) around an
offset of 0.03 to 0.13 m for each pair, with tails to 0.30 m and 12 degrees; `SIGMAS` covers those
with two and three and a half sigma. Time shifts were not found.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from lab.recordings import text_lines
from lab.recordings.recording import Array, BadRecording, EdgeRecording, Trail
from lab.score import metrics

SIGMAS = 0.15, math.radians(3.5)
EVERY = 5
"""Of 50 Hz odometry one in five is kept: the team's own grid has 10 Hz."""


def read(folder: Path) -> EdgeRecording:
    """Read the folder.

    Raises:
        BadRecording: a file is missing or has another layout.
    """
    files = sorted(folder.glob("drone*_odom.txt"))
    edges = sorted(folder.glob("params_estimate_*_*.txt"))
    if not files or not edges:
        raise BadRecording(f"{folder}: no droneN_odom.txt and params_estimate_I_J.txt in it")
    tables, truths = {}, {}
    for file in files:
        robot = _number(file)
        tables[robot] = _table(file, 1)[::EVERY]
        truths[robot] = _table(folder / f"gt_{robot}_interpolation.txt", 1)[1:]
    start = max(float(truth[0, 0]) for truth in truths.values()) - 0.1
    trails = {r: _trail(r, tables[r], truths[r], start) for r in tables}
    rows = []
    for file in edges:
        table = _table(file, 2)
        a, b = (int(n) for n in file.stem.split("_")[-2:])
        ends = np.tile([float(a), float(b)], (len(table), 1))
        rows.append(np.column_stack([table[:, 0] - start, ends, table[:, 1:4]]))
    joined = np.concatenate(rows)
    covered = np.ones(len(joined), dtype=bool)
    for column in (1, 2):
        trail = [trails[int(r)] for r in joined[:, column]]
        covered &= [x.t[0] <= t <= x.t[-1] for x, t in zip(trail, joined[:, 0], strict=True)]
    joined = joined[covered]
    return EdgeRecording(
        folder.name, trails, joined[np.argsort(joined[:, 0], kind="stable")], SIGMAS
    )


def _trail(robot: int, table: Array, truth: Array, start: float) -> Trail:
    """Odometry from zero while there is a truth."""
    t = table[:, 0]
    inside = (t >= truth[0, 0]) & (t <= truth[-1, 0])
    odometry = table[inside, 1:4]
    odometry[:, 2] = np.unwrap(odometry[:, 2])
    zeroed = metrics.relative(odometry[:1], odometry)
    zeroed[:, 2] = odometry[:, 2] - odometry[0, 2]
    true = metrics.at_times(truth[:, 0], truth[:, 1:4], t[inside])
    return Trail(robot, t[inside] - start, zeroed, true)


def _number(file: Path) -> int:
    digits = re.search(r"\d+", file.stem)
    if digits is None:
        raise BadRecording(f"{file.name}: the name holds no number of a robot")
    return int(digits[0])


def _table(file: Path, names: int) -> Array:
    """(k, 4) Unix s, x, y, yaw after so many columns of names; stamps ascending."""
    rows = []
    for number, words in text_lines.worded(file):
        try:
            rows.append(text_lines.numbers(words[names : names + 4], "t x y yaw"))
        except ValueError as error:
            raise BadRecording(f"{file.name} line {number}: {error}") from None
    table = np.array(rows).reshape(-1, 4)
    if len(table) < 3:
        raise BadRecording(f"{file.name}: fewer than three lines")
    fresh = np.concatenate([[True], np.diff(np.maximum.accumulate(table[:, 0])) > 0])
    return np.asarray(table[fresh])
