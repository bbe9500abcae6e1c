"""Reader of LinkTrack ranges between robots with motion capture (MURP, ``*_base-A_targ-B_*.csv``).

One row per second, every column the mean of that second of raw data: true poses of both robots
(m, degrees), and ``I_J``, the range from tag I of the base to tag J of the target.

Which tags: tag 1 of each robot. Robots 2 and 3 carry theirs at the same height; robot 1 carries
them 1.25 m higher, so read a file of 2 and 3. A tag sits beside the middle of its robot: where,
follows from the true distance of the two tags, which the file gives too (`mounted`).

Time: ranges and poses of a row are means of one and the same second. Regression of the range errors
of robots 2 and 3 on the rate of the true range gives a shift of 0.00 to 0.01 s for these tags
(-0.04 to +0.09 s over all 36 pairs, which is their bias by bearing rather than time), so both are
stamped alike, with the middle of the second.

Body: the frames of the motion capture are turned by 3.0 (robot 2) and 1.5 degrees (robot 3) from
where the robots drive, and 0.01 m off the axle; poses are carried there (`lab.seat`).

Odometry was not recorded: it is made out of the truth by the noise model of the simulator
(`world.wrong`), at 10 Hz along a smooth curve through the poses; the seed is the reader's.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from lab.recordings import world
from lab.recordings.recording import Array, BadRecording, Recording, Trail
from lab.recordings.seat import on_axle
from lab.text_table import columns

TAG = 1
ODOMETRY_S = 0.1


def read(path: Path, seed: int = 0) -> Recording:
    """Read one file.

    Args:
        seed: of the odometry that is made up.

    Raises:
        BadRecording: another name than MURP gives, or a column is missing.
    """
    name = re.search(r"_base-(\d+)_targ-(\d+)_", path.name)
    if not name:
        raise BadRecording(f"{path.name}: the name does not say _base-A_targ-B_")
    table = columns(path)
    if not {"t", "A_x", "B_yaw", f"{TAG}_{TAG}", f"{TAG}_{TAG}_t"} <= set(table):
        raise BadRecording(f"{path.name}: not the columns of MURP")
    robots = int(name[1]), int(name[2])
    rng = np.random.default_rng(seed)
    t = table["t"] - table["t"][0] + 0.5
    poses = {r: on_axle(t, _poses(table, side)) for r, side in zip(robots, "AB", strict=True)}
    trails = {}
    for robot in sorted(robots):
        when = np.arange(t[0], t[-1] + ODOMETRY_S / 2, ODOMETRY_S)
        truth = np.asarray(CubicSpline(t, poses[robot])(when))
        odometry = world.wrong(rng, truth, world.OdometryModel())
        trails[robot] = Trail(robot, when, odometry, truth)
    metres = table[f"{TAG}_{TAG}"]
    who = np.tile(np.array(robots, dtype=float), (len(t), 1))
    antennas = mounted(table, poses[robots[0]], poses[robots[1]])
    ranges = np.column_stack([t, who, metres])
    named = dict(zip(robots, antennas, strict=True))
    return Recording(path.name, trails, ranges, antennas=named)


def _poses(table: dict[str, Array], side: str) -> Array:
    yaw = np.unwrap(np.radians(table[f"{side}_yaw"]))
    return np.column_stack([table[f"{side}_x"], table[f"{side}_y"], yaw])


def mounted(
    table: dict[str, Array], a: Array, b: Array
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Places of the two tags in their robots, from the true distance between them.

    Heights enter as one unknown difference.
    """
    true = table[f"{TAG}_{TAG}_t"]

    def error(x: Array) -> Array:
        ends = []
        for pose, (mx, my) in ((a, x[:2]), (b, x[2:4])):
            cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
            ends.append(pose[:, :2] + np.stack([cos * mx - sin * my, sin * mx + cos * my], -1))
        return np.asarray(np.sqrt(np.sum((ends[1] - ends[0]) ** 2, axis=1) + x[4] ** 2) - true)

    best = least_squares(error, np.array([0.0, 0.0, 0.0, 0.0, 0.1]), loss="soft_l1", f_scale=0.02)
    ax, ay, bx, by, _ = best.x.tolist()
    return (ax, ay), (bx, by)
