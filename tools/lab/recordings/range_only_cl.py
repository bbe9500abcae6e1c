"""Reader of two robots and two standing nodes with ranges at 100 Hz (range_only_CL, ``.mat``).

``range_m``: pair, t (s), range (m). ``robot``: id, wheel odometry as v_m, omega_m at t_m (20 Hz),
poses of a lidar SLAM as x, y, phi at t (2 Hz), which serve as truth. One clock in all of them.
The robot with the lower id measures; standing nodes measure nothing, as nobody would hear them.
Ranges come out 0.54 to 0.65 m too short, some even negative: left as they are. A time shift between
ranges and truth is below 0.1 s (a 2 Hz truth shows no more).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from lab.recordings.recording import Array, BadRecording, Recording, Trail
from lab.score.metrics import at_times


def read(path: Path) -> Recording:
    """Read one file.

    Raises:
        BadRecording: not a MATLAB file of this layout.
    """
    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except OSError:
        raise
    except Exception as error:  # the parser ends with whatever a damaged file makes of it
        reason = str(error).partition("\n")[0][:80]
        raise BadRecording(f"{path.name}: not a file of MATLAB ({reason})") from None
    try:
        robots, pairs = np.atleast_1d(content["robot"]), np.atleast_1d(content["range_m"])
        found = {int(robot.id): _robot(robot) for robot in robots}
        measured = [_pair(pair, set(found)) for pair in pairs]
    except (ValueError, KeyError, AttributeError, TypeError) as error:
        raise BadRecording(f"{path.name}: not a recording of range_only_CL ({error})") from None
    ranges = np.concatenate([np.zeros((0, 4)), *measured])
    start = min(t[0] for t, _, _ in found.values()) - 0.1
    trails = {
        robot: Trail(robot, t - start, odometry, truth)
        for robot, (t, odometry, truth) in found.items()
    }
    end = max(float(trail.t[-1]) for trail in trails.values())
    ranges[:, 0] -= start
    ranges = ranges[(ranges[:, 0] > 0) & (ranges[:, 0] < end)]
    return Recording(path.name, trails, ranges[np.argsort(ranges[:, 0], kind="stable")])


def _robot(robot: Any) -> tuple[Array, Array, Array]:
    """Stamps, odometry and truth while there is a truth."""
    t, v, omega = (np.asarray(x, dtype=float) for x in (robot.t_m, robot.v_m, robot.omega_m))
    late = np.concatenate([[True], np.diff(np.maximum.accumulate(t)) > 0])
    t, v, omega = t[late], v[late], omega[late]
    step = np.diff(t)
    # a speed is that of the time up to its stamp
    turn = np.concatenate([[0.0], omega[1:] * step])
    way = np.concatenate([[0.0], v[1:] * step])
    heading = np.cumsum(turn)
    middle = heading - turn / 2
    x, y = np.cumsum(way * np.cos(middle)), np.cumsum(way * np.sin(middle))
    known = (t >= robot.t[0]) & (t <= robot.t[-1])
    slam = np.column_stack([robot.x, robot.y, robot.phi]).astype(float)
    truth = at_times(np.asarray(robot.t, dtype=float), slam, t[known])
    return t[known], np.column_stack([x, y, heading])[known], truth


def _pair(pair: Any, robots: set[int]) -> Array:
    """(k, 4) rows of a recording; none of two standing nodes."""
    ids = sorted((int(i) for i in pair.pair), key=lambda i: (i not in robots, i))
    if ids[0] not in robots:
        return np.zeros((0, 4))
    t, metres = np.asarray(pair.t, dtype=float), np.asarray(pair.range, dtype=float)
    return np.column_stack([t, np.full(len(t), ids[0]), np.full(len(t), ids[1]), metres])
