"""What tests of real recordings share: where they are, and how wrong their ranges are."""

from __future__ import annotations

import numpy as np
from lab.recordings.recording import Array, Recording
from lab.score import metrics
from places import SHARED

DATA = SHARED / "data"


def range_errors(found: Recording, a: int, b: int) -> Array:
    """Measured minus true distance of one pair, antenna to antenna."""
    rows = found.ranges[(found.ranges[:, 1] == a) & (found.ranges[:, 2] == b)]
    ends = []
    for robot in (a, b):
        trail = found.trails[robot]
        pose = metrics.at_times(trail.t, trail.truth, rows[:, 0])
        antenna = np.array([*found.antennas.get(robot, (0.0, 0.0)), 0.0])
        ends.append(metrics.compose(pose, antenna))
    return np.asarray(rows[:, 3] - np.hypot(*(ends[1] - ends[0])[:, :2].T))
