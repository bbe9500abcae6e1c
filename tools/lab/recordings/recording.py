"""What a team recorded: wheels, ranges and truth, whoever recorded it.

Times are seconds from the start of the recording on one clock; the shells that play a recording
give every robot a clock of its own. Truth is for scoring only and never reaches a robot.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


class BadRecording(Exception):
    """The file cannot be used; the text says where and why."""


@dataclass(frozen=True)
class Trail:
    """One robot.

    Attributes:
        t: (m,) stamps of the odometry, s, ascending.
        odometry: (m, 3) dead-reckoned poses, m and rad, any start, angle counting on.
        truth: (m, 3) true poses at the same stamps.
        gyro: (m,) the angle that a gyro says, rad, where the base has one.
    """

    robot: int
    t: Array
    odometry: Array
    truth: Array
    gyro: Array | None = None


@dataclass(frozen=True)
class Recording:
    """A team.

    Attributes:
        ranges: (k, 4) time s, id of the module that measured, id of the other one, range m;
            ascending in time. Ids that have no trail are standing nodes.
        antennas: (x, y) of a module's antenna in its robot's body frame, m, where it is not at the
            origin; a mounting that anyone can measure, so the robots' configurations hold it.
        nodes: where standing nodes really are, as far as that is known.
    """

    name: str
    trails: dict[int, Trail]
    ranges: Array
    notes: dict[str, object] = field(default_factory=dict)
    antennas: dict[int, tuple[float, float]] = field(default_factory=dict)
    nodes: dict[int, tuple[float, float]] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """Seconds to the last stamp of anything."""
        ends = [float(trail.t[-1]) for trail in self.trails.values()]
        return max(ends + [float(t) for t in self.ranges[-1:, 0]])


@dataclass(frozen=True)
class EdgeRecording:
    """A team whose relative poses were already estimated by others: food for modules 2 and 3.

    Attributes:
        edges: (k, 6) time s, robot a, robot b, x, y (m) and yaw (rad) of b in the frame of a.
        sigmas: (m, rad) of an edge, as measured by whoever read the recording.
    """

    name: str
    trails: dict[int, Trail]
    edges: Array
    sigmas: tuple[float, float]


def wheel_paths(trail: Trail, track_m: float) -> tuple[Array, Array]:
    """Cumulative path of the left and the right wheel, m, (m,) each.

    Each step of the odometry is taken as an arc whose chord is its forward part; what moved
    sideways has no wheel to show it.
    """
    step = np.diff(trail.odometry, axis=0)
    middle = (trail.odometry[1:, 2] + trail.odometry[:-1, 2]) / 2
    forward = step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle)
    distance = forward / np.sinc(step[:, 2] / (2 * np.pi))
    turn = step[:, 2] * track_m / 2
    left = np.concatenate([[0.0], np.cumsum(distance - turn)])
    right = np.concatenate([[0.0], np.cumsum(distance + turn)])
    return left, right
