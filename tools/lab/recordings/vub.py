"""Reader of two TurtleBots with UWB and visual-inertial odometry (VUB, ``expN_los.csv``).

One row per 0.1 s: Unix time, distance between the two tags, and for each robot the true pose in
the room and the pose of its camera by its own odometry. The tag of the first robot measures.

Camera and marker sit neither on the axle nor along the course (measured in all runs alike: cameras
0.06 and 0.07 m behind it and 1.0 and 0.3 degrees off, markers 0.08 and 0.11 m and 0.5 and 2.0
degrees): both trajectories are carried to the axle, each by what its own motion says (`lab.seat`).
The tags are taken to sit on the axle (ranges against the truth: 0.05 m behind it).

What is left as it is, because a team has to live with it: ranges are about 0.1 s early against the
truth, their bias is -0.09 m, odometry counts 15 to 21 % too much, and in some runs it fails for
moments. Distances that only repeat the row before (upstream resampled 24 Hz by the last value) are
left out.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from lab.recordings.recording import Array, BadRecording, Recording, Trail
from lab.recordings.seat import on_axle
from lab.text_table import columns


def read(path: Path) -> Recording:
    """Read one file.

    Raises:
        BadRecording: a column is missing, or a cell is not a number.
    """
    table = columns(path)
    robots = sorted(int(m[1]) for m in (re.fullmatch(r"tb(\d+)_odo_yaw", c) for c in table) if m)
    if len(robots) != 2 or not {"t", "uwb_m"} <= set(table):
        raise BadRecording(f"{path.name}: not t, uwb_m and the columns of two robots")
    t = table["t"] - table["t"][0] + 0.1
    trails = {
        robot: Trail(
            robot,
            t,
            on_axle(t, _poses(path, table, f"tb{robot}_odo")),
            on_axle(t, _poses(path, table, f"tb{robot}_gt")),
        )
        for robot in robots
    }
    metres = table["uwb_m"]
    fresh = np.concatenate([[True], np.diff(metres) != 0])
    who = np.tile(np.array(robots, dtype=float), (int(fresh.sum()), 1))
    return Recording(path.name, trails, np.column_stack([t[fresh], who, metres[fresh]]))


def _poses(path: Path, table: dict[str, Array], prefix: str) -> Array:
    names = [f"{prefix}_{column}" for column in ("x", "y", "yaw")]
    if not set(names) <= set(table):
        raise BadRecording(f"{path.name}: no columns {', '.join(names)}")
    x, y, yaw = (table[name] for name in names)
    return np.column_stack([x, y, np.unwrap(yaw)])
